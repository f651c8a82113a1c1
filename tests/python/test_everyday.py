"""What people do every day with the program: figures, labels, jobs, conversions, reports."""

import json
import os
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest

import palpate
from conftest import PROGRAM

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "docs"))
from scene_by_document import read_png  # noqa: E402

BALL = "synthetic:phantom?size=32"


def run(*words, cwd=None, env=None):
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, cwd=cwd, env=env)


def chunks(path):
    """The chunks of a PNG by their names."""
    data, at, found = open(path, "rb").read(), 8, {}
    while at < len(data):
        size, name = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size : at + 12 + size])[0] == zlib.crc32(name + body)
        found[name.decode()] = body
        at += 12 + size
    return found


@pytest.fixture
def labelled(tmp_path):
    """A grey volume of 40^3 at 1 mm, and a map with label 2 in a small and 7 in a large box, as .seg.nrrd."""
    grey = np.zeros((40, 40, 40), np.int16)
    grey[5:35, 5:35, 5:35] = 100
    labels = np.zeros((40, 40, 40), np.uint8)
    labels[8:14, 8:14, 8:32] = 2
    labels[18:34, 8:34, 8:32] = 7
    palpate.save(tmp_path / "grey.nrrd", palpate.Volume.from_numpy(grey, spacing=(1, 1, 1)))
    header = (
        "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 40 40 40\n"
        "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\nendian: little\n"
        "Segment0_ID:=S1\nSegment0_Name:=left kidney\nSegment0_Color:=0.2 0.9 0.1\nSegment0_LabelValue:=2\n"
        "Segment1_ID:=S2\nSegment1_Name:=liver\nSegment1_Color:=0.8 0.1 0.1\nSegment1_LabelValue:=7\n"
        "Segment2_ID:=S3\nSegment2_Name:=nowhere\nSegment2_LabelValue:=9\n\n"
    )
    with open(tmp_path / "labels.seg.nrrd", "wb") as out:
        out.write(header.encode() + labels.tobytes(order="F"))
    return tmp_path


# -- compare, and what is measured ---------------------------------------------------------------------------


def test_a_png_is_compared_with_an_exr_of_the_same_picture(tmp_path):
    for mode in (["--mode", "alpha"], ["--mode", "mip", "--background", "transparent"], ["--iso", "300"]):
        for name in ("a.png", "a.exr"):
            assert run("render", BALL, *mode, "--size", "64,48", "-o", tmp_path / name).returncode == 0
        for pair in (("a.png", "a.exr"), ("a.exr", "a.png")):
            same = run("compare", *(tmp_path / name for name in pair))
            assert same.returncode == 0, same.stderr
            assert json.loads(same.stdout)["max"] == 0.0
            assert "compared as a PNG of it would be" in same.stderr
    assert run("render", BALL, "--iso", "300", "--size", "64,48", "--view", "left", "-o", tmp_path / "b.exr").returncode == 0
    assert run("compare", tmp_path / "a.png", tmp_path / "b.exr").returncode == 1


def test_the_difference_picture_is_the_difference(tmp_path):
    run("render", BALL, "--iso", "300", "--size", "64,48", "-o", tmp_path / "a.png")
    run("render", BALL, "--iso", "300", "--size", "64,48", "--fill", "0.7", "-o", tmp_path / "b.png")
    differing = run("compare", tmp_path / "a.png", tmp_path / "b.png", "--difference", tmp_path / "d.png", "--gain", 2)
    assert differing.returncode == 1  # and the picture is there all the same
    a, b, d = (read_png(tmp_path / name).astype(int) for name in ("a.png", "b.png", "d.png"))
    assert np.abs(a - b).max() > 50
    assert np.array_equal(d, np.minimum(2 * np.abs(a - b), 255))
    assert run("compare", tmp_path / "a.png", tmp_path / "b.png", "--difference", tmp_path / "d.txt").returncode == 1
    assert not (tmp_path / "d.txt").exists()


def test_one_frame_has_no_word_about_clocks_and_help_names_what_is_shared(tmp_path):
    one = run("render", BALL, "--size", "64,48", "--stats", tmp_path / "s.json", "-o", tmp_path / "a.png")
    assert one.returncode == 0 and "clock" not in one.stderr
    help_ = run("render", "--help").stdout
    assert "PALPATE_DEVICE" in help_ and "--profile FILE" in help_


