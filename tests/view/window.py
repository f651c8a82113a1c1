"""palpate view in a window, used as a person would: Xvfb, openbox and xdotool.

    window.py PALPATE
"""
import json
import os
import subprocess
import sys
import tempfile
import time

program = sys.argv[1]
folder = tempfile.mkdtemp(prefix="palpate.window.")


def start(words, **more):
    return subprocess.Popen(words, **more)


def until(what, seconds, found):
    """The first result of found() that is true."""
    end = time.time() + seconds
    while time.time() < end:
        result = found()
        if result:
            return result
        time.sleep(0.1)
    raise SystemExit(f"window.py: waited {seconds} s for {what}")


read, write = os.pipe()
server = start(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24", "-nolisten", "tcp"],
               pass_fds=[write], stderr=subprocess.DEVNULL)
os.close(write)
display = os.fdopen(read).readline().strip()
environment = dict(os.environ, DISPLAY=":" + display, HOME=folder)
environment.pop("WAYLAND_DISPLAY", None)


def xdo(*words):
    return subprocess.run(["xdotool", *map(str, words)], env=environment, capture_output=True,
                          text=True).stdout


manager = start(["openbox"], env=environment, stderr=subprocess.DEVNULL)
try:
    time.sleep(1.0)
    state_file, record = os.path.join(folder, "state.json"), os.path.join(folder, "record.jsonl")
    volume = "synthetic:phantom?size=48"

    def open_window(*words):
        process = start([program, "view", *words, "--size", "800,600", "--validate"], env=environment,
                        cwd=folder)
        found = until("a window", 60, lambda: process.poll() is not None or
                      xdo("search", "--name", "palpate").split())
        if process.poll() is not None:
            raise SystemExit(f"window.py: the program ended with {process.returncode}")
        time.sleep(2.0)
        return process, found[-1]

    def at(x, y):
        xdo("mousemove", "--window", window, x, y)
        time.sleep(0.3)

    def pause():
        time.sleep(0.5)

    def draw(x, y):
        at(x, y)
        xdo("mousedown", 1)
        for _ in range(12):
            xdo("mousemove_relative", "--", 4, 1)
        xdo("mouseup", 1)
        pause()

    viewer, window = open_window(volume, "--state", state_file, "--record", record)
    at(150, 150)
    xdo("click", 1)  # the crosshair, in the axial view
    pause()
    xdo("click", 4)  # the next slice
    pause()
    xdo("key", "b")  # the brush
    pause()
    draw(120, 420)
    xdo("key", "x")
    pause()
    at(200, 200)
    xdo("click", 1)
    pause()
    xdo("key", "ctrl+z")
    pause()
    xdo("windowsize", "--sync", window, 900, 650)
    time.sleep(1.0)
    xdo("windowminimize", "--sync", window)
    time.sleep(0.5)
    xdo("windowactivate", "--sync", window)
    time.sleep(1.0)
    xdo("key", "question")
    time.sleep(1.0)
    picture = os.environ.get("PALPATE_WINDOW_SHOT")
    if picture:
        subprocess.run(["import", "-window", "root", picture], env=environment, check=False)
    xdo("key", "alt+F4")  # there are edits: the program asks, and a second time means it
    time.sleep(1.0)
    assert viewer.poll() is None, "the program lost edits without a question"
    xdo("key", "alt+F4")
    code = viewer.wait(timeout=60)
    assert code == 0, f"the program ended with {code}"
    with open(state_file) as file:
        state = json.load(file)
    assert state["size"] == [900, 650], state["size"]
    assert state["undo_steps"] == 1, state["undo_steps"]  # the stroke of the brush
    assert state["redo_steps"] == 1, state["redo_steps"]  # the cut
    assert state["tool"]["hand"] == "cut"
    assert state["help_open"]
    assert state["refusal"] == ""

    # What was recorded gives the same document and views without the window.
    again = subprocess.run([program, "view", volume, "--headless", "--replay", record,
                            "--state", "-"], capture_output=True, text=True, check=True)
    replayed = json.loads(again.stdout)
    for key in state:
        assert replayed[key] == state[key], f"{key}: {replayed[key]} beside {state[key]}"

    # Saved, changed, killed: the project has every step that had ended.
    viewer, window = open_window(volume)
    xdo("key", "b")
    draw(120, 420)
    xdo("key", "ctrl+s")
    time.sleep(1.0)
    xdo("key", "Return")  # the folder that is offered
    project = os.path.join(folder, "work.palpate")
    until("the project", 30, lambda: os.path.exists(os.path.join(project, "project.json")))
    time.sleep(1.0)

    def look():
        shown = subprocess.run([program, "--quiet", "view", project, "--headless", "--state", "-"],
                               capture_output=True, text=True, check=True)
        return json.loads(shown.stdout)["document"]

    saved = look()
    draw(120, 380)
    time.sleep(1.0)
    viewer.kill()
    viewer.wait()
    kept = look()
    assert kept["labels"] != saved["labels"], "the stroke after the save is lost"
    assert kept["volume"] == saved["volume"]
    viewer, window = open_window(project, "--state", state_file)
    xdo("key", "ctrl+z")
    pause()
    xdo("key", "alt+F4")
    assert viewer.wait(timeout=60) == 0
    with open(state_file) as file:
        undone = json.load(file)
    assert undone["document"] == saved, "undo of the stroke that was recovered"
    assert undone["redo_steps"] == 1
    print("window.py: done")
finally:
    for process in (viewer if "viewer" in dir() else None, manager, server):
        if process is not None and process.poll() is None:
            process.terminate()
