"""Memory of a process that draws, loads and edits again and again.

PALPATE_ROUNDS: how often (default 40; the long test takes 1000).
"""

import ctypes
import gc
import os

import numpy as np

import palpate

ROUNDS = int(os.environ.get("PALPATE_ROUNDS", "40"))


class MallocInfo(ctypes.Structure):
    """struct mallinfo2 of glibc."""

    _fields_ = [(name, ctypes.c_size_t) for name in
                ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")]  # fmt: skip


def heap_kib():
    """What is allocated and not freed, exact to the byte, whatever the allocator keeps of freed memory."""
    libc = ctypes.CDLL(None)
    libc.mallinfo2.restype = MallocInfo
    info = libc.mallinfo2()
    return (info.uordblks + info.hblkhd) / 1024


def resident_mib():
    """With memory that is mapped and not allocated, as that of the device."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def grown(round_):
    """KiB of the heap and MiB resident that ROUNDS rounds leave behind, after 40 that warm up."""
    found = []
    for count in (40, ROUNDS):
        for _ in range(count):
            round_()
        gc.collect()
        found.append((heap_kib(), resident_mib()))
    (heap_before, resident_before), (heap, resident) = found
    print(f"{ROUNDS} rounds: heap {heap_before:.0f} to {heap:.0f} KiB, resident {resident_before:.1f} to {resident:.1f} MiB")
    return heap - heap_before, resident - resident_before


def assert_flat(round_, scratch_kib=0):
    """scratch_kib: what threads may keep for their next work."""
    heap_kib_grown, resident_mib_grown = grown(round_)
    # 64 bytes a round are the least that a shared object takes. 64 KiB: each thread keeps freed pieces of at most 1 KiB
    # for itself, up to 7 of each of 64 sizes, which count as allocated. Resident are freed pages, too: 4 MiB.
    assert heap_kib_grown < 64 + scratch_kib + ROUNDS * 64 / 1024
    assert resident_mib_grown < 4


def test_renders(ball):
    """A scene drawn by a kept renderer, and volumes drawn by the function, whose scene is new each time."""
    scene = palpate.Scene(ball, iso=100, size=(64, 48))
    with palpate.Renderer() as renderer:

        def round_():
            renderer.render(scene).to_numpy()
            palpate.render(ball, slice="axial", annotate=["letters"], size=(64, 48))._repr_png_()

        assert_flat(round_)


def test_loads(ball, tmp_path):
    """Of files, each decoded in a process of its own; of a brick file; of arrays; and of one that is refused."""
    palpate.save(tmp_path / "v.nii.gz", ball)
    palpate.save(tmp_path / "v.pbv", ball)
    (tmp_path / "bad.nrrd").write_bytes(b"NRRD0004\n")
    array = ball.to_numpy()

    def round_():
        palpate.load(tmp_path / "v.nii.gz").to_numpy()
        palpate.load(tmp_path / "v.pbv").to_numpy()
        palpate.Volume.from_numpy(array, ball.affine)
        try:
            palpate.load(tmp_path / "bad.nrrd")
        except palpate.Error:
            pass

    assert_flat(round_, scratch_kib=8 * 128)  # a thread keeps a few bricks of 128 KiB


def test_edits(ball, tmp_path):
    """Documents with a stroke, its undo and a journal."""

    def round_():
        journal = tmp_path / "edit.journal"
        document = palpate.Document(ball, journal=journal)
        document.stroke({"kind": "ball", "radius_mm": 3}, {"kind": "cut"}, [(0, 0, 0), (5, 0, 0)])
        document.undo()
        document.stroke({"kind": "ball", "radius_mm": 2}, {"kind": "cut"}, [(0, 0, 0)])
        document.volume.to_numpy()
        del document
        journal.unlink()

    assert_flat(round_)


def test_work_on_many_threads(ball):
    """A filter, labels, a mesh and measures."""

    def round_():
        smooth = palpate.filter(ball, "gaussian", 1.0)
        found = palpate.segment(smooth, "threshold", low=100)
        palpate.surface(smooth, 100)
        assert palpate.measure(smooth, labels=found.labels)["labels"]

    assert_flat(round_, scratch_kib=16 * 128)  # a thread keeps a few bricks of 128 KiB


def test_what_leaks_is_found():
    """The check itself: 4 KiB a round are seen."""
    kept = []
    heap, _ = grown(lambda: kept.append(np.zeros(512)))
    assert heap >= ROUNDS * 4 > 64 + ROUNDS * 64 / 1024