def test_the_device_of_the_environment_is_taken(tmp_path):
    nothing = run("render", BALL, "-o", tmp_path / "a.png", env={**os.environ, "PALPATE_DEVICE": "no such device"})
    assert nothing.returncode == 1 and "no such device" in nothing.stderr


# -- figures -------------------------------------------------------------------------------------------------


def test_dots_an_inch_are_in_the_png_and_change_no_pixel(tmp_path):
    run("render", BALL, "--size", "64,48", "-o", tmp_path / "a.png")
    run("render", BALL, "--size", "64,48", "--dpi", 300, "-o", tmp_path / "b.png")
    assert "pHYs" not in chunks(tmp_path / "a.png")
    # 300 / 25.4 mm is 11811.02 a metre; PNG holds whole numbers.
    assert struct.unpack(">IIB", chunks(tmp_path / "b.png")["pHYs"]) == (11811, 11811, 1)
    assert chunks(tmp_path / "a.png")["IDAT"] == chunks(tmp_path / "b.png")["IDAT"]
    assert "--dpi (of .png alone)" in run("render", BALL, "--dpi", 300, "-o", tmp_path / "c.exr").stderr


def test_a_legend_has_the_colours_of_the_labels_in_the_picture(labelled):
    def draw(name, *more):
        made = run("render", labelled / "grey.nrrd", "--labels", labelled / "labels.seg.nrrd", "--size", "300,240",
                   *more, "-o", labelled / name)  # fmt: skip
        assert made.returncode == 0, made.stderr
        return read_png(labelled / name).astype(int)

    def has(picture, color):
        low = picture[150:, :150]
        return (np.abs(low - np.round(255 * np.array(color))).max(-1) == 0).sum() > 40

    kidney, liver = (0.2, 0.9, 0.1), (0.8, 0.1, 0.1)
    legend = draw("legend.png", "--slice", "axial:20", "--annotate", "legend")
    assert has(legend, kidney) and has(legend, liver)
    # Only what the slice meets: sagittal at 26 mm cuts label 7 alone.
    legend = draw("one.png", "--slice", "sagittal:26", "--annotate", "legend")
    assert has(legend, liver) and not has(legend, kidney)
    assert not has(draw("hidden.png", "--slice", "axial:20", "--annotate", "legend", "--only-label", "liver"), kidney)
    plain = run("render", BALL, "--annotate", "legend", "--size", "64,64", "-o", labelled / "x.png")
    assert "--annotate legend: without effect" in plain.stderr


def test_names_come_from_tables_of_other_programs(labelled):
    (labelled / "snap.label").write_text('# ITK-SNAP\n 0 0 0 0 0 0 0 "Clear Label"\n 7 255 128 0 1 1 1 "the liver"\n')
    (labelled / "slicer.ctbl").write_text("# Slicer\n7 liver 255 128 0 255\n2 kidney 1 2 3 255\n")
    (labelled / "names.txt").write_text("2 kidney 2001\r\n7 liver 2002\r\n")
    slice_ = ["--labels", labelled / "labels.seg.nrrd", "--slice", "axial:20", "--size", "64,64"]
    for table, name in (("snap.label", "the liver"), ("slicer.ctbl", "liver"), ("names.txt", "liver")):
        by_name = run("render", labelled / "grey.nrrd", *slice_, "--label-names", labelled / table,
                      "--only-label", name, "-o", labelled / "a.png")  # fmt: skip
        assert by_name.returncode == 0, by_name.stderr
    (labelled / "bad.txt").write_text("2 kidney\nseven liver\n")
    bad = run("render", labelled / "grey.nrrd", *slice_, "--label-names", labelled / "bad.txt", "-o", labelled / "b.png")
    assert bad.returncode == 1 and "bad.txt:2: expected a label's number and name" in bad.stderr


