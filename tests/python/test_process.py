"""The process: threads, Ctrl-C, memory, damaged files, and what importing costs."""

import os
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import palpate


def in_child(code, **options):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, **options)


def test_importing_loads_no_other_package():
    loaded = in_child("import sys, palpate; print(' '.join(sorted({n.split('.')[0] for n in sys.modules})))").stdout.split()
    assert "palpate" in loaded
    for name in ("nibabel", "SimpleITK", "itk", "xarray", "trimesh", "meshio", "pyvista", "tqdm", "matplotlib"):
        assert name not in loaded


def test_progress_rises_to_one():
    shares = []
    palpate.filter(np.random.default_rng(1).normal(size=(80, 80, 80)).astype(np.float32), "median", 2.0, progress=shares.append)
    assert shares[-1] == 1.0 and shares == sorted(shares) and all(0 <= s <= 1 for s in shares)


def test_what_progress_raises_stops_the_work():
    class Enough(Exception):
        pass

    def stop(share):
        raise Enough(share)

    def cost(size, **more):
        """Seconds of a processor."""
        volume = palpate.Volume.from_numpy(np.random.default_rng(1).normal(size=(size, size, size)).astype(np.float32))
        began = time.process_time()
        try:
            palpate.filter(volume, "bilateral", 4.0, range=1.0, **more)
        finally:
            costs.append(time.process_time() - began)

    costs = []
    cost(40)
    with pytest.raises(Enough):
        cost(200, progress=stop)
    assert costs[1] < 0.25 * costs[0] * (200 / 40) ** 3  # whole, it takes all of that, and minutes


INTERRUPTED = """
import os, signal, threading, time
import numpy as np, palpate
volume = palpate.Volume.from_numpy(np.random.default_rng(1).normal(size=(200, 200, 200)).astype(np.float32))
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    palpate.filter(volume, "bilateral", 4.0, range=1.0)
    print("done")
except KeyboardInterrupt:
    print("interrupted")
print(palpate.filter(volume.box((0, 0, 0), (8, 8, 8)), "gaussian", 1.0).shape)
"""


def test_ctrl_c_stops_long_work_and_python_goes_on():
    run = in_child(INTERRUPTED)
    assert run.stdout.split("\n")[:2] == ["interrupted", "(8, 8, 8)"], run.stderr


def test_ctrl_c_stops_a_picture(tmp_path):
    run = in_child(
        """
import os, signal, threading, palpate
volume = palpate.load("synthetic:ball?size=256")
threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    scene = palpate.Scene(volume, mode="alpha", integrator="exact", sub_steps=64, size=(4096, 4096))
    palpate.render(scene)
    print("done")
except KeyboardInterrupt:
    print("interrupted")
print(palpate.render(volume, size=(16, 16)).to_numpy().shape)
"""
    )
    assert run.stdout.split("\n")[:2] == ["interrupted", "(16, 16, 3)"], run.stderr


def test_threads_share_everything(ball):
    """One renderer, one scene, one document and one volume, from eight threads at once."""
    scene = palpate.Scene(ball, iso=100, size=(48, 48))
    renderer = palpate.Renderer()
    expected = renderer.render(scene).to_numpy()
    document = palpate.Document(ball)
    faults = []

    def work(number):
        try:
            for i in range(5):
                assert np.array_equal(renderer.render(scene).to_numpy(), expected)
                document.stroke({"kind": "ball", "radius_mm": 1.5}, {"kind": "cut"}, [(number - 4, i - 2, 0)])
                assert palpate.surface(document.volume, 100).vertices.size
                assert palpate.render(ball, size=(16, 16)).to_numpy().size
        except BaseException as fault:  # noqa: B902
            faults.append(fault)

    threads = [threading.Thread(target=work, args=(n,)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not faults
    assert document.undo_steps == 40
    renderer.close()


def test_other_threads_run_while_work_goes_on():
    """Python gives no thread its turn here but one that is asked to wait: another runs where work lets go of the lock."""
    volume = palpate.Volume.from_numpy(np.random.default_rng(1).normal(size=(40, 40, 40)).astype(np.float32))
    begun, ran = threading.Event(), []

    def run():
        begun.wait()
        ran.append(True)

    thread = threading.Thread(target=run)
    thread.start()
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    try:
        begun.set()
        works = 0
        while not ran and works < 200:  # of some ms: the thread waits for a processor, too
            palpate.filter(volume, "median", 2.0)
            works += 1
        has_run = bool(ran)
    finally:
        sys.setswitchinterval(interval)
    thread.join()
    assert has_run


def test_damaged_files_are_errors_and_leave_the_process(tmp_path, ball):
    palpate.save(tmp_path / "v.nii.gz", ball)
    whole = (tmp_path / "v.nii.gz").read_bytes()
    rng = np.random.default_rng(3)
    for i in range(12):
        data = bytearray(whole[: rng.integers(0, len(whole))])
        for at in rng.integers(0, max(1, len(data)), size=8):
            if data:
                data[at] ^= int(rng.integers(1, 256))
        (tmp_path / "damaged.nii.gz").write_bytes(data)
        try:
            palpate.load(tmp_path / "damaged.nii.gz")
        except palpate.Error as error:
            assert "damaged.nii.gz" in str(error)


def test_objects_in_any_order_at_the_end():
    run = in_child(
        """
import palpate, sys
v = palpate.load("synthetic:ball?size=32")
r = palpate.Renderer(); s = palpate.Scene(v, size=(32, 32)); p = r.render(s)
palpate.render(s)
d = palpate.Document(v)
del r, v
p.to_numpy()
keep = sys.modules; keep["x"] = (s, p, d)
"""
    )
    assert run.returncode == 0, run.stderr


def test_every_public_name_says_what_it_is():
    import inspect

    missing = []
    for name in palpate.__all__:
        thing = getattr(palpate, name)
        if not inspect.getdoc(thing):
            missing.append(name)
        if inspect.isclass(thing) and not issubclass(thing, (tuple, Exception)):
            for member, value in vars(thing).items():
                if not member.startswith("_") and not inspect.getdoc(value):
                    missing.append(f"{name}.{member}")
    assert not missing


def test_stubs_and_module_have_the_same_names():
    import ast

    from palpate import _core

    path = os.path.join(os.path.dirname(palpate.__file__), "_core.pyi")
    tree = ast.parse(open(path).read())

    def names_of(body):
        for node in body:
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                yield node.name
            elif isinstance(node, ast.AnnAssign):
                yield node.target.id

    public = {n for n in vars(_core) if not n.startswith("_")}
    assert set(n for n in names_of(tree.body) if not n.startswith("_")) == public
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and node.name != "Error":
            real = {n for n in vars(getattr(_core, node.name)) if not n.startswith("_")}
            assert {n for n in names_of(node.body) if not n.startswith("_")} == real, node.name
    assert os.path.exists(os.path.join(os.path.dirname(palpate.__file__), "py.typed"))


def test_keywords_are_all_those_of_the_command_line(ball, command):
    """Every option of `palpate render` that decides a picture is read by the same table."""
    help_ = command("render", "--help").stdout
    flags = set(re.findall(r"(?<![\w-])--([a-z][a-z-]+)", help_))
    files_and_runs = {"help", "output", "frames", "orbit-deg", "stats", "write-scene", "preview", "profile", "quiet", "verbose"}
    turntable = {"turntable", "camera-path", "fps"}
    for flag in flags - files_and_runs - turntable:
        try:
            palpate.render(ball, **{flag.replace("-", "_"): "~"})
        except palpate.Error as error:
            assert "not expected" not in str(error), flag
