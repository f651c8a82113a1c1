#!/usr/bin/python3
"""Runs the commands of docs/guide/segment.md, from seeds to a mesh, and holds what the page says of them.

    guide_segment.py PALPATE CHECKOUT TRUNK_FOLDER WORK_FOLDER

Of the page the fenced `sh` blocks between "The liver of a CT" and the next heading are run by bash, as a
reader would, with the CT as ct.nii.gz. Without TRUNK_FOLDER it says so and ends with 77.
"""

import json
import os
import re
import shutil
import subprocess
import sys


def main():
    palpate, root, data, work = sys.argv[1:5]
    ct, organs = (os.path.join(data, n) for n in ("ct.nii.gz", "labels_totalseg_v2.nii.gz"))
    if not os.path.exists(ct):
        print(f"{ct} is not there")
        sys.exit(77)
    shutil.rmtree(work, ignore_errors=True)
    os.makedirs(work)
    os.symlink(os.path.abspath(ct), os.path.join(work, "ct.nii.gz"))
    page = open(os.path.join(root, "docs/guide/segment.md"), encoding="utf-8").read()
    part = page.split("## The liver of a CT", 1)[1].split("\n## ", 1)[0]
    blocks = re.findall(r"```sh\n(.*?)```", part, flags=re.S)
    assert len(blocks) >= 3, blocks
    environment = dict(os.environ, guide=os.path.abspath(os.path.join(root, "docs/guide")),
                       PATH=os.path.dirname(os.path.abspath(palpate)) + ":" + os.environ["PATH"])
    output = ""
    for block in blocks:
        run = subprocess.run(["bash", "-euc", block], cwd=work, env=environment, capture_output=True, text=True)
        if run.returncode != 0:
            sys.exit(f"{block}\nended with {run.returncode}: {run.stderr}")
        output += run.stdout

    def dice(name):
        paths = [os.path.join(work, name), os.path.join(work, "truth.nii.gz")]
        if not os.path.exists(paths[1]):
            subprocess.run([palpate, "filter", organs, "--labels", "--expression", "a == 5", "-o", paths[1]], check=True)
        run = subprocess.run([palpate, "compare", *paths, "--labels", "--dice", "0"], capture_output=True, text=True)
        return json.loads(run.stdout)["overall"]["dice"]

    said = [float(n) for n in re.findall(r"Dice is ([\d.]+) for the first result and ([\d.]+) for the last", part)[0]]
    found = [dice("first.nii.gz"), dice("liver.nii.gz")]
    said_ml = float(re.search(r"It has (\d+) ml", part).group(1))
    found_ml = float(re.search(r"label 1\s+([\d.]+) ml", output).group(1))
    print(f"Dice {found}, the page says {said}; {found_ml} ml, the page says {said_ml}")
    if any(abs(a - b) > 0.005 for a, b in zip(said, found)) or abs(said_ml - found_ml) > 5:
        sys.exit("the page says otherwise")
    window = json.load(open(os.path.join(work, "window.json"), encoding="utf-8"))
    window_ml = window["label_counts"]["1"] * 0.027  # samples of 3 mm
    said_ml = float(re.search(r"the liver has (\d+) ml then", part).group(1))
    print(f"in the window {window_ml} ml, the page says {said_ml}")
    if abs(window_ml - said_ml) > 5 or window["undo_steps"] != 4:
        sys.exit("the page says otherwise of the window")
    for mesh in ("liver.ply", "mesh.ply"):
        if os.path.getsize(os.path.join(work, mesh)) < 10000:
            sys.exit(f"{mesh}: expected a mesh")


if __name__ == "__main__":
    main()