def test_statistics_of_labels_have_their_names(labelled):
    def measure(*more):
        return run("measure", labelled / "grey.nrrd", *more)

    labels = ("--labels", labelled / "labels.seg.nrrd")
    own = measure(*labels)
    assert own.returncode == 0 and "label 7 liver  " in own.stdout and "label 2 left kidney  " in own.stdout
    (labelled / "snap.label").write_text('7 255 128 0 1 1 1 "the liver"\n')
    of_table = measure(*labels, "--label-names", labelled / "snap.label", "--json", "-")
    assert of_table.returncode == 0, of_table.stderr
    names = {label["label"]: label.get("name") for label in json.loads(of_table.stdout)["labels"]}
    assert names[7] == "the liver" and names[2] in (None, "")
    (labelled / "bad.txt").write_text("liver 7\n")
    bad = measure(*labels, "--label-names", labelled / "bad.txt")
    assert bad.returncode == 1 and "bad.txt:1: expected a label's number and name" in bad.stderr
    alone = measure("--label-names", labelled / "snap.label", "--ruler", "0,0,0,3,4,0")
    assert alone.returncode == 0 and "--label-names: without effect" in alone.stderr


def test_one_label_by_name_or_number(labelled):
    def draw(name, *more):
        made = run("render", labelled / "grey.nrrd", "--labels", labelled / "labels.seg.nrrd", "--slice", "axial:20",
                   "--size", "80,80", *more, "-o", labelled / name)  # fmt: skip
        assert made.returncode == 0, made.stderr
        return read_png(labelled / name)

    everything, named = draw("all.png"), draw("named.png", "--only-label", "liver")
    assert np.array_equal(named, draw("number.png", "--only-label", "7"))
    assert np.array_equal(everything, draw("both.png", "--only-label", "7", "--only-label", "left kidney"))
    # As if the map had no other label.
    labels = palpate.load(labelled / "labels.seg.nrrd", labels=True)
    alone = np.where(labels.to_numpy() == 7, 7, 0).astype(np.uint8)
    palpate.save(labelled / "alone.nrrd", palpate.Volume.from_numpy(alone, labels.affine))
    (labelled / "t.txt").write_text("7 liver 204 26 26\n")
    made = run("render", labelled / "grey.nrrd", "--labels", labelled / "alone.nrrd", "--label-names",
               labelled / "t.txt", "--slice", "axial:20", "--size", "80,80", "-o", labelled / "c.png")  # fmt: skip
    assert made.returncode == 0
    # 204 / 255 and 26 / 255 beside 0.8 and 0.1: at most a level after blending.
    assert np.abs(named.astype(int) - read_png(labelled / "c.png").astype(int)).max() <= 1
    for wrong in ("spleen", "9", "nowhere", "2.5"):
        refused = run("render", labelled / "grey.nrrd", "--labels", labelled / "labels.seg.nrrd", "--only-label", wrong,
                      "-o", labelled / "x.png")  # fmt: skip
        assert refused.returncode == 1 and "--only-label" in refused.stderr
    assert "left kidney, liver" in run("render", labelled / "grey.nrrd", "--labels", labelled / "labels.seg.nrrd",
                                       "--only-label", "spleen", "-o", labelled / "x.png").stderr  # fmt: skip


def test_a_surface_of_labels_by_name_or_number(labelled):
    def surface(which, *more):
        made = run("surface", labelled / "labels.seg.nrrd", f"--labels={which}", *more, "-o", labelled / "s.ply")
        assert made.returncode == 0, made.stderr
        return (labelled / "s.ply").read_bytes()

    assert surface("liver") == surface("7") != surface("left kidney")
    assert surface("7,left kidney") == surface("true")
    (labelled / "t.txt").write_text("7 the_liver 204 26 26\n")
    assert surface("the_liver", "--label-names", labelled / "t.txt") == surface("7")
    wrong = run("surface", labelled / "labels.seg.nrrd", "--labels=spleen", "-o", labelled / "n.ply")
    assert wrong.returncode == 1 and "expected a number or one of left kidney, liver, nowhere, found 'spleen'" in wrong.stderr
    assert not (labelled / "n.ply").exists()


