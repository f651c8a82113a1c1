"""A net on a server, by a fake one (tests/unit/net/fake_server.py) whose net is a ball of radius 3 samples."""

import os
import subprocess
import sys

import numpy as np
import pytest

import palpate

SERVER = os.path.join(os.path.dirname(__file__), "..", "unit", "net", "fake_server.py")


@pytest.fixture
def server(tmp_path):
    """Starts a server: server("monai", "503=/claim") gives its name and the requests that came so far."""
    started = []

    def start(protocol, *faults):
        folder = tmp_path / protocol
        folder.mkdir()
        child = subprocess.Popen(
            [sys.executable, SERVER, str(folder), *faults], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        started.append(child)
        port = int(child.stdout.readline())

        def requests():
            log = folder / "requests"
            return log.read_text() if log.exists() else ""

        return f"127.0.0.1:{port}", requests

    yield start
    for child in started:
        child.kill()
        child.communicate()


@pytest.fixture
def steps():
    """100 where x is above 12, else 0, in uneven samples."""
    values = np.zeros((20, 16, 12), np.int16)
    values[13:] = 100
    return palpate.Volume.from_numpy(values, np.diag([1.0, 1.0, 2.0, 1.0]))


def test_points_and_drawn_seeds_find_objects(server, steps):
    name, requests = server("interactive")
    place = steps.affine @ [5, 6, 4, 1]
    seeds = [(4, place[:3]), (2, (steps.affine @ [15, 6, 4, 1])[:3])]
    found = palpate.segment_by_net(steps, name, seeds, background=2, key="k1", consent=True)
    x, y, z = np.ogrid[:20, :16, :12]
    assert np.array_equal(found.labels.to_numpy() == 4, (x - 5) ** 2 + (y - 6) ** 2 + (z - 4) ** 2 <= 9)
    assert found.labels.to_numpy().max() == 4
    assert "CC BY-NC-SA 4.0" in found.notes[0]
    assert requests().endswith("POST /release 0 Bearer k1\n")
    drawn = np.zeros((20, 16, 12), np.uint8)
    drawn[3:6, 7, 2:9] = 7
    again = palpate.segment_by_net(steps, name, palpate.Volume.from_numpy(drawn, steps.affine), consent=True)
    assert np.array_equal(again.labels.to_numpy(), drawn)


def test_a_model_of_monai_label(server, steps):
    name, _ = server("monai")
    found = palpate.segment_by_net(steps, name, model="spleen", consent=True)
    assert np.array_equal(found.labels.to_numpy(), 3 * (steps.to_numpy() > 50))
    with pytest.raises(palpate.Error, match="expected one of the models spleen, edit 3d"):
        palpate.segment_by_net(steps, name, consent=True)


def test_nothing_is_sent_without_consent(server, steps):
    name, requests = server("interactive")
    with pytest.raises(palpate.Error, match="all 20 x 16 x 12 samples.*consent=True"):
        palpate.segment_by_net(steps, name, [(1, (5, 6, 8))])
    assert requests() == ""


def test_failures_are_errors(server, steps):
    name, _ = server("interactive", "503=/claim")
    with pytest.raises(palpate.Error, match="the server is full"):
        palpate.segment_by_net(steps, name, [(1, (5, 6, 8))], consent=True)
    for wrong in [dict(send_to="ftp://x"), dict(key="a b"), dict(timeout_s=0)]:
        with pytest.raises(palpate.Error, match="expected"):
            palpate.segment_by_net(steps, **{"send_to": name, "consent": True, **wrong})
