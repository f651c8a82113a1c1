#!/usr/bin/python3
"""Checks that the options of `palpate COMMAND ...` that pages show exist.

    commands.py PALPATE CHECKOUT

Looks at code of README.md, docs/guide and docs/reference: fenced and indented blocks, and lines that go
on behind a backslash. Options are those that `palpate COMMAND --help` lists.
"""

import glob
import os
import re
import subprocess
import sys


def code_lines(text):
    """Lines of code, those that end with a backslash joined with the next."""
    fenced, out = False, []
    for line in text.splitlines():
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            if out and out[-1].endswith("\\"):
                out[-1] = out[-1][:-1] + line
            else:
                out.append(line)
    return out


def main():
    palpate, root = sys.argv[1], sys.argv[2]
    options, faults, seen = {}, [], 0

    def options_of(command):
        if command not in options:
            run = subprocess.run([palpate, command, "--help"], capture_output=True, text=True)
            found = set(re.findall(r"(?<![\w-])(--?[a-z][\w-]*)", run.stdout))
            options[command] = found | {"--quiet", "--verbose", "--profile"} if run.returncode == 0 else None
        return options[command]

    pages = ["README.md"] + sorted(glob.glob("docs/guide/*.md", root_dir=root))
    pages += sorted(glob.glob("docs/reference/*.md", root_dir=root))
    for page in pages:
        for line in code_lines(open(os.path.join(root, page), encoding="utf-8").read()):
            line = re.sub(r"'[^']*'|#.*", "", line)
            match = re.search(r"(?:^|[\s/])palpate (?:--\w+ )*([a-z]+)(.*)", line)
            if not match:
                continue
            known = options_of(match.group(1))
            if known is None:
                faults.append(f"{page}: palpate {match.group(1)}: no such command")
                continue
            seen += 1
            for option in re.findall(r"(?<=\s)(--?[a-z][\w-]*)", match.group(2)):
                if option not in known:
                    faults.append(f"{page}: palpate {match.group(1)}: no option {option}")
    if seen < 50:
        faults.append(f"expected 50 commands at least, found {seen}")
    print("\n".join(faults) or f"{seen} commands: every option exists")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