def test_windows_by_name_and_presets_in_any_case(tmp_path):
    ct = tmp_path / "ct.pbv"
    palpate.save(ct, palpate.Volume.from_numpy(palpate.load(BALL).to_numpy(), spacing=(1, 1, 1), modality="CT"))
    # Level and width of brain are 40 and 80.
    for words, name in ((["--window-preset", "brain"], "a.png"), (["--window-level", "40,80"], "b.png")):
        assert run("render", ct, "--slice", "axial", "--size", "64,48", *words, "-o", tmp_path / name).returncode == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    for words, name in ((["--tf", "CT-Bone"], "c.png"), (["--tf", "ct-bone"], "d.png")):
        assert run("render", ct, "--size", "64,48", *words, "-o", tmp_path / name).returncode == 0
    assert (tmp_path / "c.png").read_bytes() == (tmp_path / "d.png").read_bytes()
    mr = palpate.Volume.from_numpy(palpate.load(BALL).to_numpy(), spacing=(1, 1, 1), modality="MR")
    with pytest.raises(palpate.Error, match="expected a CT, found modality MR"):
        palpate.render(mr, slice="axial", window_preset="lung")
    assert run("render", BALL, "--slice", "axial", "--window-preset", "brian", "-o", tmp_path / "e.png").returncode == 2


# -- sequences, scenes, jobs ---------------------------------------------------------------------------------


def test_pictures_of_a_turntable_are_numbered_as_other_programs_do(tmp_path):
    made = run("render", BALL, "--size", "32,32", "--turntable", 3, "-o", tmp_path / "tt_%03d.png")
    assert made.returncode == 0, made.stderr
    assert sorted(p.name for p in tmp_path.glob("tt*")) == ["tt_000.png", "tt_001.png", "tt_002.png"]
    for name in ("n_%03d.png", "n_###.png"):
        refused = run("render", BALL, "--size", "32,32", "--frames", 3, "-o", tmp_path / name)
        assert refused.returncode == 1 and "numbered pictures need --turntable" in refused.stderr
        assert not list(tmp_path.glob("n_*"))


def test_a_scene_of_one_patient_serves_another(tmp_path):
    first = palpate.load("synthetic:phantom?size=32")
    other = palpate.Volume.from_numpy(np.roll(first.to_numpy(), 5, axis=0), first.affine)
    palpate.save(tmp_path / "first.nrrd", first)
    palpate.save(tmp_path / "other.nrrd", other)
    options = ["--iso", "300", "--size", "64,48", "--view", "left"]
    assert run("render", tmp_path / "first.nrrd", *options, "--write-scene", tmp_path / "s.json",
               "-o", tmp_path / "a.png").returncode == 0  # fmt: skip
    assert run("render", tmp_path / "s.json", "--volume", tmp_path / "other.nrrd", "-o", tmp_path / "b.png").returncode == 0
    assert run("render", tmp_path / "other.nrrd", *options, "-o", tmp_path / "c.png").returncode == 0
    assert (tmp_path / "b.png").read_bytes() == (tmp_path / "c.png").read_bytes()
    assert (tmp_path / "b.png").read_bytes() != (tmp_path / "a.png").read_bytes()
    alone = run("render", tmp_path / "first.nrrd", "--volume", tmp_path / "other.nrrd", "-o", tmp_path / "d.png")
    assert alone.returncode == 1 and "expected a scene file" in alone.stderr


def test_a_batch_draws_what_single_commands_draw(labelled):
    jobs = [
        {"input": "grey.nrrd", "output": "1.png", "iso": 50, "size": [64, 48]},
        {"input": "grey.nrrd", "output": "2.png", "slice": ["axial:20", "coronal"], "size": [64, 48], "annotate": ["letters"]},
        {"input": "grey.nrrd", "output": "3.exr", "labels": "labels.seg.nrrd", "slice": "axial:20", "size": [64, 48]},
        {"input": BALL, "output": "4.png", "mode": "alpha", "no-shade": True, "size": [64, 48],
         "tf": {"colors": [[0, 1, 0, 0], [900, 1, 1, 1]], "opacities": [[0, 0], [900, 0.5]]}},
        {"input": "grey.nrrd", "output": "5.png", "iso": 50, "size": [64, 48], "camera": [10, -200, 20, 20, 20, 20]},
    ]  # fmt: skip
    (labelled / "jobs.jsonl").write_text("\n".join(map(json.dumps, jobs)) + "\n\n")
    made = run("batch", "jobs.jsonl", cwd=labelled)
    assert made.returncode == 0, made.stderr
    singles = [
        ["grey.nrrd", "--iso", "50", "-o", "s1.png"],
        ["grey.nrrd", "--slice", "axial:20", "--slice", "coronal", "--annotate", "letters", "-o", "s2.png"],
        ["grey.nrrd", "--labels", "labels.seg.nrrd", "--slice", "axial:20", "-o", "s3.exr"],
        [BALL, "--mode", "alpha", "--no-shade", "--tf", json.dumps(jobs[3]["tf"]), "-o", "s4.png"],
        ["grey.nrrd", "--iso", "50", "--camera=10,-200,20,20,20,20", "-o", "s5.png"],
    ]
    for job, words in zip(jobs, singles):
        assert run("render", *words, "--size", "64,48", cwd=labelled).returncode == 0
        assert (labelled / job["output"]).read_bytes() == (labelled / words[-1]).read_bytes(), job


