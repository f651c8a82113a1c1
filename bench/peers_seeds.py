#!/usr/bin/python3
"""What scikit-image's random walker makes of the seeds of a study.

usage: peers_seeds.py FOLDER RESULT.json

FOLDER holds NAME.json (case, size, spacing_mm, outside) and NAME.volume, .truth and .seeds (floats, x
fastest). For each case the walker runs with conjugate gradients (cg_j) and its own defaults; the result
is Dice (mean and worst label), wall clock and processor time in seconds. A run that has used 60 s of a
processor is given up."""
import glob
import json
import os
import signal
import sys
import time

import numpy as np
import skimage
from skimage.segmentation import random_walker


LONGEST_S = 60


class TooLong(Exception):
    pass


def give_up(*_):
    raise TooLong


def run(path):
    with open(path) as file:
        about = json.load(file)
    shape = about["size"][::-1]
    volume, truth, seeds = (np.fromfile(path[:-5] + ending, dtype="<f4").reshape(shape)
                            for ending in (".volume", ".truth", ".seeds"))
    numbers = [n for n in np.unique(seeds) if n != 0]
    markers = np.zeros(shape, np.int32)
    for rank, number in enumerate(numbers):
        markers[seeds == number] = rank + 1
    row = {"case": about["case"], "skimage": skimage.__version__}
    start = time.perf_counter()
    used = time.process_time()
    signal.signal(signal.SIGPROF, give_up)
    signal.setitimer(signal.ITIMER_PROF, LONGEST_S)
    try:
        found = random_walker(volume.astype(np.float64), markers, mode="cg_j",
                              spacing=about["spacing_mm"][::-1])
    except TooLong:
        return dict(row, stopped_s=LONGEST_S)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    row["wall_s"] = time.perf_counter() - start
    row["cpu_s"] = time.process_time() - used
    dice = []
    for rank, number in enumerate(numbers):
        if number == about["outside"]:
            continue
        a, b = found == rank + 1, truth == number
        dice.append(2.0 * float((a & b).sum()) / max(1, int(a.sum() + b.sum())))
    row["dice"] = {"mean": float(np.mean(dice)), "worst": float(np.min(dice))}
    return row


def main():
    folder, out = sys.argv[1:]
    rows = []
    for path in sorted(glob.glob(os.path.join(glob.escape(folder), "*.json"))):
        if os.path.abspath(path) != os.path.abspath(out):
            rows.append(run(path))
            print(rows[-1], flush=True)
    with open(out, "w") as file:
        json.dump(rows, file)


main()
