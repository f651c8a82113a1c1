#!/usr/bin/python3
"""Checks that what README.md, CONTRIBUTING.md and docs name is there.

    links.py CHECKOUT [--self-test]

Every relative link leads to a file, and where it has one, to a heading of it. Every file that a text
or an example names by its path from the checkout exists, as does every page that a source names, and every
page is reached by links from README.md. Every picture of docs/pictures is shown on a page and drawn by scripts/pictures
or scripts/plots. Files named in docs/decisions and docs/log may be gone: those pages say how things were.
--self-test: finds one fault of each kind in pages made for it.
"""

import glob
import os
import re
import sys
import tempfile

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
FOLDERS = "apps|bench|cmake|docs|engine|examples|golden|haptics|python|scripts|shaders|tests"
SOURCES = "apps|bench|cmake|engine|examples|haptics|python|scripts|shaders|tests"
BY_HAND = {"space.svg"}  # a diagram
NAMED = re.compile(r"(?<![\w./-])((?:\.ci|%s)/[\w.*?/{},-]*[\w*}])" % FOLDERS)


def without_code(text):
    return re.sub(r"`[^`\n]*`", "", re.sub(r"```.*?```", "", text, flags=re.S))


def anchors(path):
    """The names GitHub gives to the headings of a page."""
    found, text = set(), re.sub(r"```.*?```", "", open(path, encoding="utf-8").read(), flags=re.S)
    for heading in re.findall(r"^#+ +(.*)$", text, flags=re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        found.add(re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-"))
    return found


def names_of(pattern):
    """The file names that "a/b.{h,cpp}" stands for."""
    match = re.search(r"\{([^{}]*)\}", pattern)
    if not match:
        return [pattern]
    ends = match.group(1).split(",")
    return [n for e in ends for n in names_of(pattern[: match.start()] + e + pattern[match.end() :])]


def faults_of(root):
    faults, linked = [], {}
    pages = ["README.md", "CONTRIBUTING.md"]
    pages += sorted(glob.glob("docs/**/*.md", root_dir=root, recursive=True))
    for page in pages:
        path = os.path.join(root, page)
        text = open(path, encoding="utf-8").read()
        linked[page] = set()
        for target in LINK.findall(without_code(text)):
            if re.match(r"[a-z]+:", target):
                continue
            name, _, anchor = target.partition("#")
            there = os.path.normpath(os.path.join(os.path.dirname(path), name)) if name else path
            if not os.path.exists(there):
                faults.append(f"{page}: the link to {target} leads nowhere")
                continue
            linked[page].add(os.path.relpath(there, root))
            if anchor and anchor not in anchors(there):
                faults.append(f"{page}: the link to {target} leads to no heading")
        if page.startswith(("docs/decisions/", "docs/log/")):
            continue
        for named in sorted(set(NAMED.findall(LINK.sub("", text)))):
            for name in names_of(named):
                if not glob.glob(os.path.join(root, name)):
                    faults.append(f"{page}: names {name}, which is not there")
    for folder in SOURCES.split("|"):
        for path in sorted(glob.glob(f"{root}/{folder}/**/*.*", recursive=True)):
            if os.path.isfile(path) and not path.endswith("links.py"):
                text = open(path, encoding="utf-8", errors="replace").read()
                for page in sorted(set(re.findall(r"docs/[\w/.-]+\.md", text))):
                    if not os.path.exists(os.path.join(root, page)):
                        faults.append(f"{os.path.relpath(path, root)}: names {page}, which is not there")
    reached, left = set(), ["README.md"]
    while left:
        page = left.pop()
        if page in linked and page not in reached:
            reached.add(page)
            left += linked[page]
    faults += [f"{page}: no link from README.md leads here" for page in pages if page not in reached]
    shown = set().union(*linked.values())
    drawn = "".join(open(path, encoding="utf-8").read() for path in sorted(glob.glob(f"{root}/scripts/p*")) if os.path.isfile(path))
    for path in sorted(glob.glob("docs/pictures/*", root_dir=root)):
        stem, end = os.path.splitext(os.path.basename(path))
        if path not in shown:
            faults.append(f"{path}: no page shows it")
        # "draw NAME", "overlay NAME", FOLDER/NAME.png, a word of a list of FILE:NAME, or a name in quotes
        if stem + end not in BY_HAND and not re.search(rf"(draw |overlay |[/:\"]){stem}(\{end}|[\s\";])", drawn):
            faults.append(f"{path}: drawn neither by scripts/pictures nor by scripts/plots")
    return faults


def self_test():
    pages = {
        "README.md": "[a](docs/a.md#no-heading) [b](CONTRIBUTING.md) [c](docs/gone.md)\n"
        "```\n[code](is/not/followed)\n```\n",
        "CONTRIBUTING.md": "# A: heading\n[here](#a-heading) see engine/x.{h,cpp}\n",
        "docs/a.md": "# Some heading\n`scripts/y` [r](../README.md) ![n](pictures/new.png)\n",
        "docs/alone.md": "",
        "engine/x.h": "// docs/a.md, docs/b.md",
        "docs/pictures/old.png": "",
        "docs/pictures/new.png": "",
        "scripts/pictures": "draw new 384\n",
    }
    with tempfile.TemporaryDirectory() as root:
        for name, text in pages.items():
            os.makedirs(os.path.dirname(os.path.join(root, name)) or root, exist_ok=True)
            open(os.path.join(root, name), "w", encoding="utf-8").write(text)
        found = faults_of(root)
    expected = [
        "README.md: the link to docs/a.md#no-heading leads to no heading",
        "README.md: the link to docs/gone.md leads nowhere",
        "CONTRIBUTING.md: names engine/x.cpp, which is not there",
        "docs/a.md: names scripts/y, which is not there",
        "engine/x.h: names docs/b.md, which is not there",
        "docs/alone.md: no link from README.md leads here",
        "docs/pictures/old.png: no page shows it",
        "docs/pictures/old.png: drawn neither by scripts/pictures nor by scripts/plots",
    ]
    return [] if found == expected else [f"expected {expected}, found {found}"]


if __name__ == "__main__":
    faults = self_test() if "--self-test" in sys.argv else faults_of(sys.argv[1])
    print("\n".join(faults) or "every link and every named file is there")
    sys.exit(1 if faults else 0)