def test_a_batch_equals_single_commands_to_the_bit_in_all_modes(labelled):
    """Also shaded, where stored gradients would differ by a level."""
    ways = [
        {"mode": "alpha"},
        {"mode": "alpha", "tf": "mr", "light": [30, 40], "background": "white"},
        {"mode": "alpha", "integrator": "preintegrated", "step": 0.7},
        {"mode": "mip", "integrator": "exact", "view": "left", "fill": 0.7},
        {"iso": [20, 60], "ambient-occlusion": 4},
        {"slice": ["axial", "sagittal:12"], "slab": 5, "slab-mode": "maximum", "interpolation": "cubic"},
        {"surface": ["iso=50"], "surface-opacity": [0.5], "labels": "labels.seg.nrrd"},
        {"labels": "labels.seg.nrrd", "slice": "axial:20", "annotate": ["legend", "note", "scale-bar"]},
        {"mode": "alpha", "stereo": "anaglyph"},
        {"mode": "alpha", "error": 0.02},
    ]
    names = [f"{i}.{'png' if 'annotate' in way else 'exr'}" for i, way in enumerate(ways)]
    jobs = [{"input": "grey.nrrd", "output": f"b{name}", "size": [32, 24], **way} for name, way in zip(names, ways)]
    (labelled / "jobs.jsonl").write_text("\n".join(map(json.dumps, jobs)))
    made = run("batch", "jobs.jsonl", cwd=labelled)
    assert made.returncode == 0, made.stderr
    for name, job in zip(names, jobs):
        words = []
        for option, value in job.items():
            if option not in ("input", "output"):
                texts = isinstance(value, list) and isinstance(value[0], str) and option != "annotate"
                listed = value if texts else [",".join(map(str, value)) if isinstance(value, list) else value]
                words += [f"--{option}={one}" for one in listed]
        alone = run("render", "grey.nrrd", *words, "-o", f"s{name}", cwd=labelled)
        assert alone.returncode == 0, alone.stderr
        assert (labelled / f"b{name}").read_bytes() == (labelled / f"s{name}").read_bytes(), job
    (labelled / "jobs.jsonl").write_text(json.dumps({"input": "grey.nrrd", "output": "stored.png", "size": [40, 32]}))
    assert run("batch", "jobs.jsonl", "--gradients", "stored", cwd=labelled).returncode == 0
    assert "differ by up to 1e-3" in " ".join(run("batch", "--help").stdout.split())


