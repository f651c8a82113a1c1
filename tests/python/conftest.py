"""What the tests of the Python package share."""

import os
import subprocess

import numpy as np
import pytest

import palpate

PROGRAM = os.environ["PALPATE_PROGRAM"]


@pytest.fixture
def command():
    """Runs the program palpate; fails where it fails."""

    def run(*words):
        return subprocess.run([PROGRAM, "--quiet", *map(str, words)], check=True, capture_output=True, text=True)

    return run


@pytest.fixture
def ball():
    """A ball of radius 10 mm at the origin: value 100 inside falling linearly by 10 a mm, uneven spacing."""
    spacing = np.array([1.0, 0.8, 2.0])
    shape = (40, 50, 20)
    axes = [(np.arange(n) - (n - 1) / 2) * mm for n, mm in zip(shape, spacing)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    values = (200.0 - 10.0 * np.sqrt(x * x + y * y + z * z)).astype(np.float32)  # 100 at 10 mm
    affine = np.diag([*spacing, 1.0])
    affine[:3, 3] = [a[0] for a in axes]
    return palpate.Volume.from_numpy(values, affine)
