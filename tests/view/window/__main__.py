"""palpate view in a window, used as a person would: Xvfb, openbox and xdotool.

    window PALPATE [SESSION ..]

Sessions are done by a few workers beside each other, each with a screen of its own. The pictures that
a session looks at are kept in the folder that PALPATE_WINDOW_SHOTS names.
"""
import os
import queue
import shutil
import sys
import tempfile
import threading
import time
import traceback

from person import Person, Screen, absent
from sessions import SESSIONS

WORKERS = 3


def work(program, sessions, folder, failures, seconds):
    os.makedirs(folder)
    screen = Screen(folder)
    try:
        while True:
            try:
                session = sessions.get_nowait()
            except queue.Empty:
                return
            people = []

            def start(name=session.__name__, **more):
                people.append(Person.__new__(Person))
                people[-1].process = None
                people[-1].__init__(program, screen, name, **more)
                return people[-1]

            begun = time.time()
            try:
                session(start)
            except Exception:  # any: the other sessions go on
                said = "".join(p.said() for p in people if hasattr(p, "messages"))
                failures.append(f"{session.__name__}:\n{traceback.format_exc()}{said}")
            finally:
                for person in people:
                    if person.process:
                        person.kill()
            seconds[session.__name__] = time.time() - begun
    except Exception:
        failures.append(traceback.format_exc())
    finally:
        screen.close()


def main():
    program, names = os.path.abspath(sys.argv[1]), sys.argv[2:]
    if absent():
        raise SystemExit(f"window: {', '.join(absent())}: not installed; run scripts/bootstrap")
    sessions = queue.Queue()
    for session in SESSIONS:
        if not names or session.__name__ in names:
            sessions.put(session)
    count = sessions.qsize()
    assert count > 0, f"no session is called {names}"
    folder = tempfile.mkdtemp(prefix="palpate.window.")
    failures, seconds = [], {}
    begun = time.time()
    threads = [threading.Thread(target=work, args=(program, sessions, f"{folder}/{i}", failures,
                                                   seconds)) for i in range(min(WORKERS, count))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name, took in sorted(seconds.items(), key=lambda item: -item[1]):
        print(f"{took:6.1f} s  {name}")
    print(f"{count} sessions in {time.time() - begun:.0f} s, {len(failures)} failed")
    if failures:
        raise SystemExit("\n".join(failures) + f"\nwhat they left is in {folder}")
    shutil.rmtree(folder)


main()
