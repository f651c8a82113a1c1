#!/usr/bin/python3
"""Runs every command of the pages, as a reader would type them.

    run_pages.py PALPATE CHECKOUT WORK_FOLDER [--python FOLDER] [--shared FOLDER] [PAGE...]

The commands of a page are its fenced `sh` blocks, its indented blocks that begin with a command, and its `python`
blocks that are no doctest (with --python, the folder of the built package). They run by bash, in their order, in a
folder of the page, beside links to `docs` and `scripts`. A command that fails, or says that an option is without
effect, is a fault. A block that cannot be run has a line before it that says why:

    <!-- not run: needs the device -->

PALPATE is found by way of a small program of the same name, which makes runs short. Of the head CT, MR and atlas of
Debian's packages it takes coarser ones, of synthetic volumes 64 samples an axis, of turntables and timed frames 3
pictures, and where no size is given 160 x 160 pixels, of windows 640 x 400. `view` opens without a display, and where
it would offer files, with a phantom. Where ffmpeg is missing, an empty program stands in for it.

Without PAGE, all pages but TRUNK, which needs the CT of --shared; where TRUNK is named and that CT is not there, it
ends with 77.
"""

import argparse
import concurrent.futures
import glob
import os
import re
import shutil
import struct
import subprocess
import sys
import time
import zlib

TRUNK = "docs/guide/segment.md"
COMMAND = re.compile(r"    (palpate|scripts/|cmake |ctest |ninja |sudo |\(cd )")
NOT_RUN = re.compile(r"<!-- not run: (\S.*?) -->$")
CT = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3"
MR = "/usr/share/mricron/templates/ch2.nii.gz"
ATLAS = "/usr/share/mricron/templates/aal.nii.gz"

WRAPPER = """#!/usr/bin/python3
import os, re, sys
words = [{small!r}.get(w, w) for w in sys.argv[1:]]
words = [re.sub(r"size=[\\d,]+", "size=64", w) if w.startswith("synthetic:") else w for w in words]
command = next((w for w in words if not w.startswith("-")), "")
if command == "view" and len([w for w in words if not w.startswith("-")]) == 1:
    words.append("synthetic:phantom?size=64")
if command == "view" and "--headless" not in words:
    words += ["--headless"] if "--latency" in words else ["--headless", "--shot", "opened.png"]
if command == "view":
    words = [w for i, w in enumerate(words) if w != "--full-screen" and words[i - 1 : i] != ["--full-screen"]]
if "--size" not in words and (command == "render" or command == "view" and "--replay" not in words):
    words += ["--size", "160,160" if command == "render" else "640,400"]
for many in ("--turntable", "--frames"):
    if many in words:
        words[words.index(many) + 1] = "3"
os.execv({palpate!r}, [{palpate!r}, *words])
"""


def blocks(text):
    """(kind, lines, why it is not run) of each block of commands."""
    found, lines, i = [], text.splitlines(), 0

    def why(at):
        while at > 0 and not lines[at - 1].strip():
            at -= 1
        match = NOT_RUN.search(lines[at - 1]) if at > 0 else None
        return match.group(1) if match else None

    while i < len(lines):
        fence = re.match(r"( *)```(\w*)", lines[i])
        begin = i
        if fence:
            i += 1
            body = []
            while not lines[i].strip().startswith("```"):
                body.append(lines[i][len(fence.group(1)) :])
                i += 1
            if fence.group(2) in ("sh", "python"):
                found.append((fence.group(2), body, why(begin)))
            elif not fence.group(2) and any(COMMAND.match("    " + line) for line in body):
                found.append(("unnamed", body, None))
        elif COMMAND.match(lines[i]) or (lines[i].startswith("     ") and COMMAND.match("    " + lines[i].strip())):
            indent = len(lines[i]) - len(lines[i].lstrip())
            body = []
            while i < len(lines) and lines[i].startswith(" " * indent):
                body.append(lines[i][indent:])
                i += 1
            found.append(("sh", body, why(begin)))
            continue
        i += 1
    return found


def write_slice(path, rows):
    """A grey PNG of 16 bits."""

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    packed = zlib.compress(b"".join(b"\0" + struct.pack(f">{len(row)}H", *row) for row in rows))
    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 16, 0, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b""))


def make_inputs(palpate, checkout, folder):
    """Files that pages take for granted, under the names they have there."""

    def run(*words):
        subprocess.run([palpate, "--quiet", *words], check=True, cwd=folder, stdout=subprocess.DEVNULL)

    run("convert", CT, "ct.pbv", "--spacing", "3")
    run("convert", MR, "mr.nii.gz", "--spacing", "2")
    run("convert", ATLAS, "atlas.nii.gz", "--labels", "--spacing", "2")
    for name in ("ct.nii.gz", "ct.nii", "head.nii", "head.nii.gz", "a.nii", "before.nrrd"):
        run("convert", "ct.pbv", name)
    run("filter", "ct.nii", "--gaussian", "3", "-o", "b.nii")
    run("filter", "mr.nii.gz", "--gaussian", "3", "-o", "pet.nii")
    run("filter", "ct.nii", "--threshold", "300", "-o", "labels.nii")
    for name in ("seeds.nii", "organs.nii", "truth.nii.gz", "liver.nii.gz"):
        run("convert", "labels.nii", name, "--labels")
    run("convert", "atlas.nii.gz", "atlas.nii", "--labels")
    run("project", "work.palpate", "--new", "ct.pbv", "--labels", "labels.nii")
    run("render", "ct.pbv", "--iso", "300", "--write-scene", "scene.json", "-o", "scene.png")
    phantom = "synthetic:phantom?size=64"
    run("surface", phantom, "--iso", "300", "-o", "whole.ply")
    run("surface", phantom, "--iso", "300", "--decimate", "0.5", "-o", "light.ply")
    run("touch", phantom, "--trajectory", "press", "--record", "hand.log")
    shutil.copy(os.path.join(checkout, "scripts/demo-hand.csv"), os.path.join(folder, "hand.csv"))
    shutil.copy(os.path.join(checkout, "docs/guide/liver_window.jsonl"), os.path.join(folder, "session.jsonl"))
    for name in ("strokes.jsonl", "drill.jsonl"):
        shutil.copy(os.path.join(checkout, "docs/guide/window.jsonl"), os.path.join(folder, name))
    text = open(os.path.join(checkout, "docs/reference/display-profile.md"), encoding="utf-8").read()
    with open(os.path.join(folder, "workbench.json"), "w", encoding="utf-8") as file:
        file.write(text.split("```json\n")[1].split("```")[0])
    for name in ("folder", "dicom_folder"):
        os.makedirs(os.path.join(folder, name))
        for z in range(4):
            rows = [[1000 + 10 * x + y + z for x in range(16)] for y in range(12)]
            write_slice(os.path.join(folder, name, f"ct_{z:03d}.png"), rows)


