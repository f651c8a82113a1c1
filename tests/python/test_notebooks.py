"""The notebooks run from top to bottom as they are in the repository, and show pictures."""

import json
import os
import subprocess
import sys

import pytest

FOLDER = os.path.join(os.path.dirname(__file__), "..", "..", "docs", "notebooks")
NAMES = sorted(name for name in os.listdir(FOLDER) if name.endswith(".ipynb"))


def test_there_are_three():
    assert NAMES == ["first_picture.ipynb", "segment_and_measure.ipynb", "touch.ipynb"]


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_runs(name, tmp_path):
    path = os.path.abspath(os.path.join(FOLDER, name))
    cells = json.load(open(path))["cells"]
    assert not any(cell.get("outputs") for cell in cells), "outputs are not committed"
    env = {**os.environ, "MPLBACKEND": "module://matplotlib_inline.backend_inline", "IPYTHONDIR": str(tmp_path),
           "JUPYTER_RUNTIME_DIR": str(tmp_path), "JUPYTER_CONFIG_DIR": str(tmp_path), "HOME": str(tmp_path)}  # fmt: skip
    words = ["-m", "nbconvert", "--to", "notebook", "--execute", "--output-dir", str(tmp_path), "--output", "done.ipynb"]
    os.symlink(path, tmp_path / name)  # it runs in this folder, and what it writes stays there
    ran = subprocess.run([sys.executable, *words, str(tmp_path / name)], capture_output=True, text=True, env=env, cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr[-2000:]
    done = json.load(open(tmp_path / "done.ipynb"))["cells"]
    outputs = [out for cell in done for out in cell.get("outputs", [])]
    assert not [out for out in outputs if out["output_type"] == "error"]
    pictures = [out for out in outputs if "image/png" in out.get("data", {})]
    assert len(pictures) >= 2
