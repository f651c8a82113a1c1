"""What a call from Python costs beside the same frame in C++."""

import statistics
import time

import palpate


def test_a_frame_costs_at_most_2_ms_more_than_in_cpp():
    """Median over frames of 512 x 512. Picture.ms is the same frame's time in C++, pixels read back; beside it
    Python pays for a thread that watches for Ctrl-C, for the options, and for the call."""
    renderer = palpate.Renderer()
    scene = palpate.Scene("synthetic:ball?size=64", mode="iso", iso=0.5, size=(512, 512))
    rounds = []  # the least of their medians counts: other work on the machine only adds
    for _ in range(3):
        more = []
        for _ in range(40):
            scene.orbit(3)
            began = time.perf_counter()
            picture = renderer.render(scene)
            more.append(1e3 * (time.perf_counter() - began) - picture.ms)
        rounds.append(statistics.median(more))
    renderer.close()
    print(f"{min(rounds):.3f} ms more a frame than in C++, of {picture.ms:.1f} ms")
    assert min(rounds) < 2.0
