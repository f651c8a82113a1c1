"""Sessions of a person at the window, each another way to work. Views of a window of 800 x 600 without bars: axial
0..266 x 0..287, 3D 269..535 x 0..287, coronal below axial, sagittal below 3D; tools at the right."""
import json
import os
import struct
import subprocess
import tempfile
import time

from person import Person, VOLUME, until

AXIAL, VOLUME_VIEW, CORONAL, SAGITTAL = (133, 144), (402, 144), (133, 434), (402, 434)


def near(a, b, most=1e-6):
    return abs(a - b) <= most


def saved_project(p):
    """The folder of a project that the window writes and goes on with."""
    p.key("ctrl+s")
    p.key("Return")
    until("the project's title", lambda: p.title().startswith("work.palpate"))
    return os.path.join(p.folder, "work.palpate")


def size_of(folder):
    return sum(os.path.getsize(os.path.join(where, name)) for where, _, names in os.walk(folder) for name in names)


def browser_opens_a_typed_file(start):
    p = start()
    p.key("ctrl+o")
    left, top, width, height = p.boxes()["browser/path"]
    p.click(left + width - 20, top + height // 2)
    p.key("ctrl+a")
    p.type("synthetic:ball?size=20")
    p.key("Return")
    until("the title of the file", lambda: p.title().startswith("synthetic:ball"))
    p.looks_right()
    state = p.close()
    assert state["crosshair_sample"] == [10, 10, 10], state["crosshair_sample"]
    assert not state["browser_open"]


def plays_a_script_and_hands_over(start):
    with tempfile.NamedTemporaryFile("w", suffix=".jsonl") as script:
        script.write("""{"palpate_view": 2, "size": [800, 600]}
{"frame": 10, "t_s": 5.0, "key": "x", "down": true}
{"frame": 11, "t_s": 5.1, "key": "x"}
{"frame": 70, "t_s": 6.1, "move": {"view": "axial", "share": [0.5, 0.6]}}
{"frame": 71, "t_s": 6.2, "button": "left", "down": true}
{"frame": 72, "t_s": 6.3, "move": {"view": "axial", "share": [0.6, 0.6]}}
{"frame": 73, "t_s": 6.4, "button": "left", "down": false}
{"frame": 74, "t_s": 6.5, "close": true}
{"frame": 80, "t_s": 6.6, "key": "e", "down": true}
{"frame": 81, "t_s": 6.7, "key": "e"}
""")
        script.flush()
        p = start(options=["--replay", script.name, "--speed", "4"])
        until("the last key of the script", lambda: any(event.get("key") == "e" and not event.get("down")
                                                        for event in p.events()))
    p.key("b")  # the window is the person's
    state = p.close(discards=True)
    assert state["undo_steps"] == 1, state["undo_steps"]
    assert state["tool"]["hand"] == "draw", state["tool"]


def opens_without_a_file(start):
    p = start(volume="")
    offered = p.shot()
    p.key("Escape")
    # It lies in the middle of the window, over all views.
    until("what was offered is gone", lambda: (p.shot(keep=False) != offered).any(axis=2).mean() > 0.05)
    state = p.close()
    assert not state["welcome_open"] and not state["browser_open"] and state["task"] == "look", state["task"]
    assert state["document"]["volume"], "a phantom to try tools on"


def pages_slices(start):
    p = start()
    p.at(*AXIAL)
    p.wheel(3)
    p.at(*CORONAL)
    p.wheel(-2)
    p.at(*SAGITTAL)
    p.key("Up", "Up", "Down")
    p.looks_right()
    # The phantom has 32 samples each way: the crosshair begins at 16.
    assert p.close()["crosshair_sample"] == [15, 14, 19], p.state["crosshair_sample"]


def window_by_w_and_drag(start):
    p = start()
    p.at(*AXIAL)
    p.hold("w")
    p.drag(133, 200, (0, -25))
    p.let("w")
    p.looks_right()
    state = p.close()
    # A pixel upwards lowers the level by 1/250 of the width: 25 pixels of 400 by 40.
    assert near(state["window"][0], -120) and near(state["window"][1], 280), state["window"]
    assert state["crosshair_sample"] == [16, 16, 16]


def zooms_pans_and_resets(start):
    p = start()
    p.at(*AXIAL)
    p.hold("ctrl")
    p.wheel(2)
    p.let("ctrl")
    p.drag(*CORONAL, (0, -40), button=3)
    p.drag(*SAGITTAL, (30, 20), button=2)
    p.drag(*VOLUME_VIEW, (60, 30))
    turned = p.state_of_replay()
    p.looks_right()
    p.key("r")
    state = p.close()
    assert near(turned["slices"]["axial"]["zoom"], 1.15 ** 2), turned["slices"]["axial"]
    assert near(turned["slices"]["coronal"]["zoom"], 1.01 ** 40), turned["slices"]["coronal"]
    assert turned["slices"]["sagittal"]["center_mm"] != state["slices"]["sagittal"]["center_mm"]
    assert turned["camera"]["eye_mm"] != state["camera"]["eye_mm"]
    assert all(state["slices"][name]["zoom"] == 1 for name in state["slices"])


def maximises_by_double_click(start):
    p = start()
    p.double(*CORONAL)
    assert p.state_of_replay()["alone"] == "coronal"
    p.looks_right()
    p.key("Escape", "l")
    state = p.close()
    assert state["alone"] == "" and state["layout"] == "3d"


def crosshair_by_shift_and_move(start):
    p = start()
    p.at(20, 20)
    p.hold("shift")
    p.at(160, 120)
    p.let("shift")
    p.at(*VOLUME_VIEW)
    p.looks_right()
    # A pixel of a slice is 2.08 * 16 * 200 / 31 / 267 mm = 0.804 mm, a sample 6.45 mm.
    state = p.close()
    assert state["crosshair_sample"] == [19, 13, 16], state["crosshair_sample"]


def turns_a_plane_by_its_handle(start):
    p = start()
    # The crosshair of sample 16 is (3.2 mm, 3.2 mm) from the middle: 4 pixels. Handles are 0.38 of
    # the shorter side from it.
    arm = round(0.38 * 267)
    p.drag(137 + arm, 148, (0, 60))
    state = p.close()
    assert abs(state["slices"]["coronal"]["towards"][0]) > 0.2, state["slices"]["coronal"]
    assert state["slices"]["axial"]["towards"] == [0, 0, 1] or \
        state["slices"]["axial"]["towards"] == [0, 0, -1], state["slices"]["axial"]


def drags_points_of_the_transfer_function(start):
    p = start()
    p.section("colours")
    left, top, width, height = p.seen("transfer/plot")
    before = p.replayed["transfer"]
    p.drag(left + 200, top + 20, (10, 40))
    p.looks_right()
    after = p.close()["transfer"]
    assert len(after["opacities"]) == len(before["opacities"]) + 1, after


def drags_an_iso_value(start):
    p = start(options=["--iso", "300"])
    p.section("colours")
    left, top, width, height = p.seen("transfer/plot")
    grip = left + round((300 + 1041) / 2171 * (width - 1))  # the phantom's values: -1041 .. 1130
    p.drag(grip, top + 3, (30, 20))
    p.looks_right()
    state = p.close()
    assert 480 < state["isos"][0] < 640, state["isos"]
    assert state["touch"]["iso"] == state["isos"][0]  # the hand feels what is seen


def paints_erases_and_undoes(start):
    p = start()
    p.key("b")
    p.drag(100, 120, (60, 0))
    p.key("e")
    p.drag(130, 100, (0, 40))
    p.section("labels")
    erased = p.state_of_replay()["label_counts"]
    p.looks_right()
    p.key("ctrl+z")
    painted = p.state_of_replay()["label_counts"]
    p.key("ctrl+z", "ctrl+z", "ctrl+y")
    state = p.close(discards=True)
    assert 0 < erased["1"] < painted["1"], (erased, painted)
    assert (state["undo_steps"], state["redo_steps"]) == (1, 1)


def drills_with_the_mouse_as_a_hand(start):
    p = start()
    project = saved_project(p)  # steps are in it as soon as they are done
    steps = size_of(project)
    p.at(*VOLUME_VIEW)
    p.key("x", "o")
    p.key("space")

    def drills():  # the hand comes to the pointer, and cuts, in a time of its own
        p.do("mousedown", 1)
        for step in range(6):
            p.at(402 + 4 * step, 144 + 2 * step)
        p.do("mouseup", 1)
        p.at(*VOLUME_VIEW)
        return size_of(project) > steps
    until("a step of the hand", drills)
    p.looks_right()
    state = p.close()
    assert state["hand"]["armed"] and state["hand"]["first"] == "cut", state["hand"]
    assert state["undo_steps"] >= 1, "the hand cut nothing"


def arms_and_disarms(start):
    p = start()
    p.at(*VOLUME_VIEW)
    p.key("o")
    p.key("space")
    assert p.state_of_replay()["hand"]["armed"]
    p.shot()
    p.key("Escape")
    state = p.close()
    assert state["hand"]["on"] and not state["hand"]["armed"], state["hand"]
    assert state["undo_steps"] == 0


def measures(start):
    p = start()
    p.key("m")
    p.drag(90, 120, (80, 0))
    p.key("m")
    for place in ((60, 434), (133, 434), (133, 380)):
        p.click(*place)
    p.key("m", "m")
    p.drag(340, 480, (20, 0))
    p.looks_right()
    p.key("Delete")
    found = p.close(discards=True)["measures"]
    assert [m["kind"] for m in found] == ["ruler", "angle"], found
    mm_per_px = 2.08 * 16 * 200 / 31 / 267
    assert near(found[0]["length_mm"], 80 * mm_per_px, 1e-6), found[0]
    assert near(found[1]["angle_deg"], 90, 1e-6), found[1]


def clips_by_a_handle(start):
    p = start()
    p.section("clips")
    p.widget("clip/add")
    before = p.state_of_replay()["clips"]
    p.widget("clip/none")
    p.widget("clip/box")
    p.looks_right()
    state = p.close()
    assert len(before) == 1 and len(state["clips"]) == 6, state["clips"]


def saves_and_goes_on(start):
    p = start()
    p.click(CORONAL[0] + 25, CORONAL[1] - 20)
    p.key("b")
    p.drag(100, 120, (40, 0))
    project = saved_project(p)
    recent = os.path.join(p.folder, ".local/state/palpate/recent.json")

    def is_listed():
        return os.path.exists(recent) and project in open(recent).read()
    until("the project among what was opened last", is_listed)
    # Another program cannot have it as well, and says so in a sentence.
    second = subprocess.run([p.program, "view", project], env=p.environment, capture_output=True,
                            text=True)
    assert second.returncode == 1 and second.stderr.count("\n") == 1, second.stderr
    assert "work.palpate: the project is open already" in second.stderr, second.stderr
    saved = p.close()  # nothing is lost: no question
    again = start(volume=project, name="goes_on")
    again.looks_right()
    state = again.close()
    assert state["document"]["labels"] == saved["document"]["labels"]
    assert state["crosshair_sample"] == saved["crosshair_sample"] != [16, 16, 16]


def size_of_png(path):
    """Of one that the program writes: read when it is there."""
    until(path, lambda: os.path.exists(path))
    with open(path, "rb") as file:
        head = file.read(24)
    return struct.unpack(">2I", head[16:24])


def takes_a_picture(start):
    p = start()
    p.key("ctrl+p")
    size = size_of_png(os.path.join(p.folder, "palpate-1.png"))
    p.close()
    assert size == (848, 642), size


def writes_a_figure(start):
    p = start()
    p.section("figure")
    p.widget("figure/write")
    size = size_of_png(os.path.join(p.folder, "figure.png"))
    p.close()
    assert size == (1600, 1200), size


def writes_pictures_round_the_head(start):
    p = start()
    p.section("figure")
    for widget, typed in (("figure/pictures", "3"), ("figure/size", "64")):
        left, top, _, height = p.seen(widget)
        p.click(left + 12, top + height // 2)
        p.key("ctrl+a")
        p.type(typed)
        p.key("Return")
    p.widget("figure/write")
    names = [os.path.join(p.folder, f"figure-{i:04}.png") for i in range(3)]
    until("three pictures", lambda: all(os.path.exists(name) for name in names))
    p.close()
    pictures = [open(name, "rb").read() for name in names]
    assert len(set(pictures)) == 3, "the camera goes round"
    assert size_of_png(names[0]) == (64, 1200)


def fills_the_screen(start):
    p = start(options=["--full-screen", "0"])
    until("a window as large as the screen", lambda: p.shot().shape == (1024, 1280, 3))
    state = p.close()
    assert state["size"] == [1280, 1024] and list(state["panels"]) == ["3d"], state["panels"]


def resizes(start):
    p = start()
    p.do("windowsize", p.window, 1000, 700)
    p.looks_right()
    p.do("windowsize", p.window, 200, 100)  # the window manager is told how small it may be
    state = p.close()
    assert state["size"] == [480, 320], state["size"]


def stays_when_it_is_asked(start):
    p = start()
    p.key("x")
    p.drag(100, 120, (40, 0))
    p.ask_to_close()
    p.widget("leave/cancel")  # fails where the program has ended without a question
    assert p.state_of_replay()["leaving"] == ""
    state = p.close(discards=True)
    assert state["undo_steps"] == 1


def saves_when_it_is_asked(start):
    p = start()
    p.key("b")
    p.drag(100, 120, (40, 0))
    p.ask_to_close()
    p.widget("leave/save")
    p.last_click("save/save")
    p.process.wait(timeout=60)  # it closes when all is saved
    with open(p.state_file) as file:
        state = json.load(file)
    again = start(volume=os.path.join(p.folder, "work.palpate"), name="goes_on_after_closing")
    assert again.close()["document"] == state["document"]


def types_into_a_field(start):
    p = start()
    p.section("brush")
    left, top, width, height = p.boxes()["tool/radius"]
    p.click(left + width + 20, top + height // 2)  # the field beside the slider
    p.key("ctrl+a")
    p.type("7.5")
    p.key("Return")
    p.at(*AXIAL)
    p.key("b")  # a shortcut again
    state = p.close()
    assert near(state["tool"]["radius_mm"], 7.5), state["tool"]
    assert state["tool"]["hand"] == "draw"


def shows_its_keys(start):
    p = start()
    before = p.shot()
    p.key("question")
    assert p.state_of_replay()["help_open"]
    p.changes(before, 0.2)
    p.shot()
    p.key("Escape")
    assert not p.close()["help_open"]


def keeps_how_it_looks(start):
    p = start()
    p.section("appearance")
    p.widget("file/light")
    p.looks_right()
    home = p.folder
    assert p.close()["light"]
    again = start(name="looks_as_before", home=home)
    again.shot()
    assert again.close()["light"], "light colours are forgotten"


def refuses_without_a_driver(start):
    p = start()
    p.close()
    for name, words, environment in (
            ("a Vulkan driver", [], {"VK_ICD_FILENAMES": "/nonexistent",
                                     "VK_DRIVER_FILES": "/nonexistent"}),
            ("graphics memory", ["--gpu-memory", "100K"], {}),
            ("monitor 0 .. 0, found 7", ["--full-screen", "7"], {}),
            ("a display", [], {"DISPLAY": ":4711"})):
        ran = subprocess.run([p.program, "view", "synthetic:phantom?size=64", *words],
                             env=dict(p.environment, **environment), capture_output=True, text=True,
                             timeout=60, cwd=p.folder)
        assert ran.returncode == 1, (name, ran.returncode)
        assert ran.stderr.count("\n") == 1 and name in ran.stderr, (name, ran.stderr)


def works_undoes_and_asks(start):
    p = start(volume="synthetic:phantom?size=48")
    p.click(150, 150)
    p.do("click", 4, wants=2 - 1)
    p.key("b")
    p.drag(120, 420, (48, 12))
    p.key("x")
    p.click(200, 200)
    p.key("ctrl+z")
    p.do("windowsize", "--sync", p.window, 900, 650)
    p.screen.xdo("windowminimize", "--sync", p.window)
    p.goes_round()
    p.screen.xdo("windowactivate", "--sync", p.window)
    p.key("question")
    state = p.close(discards=True)
    assert state["size"] == [900, 650], state["size"]
    assert (state["undo_steps"], state["redo_steps"]) == (1, 1)
    assert state["tool"]["hand"] == "cut" and state["help_open"] and state["refusal"] == ""
    # What was recorded gives the same document and views without the window.
    replayed = p.state_of_replay()
    for hand in (state["hand"], replayed["hand"]):  # a cut is looked at by the clock, and at the window alone
        del hand["removed_mm3"], hand["grains"], hand["sound_level"]
    for key in state:
        if key != "widgets":  # the question of closing is not among them
            assert replayed[key] == state[key], f"{key}: {replayed[key]} beside {state[key]}"


def loses_no_step_when_it_is_killed(start):
    p = start()
    p.key("b")
    p.drag(120, 420, (48, 12))
    project = saved_project(p)

    def look():
        shown = subprocess.run([p.program, "--quiet", "view", project, "--headless", "--state", "-"],
                               capture_output=True, text=True, check=True)
        return json.loads(shown.stdout)["document"]

    saved = look()
    p.drag(120, 380, (48, 12))
    until("the stroke after the save, on disk", lambda: look()["labels"] != saved["labels"])
    p.kill()
    kept = look()
    assert kept["labels"] != saved["labels"], "the stroke after the save is lost"
    assert kept["volume"] == saved["volume"]
    again = start(volume=project, name="after_the_kill")
    again.key("ctrl+z")
    undone = again.close()
    assert undone["document"] == saved, "undo of the stroke that was recovered"
    assert undone["redo_steps"] == 1


def use_of(pid):
    """Processor seconds of a process so far, and the switches of each of its threads."""
    with open(f"/proc/{pid}/stat") as file:
        words = file.read().rsplit(")", 1)[1].split()
    switches = {}
    for task in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{task}/status") as file:
            switches[task] = sum(int(line.split()[1]) for line in file if "ctxt_switches" in line)
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK"), switches


def idle_use(pid, seconds):
    """The share of a core, the switches a second, and those of all threads but the busiest one."""
    begun, (cpu_s, switches) = time.time(), use_of(pid)
    time.sleep(seconds)
    passed, (cpu_s_then, then) = time.time() - begun, use_of(pid)
    more = [count - switches.get(task, 0) for task, count in then.items()]
    use = [(cpu_s_then - cpu_s) / passed, sum(more) / passed, (sum(more) - max(more)) / passed]
    print(f"    {100 * use[0]:.2f} % of a core, {use[1]:.0f} switches a second, "
          f"{use[2]:.0f} of them not of the busiest thread")
    return use


def sleeps_while_it_is_idle(start):
    """The property is one of time: PALPATE_SECONDS says how long it is looked at."""
    seconds = float(os.environ.get("PALPATE_SECONDS", 4))
    p = start()

    def expect_sleep():
        # Pictures become full, and the last step is done.
        until("the end of all work", lambda: p._ended() or idle_use(p.process.pid, 1.0)[0] <= 0.01)
        share, switches, _ = idle_use(p.process.pid, seconds)
        assert share <= 0.01, f"{100 * share:.2f} % of a core"
        assert switches <= 100, f"{switches:.0f} switches a second"

    expect_sleep()
    p.key("b")
    p.drag(*AXIAL, (30, 10))
    expect_sleep()
    p.close(discards=True)


SESSIONS = [
    sleeps_while_it_is_idle,
    saves_when_it_is_asked,
    loses_no_step_when_it_is_killed, works_undoes_and_asks, saves_and_goes_on,
    drills_with_the_mouse_as_a_hand, measures, paints_erases_and_undoes, keeps_how_it_looks,
    browser_opens_a_typed_file, plays_a_script_and_hands_over, opens_without_a_file, writes_a_figure, writes_pictures_round_the_head, pages_slices, window_by_w_and_drag, zooms_pans_and_resets,
    maximises_by_double_click, crosshair_by_shift_and_move, turns_a_plane_by_its_handle,
    drags_points_of_the_transfer_function, drags_an_iso_value, arms_and_disarms, clips_by_a_handle,
    takes_a_picture, fills_the_screen, resizes, stays_when_it_is_asked, types_into_a_field,
    shows_its_keys, refuses_without_a_driver]
