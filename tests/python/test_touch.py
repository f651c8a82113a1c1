"""Touch from Python: the loop on a virtual clock, and a servo whose device is written here."""

import csv
import threading

import numpy as np
import pytest

import palpate


def press(depth=5.0, rest=0.3):
    """Comes from above to `depth` mm below the surface of the fixture's ball (radius 10 mm), and stays."""
    return [(0.0, 0, 0, 20), (1.0, 0, 0, 10 - depth), (1.0 + rest, 0, 0, 10 - depth)]


def test_a_spring_presses_with_its_stiffness(ball):
    felt = palpate.touch(ball, press(2.0), iso=100, stiffness=400, device="ideal", grip=3)
    assert felt.time_s[0] == 0 and np.allclose(np.diff(felt.time_s), 1e-3)
    assert felt.tool.shape == felt.force.shape == felt.proxy.shape == (len(felt.time_s), 3)
    assert (felt.contact[:200] == palpate.CONTACTS.index("free")).all() and not felt.force[:200].any()
    assert felt.contact[-1] == palpate.CONTACTS.index("touching")
    # At rest the force is that of the coupling, in newtons for millimetres of depth, along +z.
    assert felt.depth[-1] > 0.5
    assert felt.force[-1, 2] == pytest.approx(0.4 * felt.depth[-1], rel=0.02)
    # The proxy lies on the surface, to a sample of 2 mm a tenth of which is lost to interpolation.
    assert np.linalg.norm(felt.proxy[-1]) == pytest.approx(10, abs=0.2)
    assert felt.normal[-1, 2] > 0.99 and felt.fault_names == "none"