def test_a_batch_says_which_line_is_wrong(tmp_path):
    def batch(text, *more):
        (tmp_path / "jobs.jsonl").write_text(text)
        return run("batch", "jobs.jsonl", *more, cwd=tmp_path)

    good = json.dumps({"input": BALL, "output": "a.png", "size": [16, 16]})
    for line, words in (
        ('{"input": "x.nrrd"}', "expected an object with the texts"),
        ("[1]", "expected an object with the texts"),
        ('{"input": "x", "output": "a.gif"}', ".png or .exr"),
        ('{"input": "x", "output": "b.png", "colour": 3}', "--colour"),
        ('{"input": "x", "output": "b.png", "device": "3"}', "one device draws all"),
        ("{", "jobs.jsonl:2"),
    ):
        refused = batch(good + "\n" + line + "\n")
        assert refused.returncode == 1 and "jobs.jsonl:2" in refused.stderr and words in refused.stderr, refused.stderr
        assert not (tmp_path / "a.png").exists()  # nothing is begun
    twice = batch(good + "\n" + good + "\n")
    assert twice.returncode == 1 and not (tmp_path / "a.png").exists()
    absent = json.dumps({"input": "absent.nrrd", "output": "b.png"})
    last = json.dumps({"input": BALL, "output": "c.png", "size": [16, 16]})
    stopped = batch("\n".join([good, absent, last]))
    assert stopped.returncode == 1 and (tmp_path / "a.png").exists() and not (tmp_path / "c.png").exists()
    went_on = batch("\n".join([good, absent, last]), "--keep-going")
    assert went_on.returncode == 1 and (tmp_path / "c.png").exists() and "1 of 3 jobs failed" in went_on.stderr


# -- what is seen by default ---------------------------------------------------------------------------------


def test_what_a_bright_background_surrounds_is_seen_in_slices_and_rays(tmp_path):
    """Of values alike 3000 outside, 600 in a ball, and 300 in its core, with noise and without."""
    where = np.stack(np.meshgrid(*[np.arange(32)] * 3, indexing="ij"), -1) - np.array([17, 14, 16])
    radius = np.linalg.norm(where, axis=-1)
    for seed, sd in ((1, 0), (2, 30)):
        values = np.where(radius < 4, 300, np.where(radius < 9, 600, 3000))
        values = values + sd * np.random.default_rng(seed).standard_normal(values.shape)
        volume = palpate.Volume.from_numpy(np.round(values).astype(np.int16), spacing=(1, 1, 1))
        palpate.save(tmp_path / "v.nrrd", volume)
        for mode in ([], ["--mode", "mip"], ["--slice", "axial"]):
            made = run("render", tmp_path / "v.nrrd", *mode, "--size", "48,48", "-o", tmp_path / "p.png")
            assert made.returncode == 0, made.stderr
            assert ("is brighter than what lies in it" in made.stderr) == (mode[:1] != ["--slice"])
            grey = read_png(tmp_path / "p.png").mean(axis=2)
            assert abs(grey[22:26, 22:26].mean() - grey[22:26, 2:8].mean()) > 32, (mode, sd)
        bright = run("render", tmp_path / "v.nrrd", "--mode", "mip", "--window", "0,3000", "--size", "48,48", "-o", tmp_path / "p.png")
        assert "brighter" not in bright.stderr
        assert read_png(tmp_path / "p.png")[24, 24].min() > 240  # the largest values, which hide the ball


