"""A person at a window of `palpate view`: Xvfb, openbox and xdotool.

Every step waits until the program has recorded what it caused (--record), and not for a time. What is
done on another thread is waited for where it can be seen: in the picture, the title or a file.
"""
import json
import os
import shutil
import struct
import subprocess
import time
import zlib

import numpy

VOLUME = "synthetic:phantom?size=32"
BARS, GAP = (44, 38), 2  # what the bars take at the left and at the top, and what lies round the views
STATUS, PANEL = 22, 264  # heights and widths of the line at the bottom and of the side panel
VIEWS = (BARS[0] + GAP, BARS[1] + GAP)  # the first pixel of the views
NEEDED = ("Xvfb", "openbox", "xdotool")
LONGEST_S = 60  # of any step, on a busy machine


def absent():
    """The programs that are needed and not installed."""
    return [name for name in NEEDED if not shutil.which(name)]


def until(what, found, seconds=LONGEST_S):
    """The first result of found() that is true."""
    end = time.time() + seconds
    while True:
        result = found()
        if result:
            return result
        if time.time() > end:
            raise AssertionError(f"waited {seconds} s for {what}")
        time.sleep(0.03)


class Screen:
    """An X server with a window manager, started once for all sessions of a worker."""

    def __init__(self, folder):
        self.folder = folder
        self.pictures = os.path.join(folder, "frame")
        os.makedirs(self.pictures)
        read, write = os.pipe()
        self.server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x1024x24", "-nolisten", "tcp",
             "-fbdir", self.pictures], pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as numbers:
            number = numbers.readline().strip()
        assert number, "Xvfb did not start"
        self.environment = dict(os.environ, DISPLAY=":" + number)
        self.environment.pop("WAYLAND_DISPLAY", None)
        # Its properties are there before it takes windows. A window that is mapped between is never
        # shown, and GLFW waits for it without end. --startup comes after that.
        ready = os.path.join(folder, "manager.is.ready")
        self.manager = subprocess.Popen(
            ["openbox", "--startup", f"touch '{ready}'"], env=dict(self.environment, HOME=folder),
            stdout=subprocess.DEVNULL, stderr=open(os.path.join(folder, "manager.said"), "w"))
        until("a window manager", lambda: self._managed() or os.path.exists(ready))

    def _managed(self):
        if self.manager.poll() is not None:
            with open(os.path.join(self.folder, "manager.said")) as said:
                raise AssertionError(f"openbox ended with {self.manager.poll()}: {said.read()}")
        return False

    def xdo(self, *words):
        return subprocess.run(["xdotool", *map(str, words)], env=self.environment,
                              capture_output=True, text=True).stdout

    def picture(self):
        """What the screen shows: rows, columns, RGB. Xvfb keeps it as an XWD file."""
        with open(os.path.join(self.pictures, "Xvfb_screen0"), "rb") as file:
            data = file.read()
        header = struct.unpack(">25I", data[:100])
        size, width, height, stride, colors = header[0], header[4], header[5], header[12], header[19]
        rows = numpy.frombuffer(data, numpy.uint8, stride * height, size + 12 * colors)
        return rows.reshape(height, stride // 4, 4)[:, :width, 2::-1]

    def close(self):
        for process in (self.manager, self.server):
            process.terminate()
            process.wait()


def save_png(path, picture):
    height, width, _ = picture.shape
    rows = numpy.zeros((height, 1 + 3 * width), numpy.uint8)
    rows[:, 1:] = picture.reshape(height, 3 * width)

    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))

    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(rows.tobytes(), 1)) + chunk(b"IEND", b""))