def test_it_is_the_command_line_to_the_bit(ball, command, tmp_path):
    palpate.save(tmp_path / "ball.nrrd", ball)
    rows = press()
    with open(tmp_path / "hand.csv", "w") as out:
        out.write("time_s,x_mm,y_mm,z_mm\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    options = {"iso": 100, "stiffness": 600, "friction": 0.2, "algorithm": "swept-tool", "radius": 1.5}
    words = [f"--{name}={value}" for name, value in options.items()]
    command("touch", tmp_path / "ball.nrrd", "--path", tmp_path / "hand.csv", *words, "--report", tmp_path / "t.csv")
    felt = palpate.touch(palpate.load(tmp_path / "ball.nrrd"), rows, **options)
    said = list(csv.DictReader(open(tmp_path / "t.csv")))
    assert len(said) == len(felt.time_s)
    # The report has six decimals.
    for name, array in (("force_{}_n", felt.force), ("proxy_{}_mm", felt.proxy), ("probe_{}_mm", felt.tool)):
        there = np.array([[float(row[name.format(axis)]) for axis in "xyz"] for row in said])
        assert np.abs(there - array).max() < 1e-5, name
    again = palpate.touch(ball, rows, **options)
    assert all(np.array_equal(a, b) for a, b in zip(felt[:11], again[:11]))


def test_a_pressed_button_drills_and_the_volume_is_another(ball):
    path = [(*row, 1) for row in press()]
    felt = palpate.touch(ball, path, iso=100, algorithm="swept-tool", radius=1.5, drill=2.0)
    assert felt.strokes == 1 and felt.buttons[-1] == 1
    before, after = ball.to_numpy(), felt.volume.to_numpy()
    assert after.shape == before.shape and (after < before).sum() > 10 and not (after > before).any()
    kept = palpate.touch(ball, press(), iso=100)
    assert kept.strokes == 0 and np.array_equal(kept.volume.to_numpy(), before)


def test_labels_are_felt(ball):
    labels = (ball.to_numpy() >= 100).astype(np.uint8) * 3
    felt = palpate.touch(ball, press(), labels=palpate.Volume.from_numpy(labels, ball.affine), source="labels")
    assert felt.contact[-1] == palpate.CONTACTS.index("touching")
    assert felt.depth[-1] > 0.5 and felt.force[-1, 2] > 0.1


def test_labels_functions_and_opacities_are_those_of_the_command_line(ball, command, tmp_path):
    """Each option changes what is felt, and feels as on the command line."""
    palpate.save(tmp_path / "ball.nrrd", ball)
    halves = (ball.to_numpy() > 100).astype(np.uint8)
    halves[: halves.shape[0] // 2] *= 2
    parts = palpate.Volume.from_numpy(halves, ball.affine)
    palpate.save(tmp_path / "parts.nrrd", parts)
    rows = [(0.0, 3, 0, 20), (1.0, 3, 0, 5), (1.2, 3, 0, 5)]
    with open(tmp_path / "hand.csv", "w") as out:
        out.write("time_s,x_mm,y_mm,z_mm\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    cases = [
        ({"label_feel": [(1, 200), (2, 900, 0.3)]}, ["--label-feel=1,200", "--label-feel=2,900,0.3"], {"labels": parts}),
        ({"algorithm": "wish-2008-potential", "transfer": 0.5}, ["--transfer=0.5"], {}),
        ({"algorithm": "wish-2008-potential", "transfer": [(0, 0), (150, 0.7)]}, ["--transfer=0:0,150:0.7"], {}),
        ({"algorithm": "swept-local", "opacity": [(0, 0), (200, 1)]}, ["--opacity=0:0,200:1"], {}),
    ]
    for options, words, more in cases:
        if "algorithm" in options:
            words = words + [f"--algorithm={options['algorithm']}"]
        if more:
            words = words + ["--labels", tmp_path / "parts.nrrd"]
        command("touch", tmp_path / "ball.nrrd", "--path", tmp_path / "hand.csv", "--iso=100", *words, "--report", tmp_path / "t.csv")
        felt = palpate.touch(palpate.load(tmp_path / "ball.nrrd"), rows, iso=100, **options, **more)
        said = list(csv.DictReader(open(tmp_path / "t.csv")))
        there = np.array([[float(row[f"force_{axis}_n"]) for axis in "xyz"] for row in said])
        assert np.abs(there - felt.force).max() < 1e-5, options  # the report has six decimals
        plain = palpate.touch(ball, rows, iso=100, **{k: v for k, v in options.items() if k == "algorithm"})
        assert not np.allclose(plain.force, felt.force, atol=1e-3), options


@pytest.mark.parametrize("options", [{"label_feel": [(1,)]}, {"label_feel": 3}, {"transfer": "x"}, {"opacity": [(1, 2, 3)]}])
def test_what_cannot_be_felt_is_an_error_that_names_the_option(ball, options):
    with pytest.raises(palpate.Error, match=next(iter(options))):
        palpate.touch(ball, press(), **options)


@pytest.mark.parametrize(
    "path, options, words",
    [
        ([(0, 0, 0)], {}, "rows of time_s"),
        ([], {}, "path"),
        ([(0, 0, 0, 0), (0, 0, 0, 1)], {}, "time"),
        ([(0, 0, 0, float("nan"))], {}, "places within"),
        (press(), {"stiffness": -1}, "stiffness: expected a number from 0 to 1000000 N/m, found -1"),
        (press(), {"stiffness": float("nan")}, "stiffness"),
        (press(), {"sharpness": 1}, "sharpness: expected an option"),
        (press(), {"algorithm": "none of them"}, "algorithm: expected one of"),
        (press(), {"device": "no such"}, "no such"),
        (press(), {"friction": 0.1, "friction_dynamic": 0.2}, "friction_dynamic"),
        (press(), {"edit": {"kind": "no such"}, "tool": {"kind": "ball", "radius_mm": 1}}, "kind"),
        (press(), {"stiffness": "much"}, "stiffness: expected a number"),
        ([(0, 0, 0, 0), (4000, 0, 0, 1)], {}, "an hour"),
    ],
)
def test_what_is_wrong_is_an_error_of_one_sentence(ball, path, options, words):
    with pytest.raises(palpate.Error) as error:
        palpate.touch(ball, path, **options)
    assert words in str(error.value) and "\n" not in str(error.value)


def test_progress_is_told_and_stops_it(ball):
    shares = []
    palpate.touch(ball, press(), iso=100, progress=shares.append)
    assert shares and sorted(shares) == shares and 0 <= shares[0] and shares[-1] <= 1

    class Enough(Exception):
        pass

    def stop(_):
        raise Enough

    with pytest.raises(Enough):
        palpate.touch(ball, [(0, 0, 0, 20), (600, 0, 0, 20)], iso=100, progress=stop)


class Spring:
    """A device whose handle a spring of a hand pulls down to `goal` mm, against the force."""

    def __init__(self, goal):
        self.position, self.goal, self.forces = np.array([0.0, 0.0, 20.0]), goal, []
        self.hand = 0.3  # N/mm

    def read(self):
        return self.position

    def write(self, force):
        self.forces.append(force)
        if len(self.forces) > 2500:  # after the soft start
            pulled = self.hand * (np.array([0, 0, self.goal]) - self.position) + force
            self.position = self.position + np.clip(0.02 * pulled / self.hand, -0.05, 0.05)


def test_a_device_written_in_python_is_held_by_the_surface(ball):
    device, now = Spring(goal=5.0), [0.0]

    def sleep(_):
        now[0] += 1e-3  # a clock of the test's own: it waits for nobody

    servo = palpate.Servo(ball, center=(0, 0, 0), iso=100, stiffness=600)
    felt = servo.run(device, 6.0, rate=1000, clock=lambda: now[0], sleep=sleep)
    assert felt[0].contact == "free" and felt[0].share < 0.1 and felt[0].force == (0, 0, 0)
    assert felt[-1].contact == "touching" and felt[-1].share == 1.0 and felt[-1].faults in ("none", "softened")
    assert np.linalg.norm(felt[-1].proxy) == pytest.approx(10, abs=0.2)
    # In balance the hand's spring and the surface's press alike.
    assert felt[-1].force[2] == pytest.approx(0.3 * (device.position[2] - 5.0), rel=0.05)
    assert device.forces[-1] == (0.0, 0.0, 0.0)  # the end lets go


def test_a_device_that_raises_is_let_go(ball):
    class Broken(Spring):
        def read(self):
            if len(self.forces) == 5:
                raise OSError("unplugged")
            return super().read()

    device, now = Broken(goal=20.0), [0.0]

    def sleep(_):
        now[0] += 1e-3

    with pytest.raises(OSError, match="unplugged"):
        palpate.Servo(ball, iso=100).run(device, 1.0, clock=lambda: now[0], sleep=sleep)
    assert device.forces[-1] == (0.0, 0.0, 0.0)


def test_a_servo_refuses_what_is_no_input(ball):
    servo = palpate.Servo(ball, iso=100)
    servo.tick(0.0, (0, 0, 20))
    for time_s, position in ((0.0, (0, 0, 20)), (-1, (0, 0, 20)), (1.0, (0, 0)), (1.0, (0, 0, float("nan"))), ("x", (0, 0, 0))):
        with pytest.raises(palpate.Error):
            servo.tick(time_s, position)
    servo.arm()
    for wrong in ({"reach": -1}, {"max_force": 1e9}, {"center": (1, 2)}, {"drill": 2.0}):
        with pytest.raises(palpate.Error):
            palpate.Servo(ball, **wrong)


def test_threads_may_share_a_servo(ball):
    servo, errors = palpate.Servo(ball, iso=100), []

    def tick(start):
        for i in range(200):
            try:
                servo.tick(start + i * 1e-3, (0, 0, 20))
            except palpate.Error as error:  # another thread's time was later
                assert "time" in str(error)
            except Exception as error:  # noqa: BLE001
                errors.append(error)

    threads = [threading.Thread(target=tick, args=(i * 1e-4,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
