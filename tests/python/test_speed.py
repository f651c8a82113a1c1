"""What a call from Python costs beside the same frame in C++."""

import statistics
import time

import palpate


def test_a_frame_costs_the_calling_thread_at_most_2_ms_of_a_processor():
    """Median over frames of 256 x 256. Another thread draws: the caller's pays for looking at Ctrl-C, for the options and
    for the call, whatever else the machine does. A frame itself takes several times as long."""
    renderer = palpate.Renderer()
    scene = palpate.Scene("synthetic:ball?size=64", mode="iso", iso=0.5, size=(256, 256))
    callers, whole = [], []
    for _ in range(40):
        scene.orbit(3)
        began, all_began = time.thread_time(), time.process_time()
        renderer.render(scene)
        callers.append(1e3 * (time.thread_time() - began))
        whole.append(1e3 * (time.process_time() - all_began))
    renderer.close()
    print(f"{statistics.median(callers):.3f} ms of a processor a frame, of {statistics.median(whole):.1f} ms")
    assert statistics.median(callers) < 2.0
    assert statistics.median(whole) > 4.0  # so that a caller that draws would be seen