class Person:
    """One window, and who works in it. Places are pixels from the first one of the views; `size` is that of
    a window without bars."""

    def __init__(self, program, screen, name, volume=VOLUME, options=(), size=(800, 600), home=None):
        self.screen, self.name, self.size = screen, name, size
        self.folder = home or os.path.join(screen.folder, name)
        os.makedirs(self.folder, exist_ok=True)
        self.program, self.volume = program, volume
        self.state_file = os.path.join(self.folder, "state.json")
        self.record_file = os.path.join(self.folder, "record.jsonl")
        if os.path.exists(self.record_file):
            os.remove(self.record_file)
        self.environment = dict(screen.environment, HOME=self.folder)
        self.environment.pop("XDG_STATE_HOME", None)
        self.messages = open(os.path.join(self.folder, "messages"), "w+")
        options = list(options)
        self.scene = options if "--iso" in options else []  # what else the replay of a record needs
        if "--full-screen" not in options:
            options += ["--size", f"{size[0] + BARS[0] + 2 * GAP},{size[1] + BARS[1] + 2 * GAP}"]
        self.origin = (0, 0)
        self.pointer = None  # where a step has put it
        self.process = subprocess.Popen(
            [program, "view", *([volume] if volume else []), *options, "--validate", "--state", self.state_file,
             "--record", self.record_file], env=self.environment, cwd=self.folder,
            stderr=self.messages)
        self.window = until("a window", self._window)
        until("the first frame", lambda: self.lines() > 0 or self._ended())
        until("a picture", lambda: self._ended() or self.shot(keep=False).std() > 5)
        self.screen.xdo("windowactivate", "--sync", self.window)
        self.origin = self._origin()

    def _origin(self):
        """Where the window's first pixel lies: what the manager says is beside its frame."""
        self.screen.xdo("mousemove", "--window", self.window, 2, 2)
        self.pointer = None
        place = dict(word.split(":") for word in self.screen.xdo("getmouselocation").split())
        return int(place["x"]) - 2, int(place["y"]) - 2

    def _ended(self):
        assert self.process.poll() is None, f"the program ended: {self.said()}"
        return False

    def _window(self):
        self._ended()
        found = self.screen.xdo("search", "--onlyvisible", "--pid", self.process.pid).split()
        return found[-1] if found else None

    def said(self):
        self.messages.seek(0)
        return self.messages.read()

    def events(self):
        try:
            with open(self.record_file) as file:
                return [json.loads(line) for line in file if line.endswith("\n")]
        except OSError:
            return []

    def lines(self):
        return len(self.events())

    # Steps.
    def do(self, *words, wants=1):
        """An xdotool command, and the events that it causes."""
        before = self.lines()
        self.screen.xdo(*words)
        until(f"{wants} events of {words}",
              lambda: self._ended() or self.lines() >= before + wants)

    def at(self, x, y):
        if self.pointer != (x, y):
            self.do("mousemove", "--window", self.window, x + VIEWS[0], y + VIEWS[1])
        self.pointer = (x, y)

    def click(self, x, y, button=1):
        self.at(x, y)
        self.do("click", button, wants=2)

    def double(self, x, y):
        self.at(x, y)
        self.do("click", "--repeat", 2, "--delay", 60, 1, wants=4)

    def title(self):
        return self.screen.xdo("getwindowname", self.window)

    def goes_round(self, turns=4):
        """Waits until the program's loop has taken some more turns, at each of which its thread waits."""
        def waits():
            with open(f"/proc/{self.process.pid}/status") as status:
                return int(next(line for line in status if line.startswith("voluntary")).split()[1])
        before = waits()
        until("turns of the loop", lambda: self._ended() or waits() >= before + turns)

    def ask_to_close(self):
        """As a person does: the program has the wish when this returns, and may have ended."""
        def wishes():
            return sum("close" in event for event in self.events())
        before = wishes()
        self.screen.xdo("windowactivate", "--sync", self.window)
        self.screen.xdo("key", "alt+F4")
        until("the wish to close", lambda: wishes() > before)

    def drag(self, x, y, by, button=1, steps=8):
        self.at(x, y)
        self.do("mousedown", button)
        for i in range(1, steps + 1):
            self.do("mousemove", "--window", self.window, VIEWS[0] + x + round(by[0] * i / steps),
                    VIEWS[1] + y + round(by[1] * i / steps))
        self.pointer = (x + by[0], y + by[1])
        self.do("mouseup", button)

    def wheel(self, notches):
        self.do("click", "--repeat", abs(notches), "--delay", 20, 4 if notches > 0 else 5,
                wants=abs(notches))

    def key(self, *names):
        for name in names:
            self.do("key", "--delay", 30, name, wants=2)

    def hold(self, name):
        self.do("keydown", name)

    def let(self, name):
        self.do("keyup", name)

    def type(self, text):
        self.do("type", "--delay", 30, text, wants=2 * len(text))

    def boxes(self):
        """Where widgets and views lie now: what was recorded, done without a window."""
        ran = subprocess.run([self.program, "--quiet", "view", self.volume, *self.scene, "--headless", "--replay",
                              self.record_file, "--state", "-"], capture_output=True, text=True,
                             check=True, cwd=self.folder, env=self.environment)
        self.replayed = json.loads(ran.stdout)
        return {name: [left - VIEWS[0], top - VIEWS[1], width, height]
                for name, (left, top, width, height) in self.replayed["widgets"].items()}

    def seen(self, name):
        """The box of a widget of the side panel, scrolled to where it can be seen."""
        for _ in range(20):
            left, top, width, height = self.boxes()[name]
            above, below = top < 0, top + height > self.size[1] - STATUS
            if left < self.size[0] - PANEL or not above and not below:
                break
            self.at(self.size[0] - PANEL // 2, self.size[1] // 2)
            self.wheel(3 if above else -3)
        return left, top, width, height

    def widget(self, name, x=None):
        """A click on a widget; x: pixels from its left."""
        left, top, width, height = self.seen(name)
        self.click(left + (min(8, width // 2) if x is None else x), top + height // 2)

    def section(self, name):
        """Takes the task that has a section of the panel, and opens the section."""
        for task in ("look", "segment", "measure", "drill", "export"):
            if f"section/{name}" not in self.boxes():
                self.widget(f"task/{task}")
        if name not in self.state_of_replay()["sections_open"]:
            self.widget(f"section/{name}")

    def last_click(self, name):
        """A click on a widget that ends the program."""
        left, top, width, height = self.boxes()[name]
        self.at(left + width // 2, top + height // 2)
        self.screen.xdo("click", 1)

    def shot(self, keep=True):
        """The window's picture, looked at: it is kept where PALPATE_WINDOW_SHOTS names a folder."""
        geometry = dict(line.split("=") for line in self.screen.xdo(
            "getwindowgeometry", "--shell", self.window).split())
        x, y = self.origin
        picture = self.screen.picture()[y:y + int(geometry["HEIGHT"]), x:x + int(geometry["WIDTH"])]
        folder = os.environ.get("PALPATE_WINDOW_SHOTS")
        if keep and folder:
            save_png(os.path.join(folder, self.name + ".png"), picture)
        return picture

    def looks_right(self):
        """Views that show something: grey values differ in each, and no view is black."""
        self.screen.xdo("mousemove", "--window", self.window, 2, 2)
        self.pointer = None
        panels = self.state_of_replay()["panels"]

        def all_show_something():
            picture = self.shot(keep=False).astype(float)
            return all(picture[y:y + height, x:x + width].std() > 8 for x, y, width, height in panels.values())
        until("grey values in every view", lambda: self._ended() or all_show_something())
        self.shot()

    def changes(self, before, share):
        """Waits until so large a share of the window's pixels is another than in a picture before."""
        def changed():
            differences = abs(self.shot(keep=False).astype(int) - before).max(axis=2)
            return (differences > 8).mean() > share
        until(f"{100 * share:.0f} % other pixels", lambda: self._ended() or changed())

    def state_of_replay(self):
        self.boxes()
        return self.replayed

    def close(self, discards=False):
        """Closes the window as a person does, and returns the state then. discards: edits that are not
        saved, when the program asks, which it must."""
        self.ask_to_close()
        if discards:
            self.last_click("leave/discard")  # fails where the program has ended without a question
        try:
            self.process.wait(timeout=LONGEST_S)
        except subprocess.TimeoutExpired:
            pass
        code = self.process.poll()
        assert code is not None, f"{self.name}: the window did not close"
        assert code == 0, f"ended with {code}: {self.said()}"
        with open(self.state_file) as file:
            self.state = json.load(file)
        return self.state

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.messages.close()