def test_a_line_of_samples_is_drawn_in_all_modes(tmp_path):
    for shape in ((1, 1, 30), (30, 1, 1), (1, 9, 12)):
        along = int(np.argmax(shape))
        index = np.indices(shape)[along]
        values = np.where(index < shape[along] // 2, 900, 100).astype(np.int16)
        palpate.save(tmp_path / "thin.nrrd", palpate.Volume.from_numpy(values, spacing=(2, 2, 2)))
        for mode in ([], ["--mode", "mip"], ["--iso", "500"], ["--slice", "coronal"], ["--surface", "iso=500"]):
            made = run("render", tmp_path / "thin.nrrd", *mode, "--size", "64,64", "-o", tmp_path / "p.png")
            assert made.returncode == 0, made.stderr
            picture = read_png(tmp_path / "p.png")
            assert picture.max() > 60, (shape, mode, made.stderr)
            if not mode:  # the slice's own plane: bright and dark halves of one size
                bright, dark = (picture[..., 0] > 200).sum(), ((picture[..., 0] > 0) & (picture[..., 0] < 60)).sum()
                assert bright > 0 and "so it is drawn as a slice" in made.stderr, (shape, bright, dark)


def test_a_legend_lies_beside_the_slice(labelled):
    """In a picture that is wider than high, and in a square one, where the slice becomes smaller."""
    for size in ("300,200", "200,200"):
        run("render", "grey.nrrd", "--labels", "labels.seg.nrrd", "--slice", "axial:20", "--annotate", "legend", "--window",
            "-100,300", "--background", "0.2,0.5,0.9", "--size", size, "-o", "legend.png", cwd=labelled)  # fmt: skip
        picture = read_png(labelled / "legend.png").astype(int)
        background = np.array([51, 128, 230])
        # The slice is grey or the colour of a label: at the height of its middle, all that differs from the background.
        middle = np.abs(picture[picture.shape[0] // 2] - background).max(axis=1) > 8
        begins = int(np.argmax(middle))
        left = np.abs(picture[:, :begins] - background).max(axis=2) > 8
        assert left.any(), "the legend is there"
        # A free column between the two.
        assert not left[:, begins - 2].any() and (~left.any(axis=0)).sum() > 2
        right = np.abs(picture[:, begins:] - background).max(axis=2) > 8
        columns = np.flatnonzero(right.any(axis=0))
        assert columns[-1] < picture.shape[1] - begins  # and none of the slice is cut


def test_help_says_what_ambient_occlusion_darkens():
    assert "It also darkens open bone" in " ".join(run("render", "--help").stdout.split())


# -- measures and surfaces -----------------------------------------------------------------------------------


def test_a_label_one_sample_thick_has_a_note_and_no_nan(tmp_path):
    labels = np.zeros((30, 20, 16), np.uint8)
    labels[5:25, 10, 8] = 1
    labels[3, 3, 3] = 2
    labels[6:14, 2:8, 2:7] = 3
    palpate.save(tmp_path / "l.nrrd", palpate.Volume.from_numpy(labels, spacing=(1, 1, 1)))
    palpate.save(tmp_path / "v.nrrd", palpate.Volume.from_numpy(100 * (labels > 0).astype(np.int16), spacing=(1, 1, 1)))
    said = run("measure", tmp_path / "v.nrrd", "--labels", tmp_path / "l.nrrd").stdout
    assert "nan" not in said
    curve, sample, box = said.strip().split("\n")
    assert curve.endswith("the faces of the samples have 82 mm2)") and "one sample thick" in curve
    assert sample.startswith("label 2  0.001 ml, 1 sample  100, 1 sample, ") and "have 6 mm2)" in sample
    assert "thick" not in box
    listed = json.loads(run("measure", tmp_path / "v.nrrd", "--labels", tmp_path / "l.nrrd", "--json", "-").stdout)["labels"]
    assert ["note" in one for one in listed] == [True, True, False]


def test_a_surface_says_how_many_edges_are_open(tmp_path):
    x = np.arange(20) - 9.5
    values = np.broadcast_to(100 - 10 * np.hypot(*np.meshgrid(x, x)), (16, 20, 20)).astype(np.float32)
    palpate.save(tmp_path / "rod.nrrd", palpate.Volume.from_numpy(values, spacing=(1, 1, 1)))
    made = run("surface", tmp_path / "rod.nrrd", "--iso", "50", "-o", tmp_path / "rod.ply", "--report", "-")
    report = json.loads(made.stdout)
    assert report["open_edges"] > 0
    assert f"{report['open_edges']} open edges are left" in made.stderr and "--closed closes it" in made.stderr
    closed = run("surface", tmp_path / "rod.nrrd", "--iso", "50", "--closed", "-o", tmp_path / "closed.ply")
    assert "open edges" not in closed.stderr
    ball = run("surface", BALL, "--iso", "300", "-o", tmp_path / "ball.ply")  # ends nowhere
    assert ball.returncode == 0 and "open edges" not in ball.stderr


# -- convert, edit -------------------------------------------------------------------------------------------


def test_convert_crops_resamples_and_reorients(tmp_path):
    generator = np.random.default_rng(7)
    array = generator.integers(-500, 500, (37, 34, 5)).astype(np.int16)
    affine = np.array([[0, 0.1, -2, 3], [0.5, 0, 0, -4], [0, 0.7, 0.2, 9], [0, 0, 0, 1.0]])
    palpate.save(tmp_path / "v.nrrd", palpate.Volume.from_numpy(array, affine))

    def convert(name, *words):
        made = run("convert", tmp_path / "v.nrrd", tmp_path / name, *words)
        assert made.returncode == 0, made.stderr
        return palpate.load(tmp_path / name)

    cropped = convert("crop.nrrd", "--crop", "3,4,1,30,20,3")
    assert np.array_equal(cropped.to_numpy(), array[3:31, 4:21, 1:4])
    # Every sample stays at its place in the patient.
    for letters in ("LPS", "RAS", "SAR", "IPL"):
        turned = convert("turned.nrrd", "--reorient", letters)
        out = turned.to_numpy()
        assert sorted(out.shape) == sorted(array.shape)
        directions = turned.affine[:3, :3]
        for axis, letter in enumerate(letters):
            world, sign = {"L": (0, 1), "R": (0, -1), "P": (1, 1), "A": (1, -1), "S": (2, 1), "I": (2, -1)}[letter]
            assert np.abs(directions[:, axis]).argmax() == world and directions[world, axis] * sign > 0
        for index in generator.integers(0, array.shape, (200, 3)):
            at = np.linalg.solve(turned.affine, affine @ [*index, 1])[:3]
            assert np.abs(at - at.round()).max() < 1e-6  # of a NRRD's decimals
            assert out[tuple(at.round().astype(int))] == array[tuple(index)]
    # The box from half a sample before the first to half a sample behind the last stays covered.
    finer = convert("finer.nrrd", "--spacing", "0.25,0.35,1")
    assert np.allclose(finer.spacing, (0.25, 0.35, 1), atol=1e-6)
    was = np.linalg.norm(affine[:3, :3], axis=0) * array.shape
    assert all(0 <= n * mm - box < mm + 1e-6 for n, mm, box in zip(finer.shape, finer.spacing, was))
    palpate.save(tmp_path / "v.nrrd", palpate.Volume.from_numpy((array > 0).astype(np.uint8) * 7, affine))
    assert set(np.unique(convert("labels.nrrd", "--labels", "--spacing", "0.6").to_numpy())) <= {0, 7}
    for words in (["--reorient", "LPX"], ["--reorient", "LRS"], ["--crop", "1,2"], ["--spacing", "zero"]):
        refused = run("convert", tmp_path / "v.nrrd", tmp_path / "x.nrrd", *words)
        assert refused.returncode in (1, 2) and words[0] in refused.stderr
        assert not (tmp_path / "x.nrrd").exists()
    for name in ("ras.pbv", "ras.nrrd"):
        assert run("convert", tmp_path / "v.nrrd", tmp_path / name, "--reorient", "RAS").returncode == 0
    assert np.array_equal(palpate.load(tmp_path / "ras.pbv").to_numpy(), palpate.load(tmp_path / "ras.nrrd").to_numpy())


def test_edit_reports_the_removed_material(tmp_path):
    solid = np.full((40, 40, 40), 1000, np.int16)
    solid[:, :, :20] = -1000
    palpate.save(tmp_path / "v.nrrd", palpate.Volume.from_numpy(solid, spacing=(0.5, 0.5, 2)))
    stroke = {"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 6}, "operation": {"kind": "cut"}}
    (tmp_path / "s.jsonl").write_text(json.dumps(stroke) + '\n{"p_mm": [10, 10, 40]}\n')
    done = run("edit", tmp_path / "v.nrrd", tmp_path / "s.jsonl", "-o", tmp_path / "o.nrrd", "--report", "-", "--iso", 300)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    after = palpate.load(tmp_path / "o.nrrd").to_numpy()
    removed = ((solid >= 300) & (after < 300)).sum() * 0.5  # mm^3 a sample
    assert removed > 100 and report["removed_mm3"] == removed and report["added_mm3"] == 0
    assert report["steps"][0]["removed_mm3"] == removed and report["solid"] == 300
    # Half a ball lies in the solid half; its surface is found to one sample, of 2 mm at most.
    half, surface = 2 / 3 * np.pi * 6**3, 2 * np.pi * 6**2
    assert abs(removed - half) < 2 * surface and removed > half / 2
    undone = run("edit", tmp_path / "v.nrrd", tmp_path / "s.jsonl", "--undo", 1, "-o", tmp_path / "o.nrrd", "--report", "-")
    assert json.loads(undone.stdout)["removed_mm3"] == 0