def run_page(page, options, inputs, environment):
    """What is wrong with the commands of a page, and how many blocks were run."""
    found = blocks(open(os.path.join(options.checkout, page), encoding="utf-8").read())
    faults, script, python, count = [], [], [], 0
    for kind, lines, why in found:
        if kind == "unnamed":
            faults.append(f"{page}: a block of commands without a language: {lines[0]}")
        elif kind == "python" and (any(line.startswith(">>>") for line in lines) or not options.python):
            continue
        elif why is None:
            count += 1
            if kind == "python":
                name = f"block{count}.py"
                python.append((name, lines))
                lines = [f"/usr/bin/python3 {name}"]
            script += lines
    if not script:
        return faults, 0
    folder = os.path.join(options.work, re.sub(r"\W", "_", page))
    shutil.copytree(inputs, folder, symlinks=True)
    for name in ("docs", "scripts"):
        os.symlink(os.path.join(options.checkout, name), os.path.join(folder, name))
    for name, lines in python:
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write("\n".join(lines))
    trap = "trap 'echo \"page: failed: $BASH_COMMAND\" >&2' ERR\n"
    run = subprocess.run(["bash", "-euc", trap + "\n".join(script)], cwd=folder, env=environment,
                         stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                         errors="replace")  # fmt: skip
    if run.returncode != 0:
        faults.append(f"{page}: its commands ended with {run.returncode}:\n{run.stdout[-2000:]}")
    faults += [f"{page}: {line}" for line in run.stdout.splitlines() if "without effect" in line]
    if not faults:
        shutil.rmtree(folder)
    return faults, count


def main():
    parser = argparse.ArgumentParser()
    for name in ("palpate", "checkout", "work"):
        parser.add_argument(name, type=os.path.abspath)
    parser.add_argument("--python", type=os.path.abspath)
    parser.add_argument("--shared", type=os.path.abspath, default="/nowhere")
    parser.add_argument("pages", nargs="*")
    options = parser.parse_intermixed_args()
    trunk = os.path.join(options.shared, "ct_trunk_labels/ct.nii.gz")
    if TRUNK in options.pages and not os.path.exists(trunk):
        print(f"{trunk} is not there")
        sys.exit(77)
    pages = options.pages or ["README.md", "CONTRIBUTING.md"] + sorted(
        glob.glob("docs/**/*.md", root_dir=options.checkout, recursive=True)
    )
    pages = [page for page in pages if page != TRUNK or TRUNK in options.pages]
    shutil.rmtree(options.work, ignore_errors=True)
    inputs, programs = (os.path.join(options.work, name) for name in ("inputs", "bin"))
    os.makedirs(inputs)
    os.makedirs(programs)
    make_inputs(options.palpate, options.checkout, inputs)
    if TRUNK in pages:
        shutil.copy(trunk, inputs)
        organs = os.path.join(options.shared, "ct_trunk_labels/labels_totalseg_v2.nii.gz")
        shutil.copy(organs, os.path.join(inputs, "truth.nii.gz"))
    small = {CT: os.path.join(inputs, "ct.pbv"), MR: os.path.join(inputs, "mr.nii.gz"),
             ATLAS: os.path.join(inputs, "atlas.nii.gz")}  # fmt: skip
    wrapper = os.path.join(programs, "palpate")
    with open(wrapper, "w", encoding="utf-8") as file:
        file.write(WRAPPER.format(small=small, palpate=options.palpate))
    os.chmod(wrapper, 0o755)
    if not shutil.which("ffmpeg"):
        with open(os.path.join(programs, "ffmpeg"), "w", encoding="utf-8") as file:
            file.write('#!/bin/sh\nfor last; do :; done\n: > "$last"\n')
        os.chmod(file.name, 0o755)
    environment = {**os.environ, "ct": CT, "mr": MR, "atlas": ATLAS, "PATH": programs + ":" + os.environ["PATH"],
                   "guide": os.path.join(options.checkout, "docs/guide")}  # fmt: skip
    if options.python:
        environment["PYTHONPATH"] = options.python
    faults, total = [], 0

    def timed(page):
        began = time.monotonic()
        return page, *run_page(page, options, inputs, environment), time.monotonic() - began

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for page, wrong, count, seconds in pool.map(timed, pages):
            faults += wrong
            total += count
            if count:
                print(f"{page}: {count} blocks, {seconds:.0f} s")
    print("\n".join(faults) or f"{total} blocks of commands ran")
    sys.exit(1 if faults or total == 0 else 0)


if __name__ == "__main__":
    main()
