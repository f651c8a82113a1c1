"""Meshes, documents, filters, segmentation, measures and comparisons, against numpy and closed forms."""

import numpy as np
import pytest

import palpate


def test_a_surface_is_the_balls(ball):
    mesh = palpate.surface(ball, 100)
    radii = np.linalg.norm(mesh.vertices, axis=1)
    assert abs(radii - 10).max() < 0.06  # linear on edges of 2 mm: h^2 / (8 r) = 0.05
    assert mesh.triangles.max() < len(mesh.vertices)
    found = mesh.topology()
    assert found["euler_number"] == 2 and found["open_edges"] == 0
    # numpy's own sums over the same triangles
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(found["volume_mm3"], rel=1e-5)
    assert found["volume_mm3"] > 0
    outward = np.einsum("ij,ij->i", mesh.normals, mesh.vertices / radii[:, None])
    assert outward.min() > 0.9


def test_a_mirrored_grid_has_outward_triangles(ball):
    affine = np.diag([-1.0, 1, 1, 1]) @ ball.affine
    mesh = palpate.surface(palpate.Volume.from_numpy(ball.to_numpy(), affine), 100)
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0


def test_meshes_of_arrays_and_files(ball, tmp_path):
    mesh = palpate.surface(ball, 100)
    again = palpate.Mesh(mesh.vertices, mesh.triangles)
    assert palpate.compare(mesh, again)["hausdorff_most_mm"] < 0.01
    mesh.save(tmp_path / "m.ply")
    assert np.allclose(palpate.load_mesh(tmp_path / "m.ply").vertices, mesh.vertices, atol=1e-4)
    fewer = mesh.decimate(error_mm=0.2)
    assert len(fewer.triangles) < len(mesh.triangles) / 2
    assert palpate.compare(mesh, fewer)["hausdorff_mm"] <= 0.2
    assert len(mesh.smooth("taubin", 5).triangles) == len(mesh.triangles)


def test_far_meshes_keep_their_places():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.125]]) + 1e7
    assert np.array_equal(palpate.Mesh(vertices, [[0, 1, 2]]).vertices, vertices)


def test_labels_become_closed_meshes_of_their_voxels():
    labels = np.zeros((20, 20, 20), np.uint8)
    labels[4:10, 4:16, 4:16] = 1
    labels[10:16, 4:16, 4:16] = 7
    volume = palpate.Volume.from_numpy(labels, spacing=(1, 1, 2))
    meshes = palpate.labels_to_meshes(volume, passes=0)
    assert sorted(meshes) == [1, 7]
    for label, mesh in meshes.items():
        found = mesh.topology()
        assert found["open_edges"] == 0
        assert found["volume_mm3"] == pytest.approx((labels == label).sum() * 2, rel=1e-6)
    assert list(palpate.labels_to_meshes(volume, only=[7])) == [7]
    with pytest.raises(palpate.Error, match="label 3"):
        palpate.labels_to_meshes(volume, only=[3])


def test_a_document_cuts_undoes_and_recovers(tmp_path):
    before = palpate.Volume.from_numpy(np.full((40, 40, 40), 100, np.int16))
    journal = tmp_path / "cut.journal"
    document = palpate.Document(before, journal=journal)
    cut = dict(shape={"kind": "ball", "radius_mm": 5}, operation={"kind": "cut", "to_value": 0, "walls": "samples"})
    assert document.stroke(**cut, positions=[(10, 20, 20), (30, 20, 20)]) == ""
    after = document.volume.to_numpy()
    x, y, z = np.indices(after.shape)
    away = np.sqrt((x - np.clip(x, 10, 30)) ** 2 + (y - 20) ** 2 + (z - 20) ** 2)
    inside = after == 0
    assert inside[away < 4.9].all() and not inside[away > 5.1].any()
    assert document.undo_steps == 1 and document.redo_steps == 0 and len(document.history) == 1
    document.undo()
    assert np.array_equal(document.volume.to_numpy(), before.to_numpy())
    document.redo()
    assert np.array_equal(document.volume.to_numpy(), after)
    with pytest.raises(palpate.Error, match="redo"):
        document.redo()
    assert "nothing to change" in document.stroke(**cut, positions=[(20, 20, 20)])
    del document  # as a process that ends without a word
    again = palpate.Document(before, journal=journal, recover=True)
    assert np.array_equal(again.volume.to_numpy(), after)
    again.end_journal()
    assert not journal.exists()


def test_any_label_is_drawn_into_any_map(tmp_path):
    before = np.zeros((30, 20, 20), np.uint8)
    before[3:9] = 7
    random = np.random.default_rng(5)
    journal = tmp_path / "labels.journal"
    document = palpate.Document(before, labels=True, journal=journal)
    expected = [before]
    for label in [9, 300, 255, 65535, int(random.integers(256, 65535))]:
        place = random.integers(4, 16, 3)
        document.stroke({"kind": "ball", "radius_mm": 3}, {"kind": "draw", "label": label}, [place])
        drawn = expected[-1].astype(np.uint16 if label > 255 else expected[-1].dtype)
        near = sum((axis - p) ** 2 for axis, p in zip(np.indices(before.shape), place)) <= 9
        drawn[near] = label
        expected.append(drawn)
        found = document.volume.to_numpy()
        assert found.dtype == drawn.dtype and np.array_equal(found, drawn)
    for k in (3, 2, 1, 0):
        document.undo()
        found = document.volume.to_numpy()
        assert found.dtype == expected[k + 1].dtype and np.array_equal(found, expected[k + 1])
    for k in (2, 3, 4):
        document.redo()
        assert np.array_equal(document.volume.to_numpy(), expected[k])
    del document
    again = palpate.Document(before, labels=True, journal=journal, recover=True)
    assert np.array_equal(again.volume.to_numpy(), expected[4])
    palpate.save(tmp_path / "grown.nrrd", again.volume)
    assert np.array_equal(palpate.load(tmp_path / "grown.nrrd", labels=True).to_numpy(), expected[4])


def test_strokes_are_applied_all_or_none(tmp_path):
    document = palpate.Document(np.zeros((20, 20, 20), np.int16), journal=tmp_path / "j")
    cut = '{"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 3}, "operation": {"kind": "cut", "to_value": %s}}\n{"p_mm": [10, 10, 10]}\n'
    document.apply(cut % 5)
    size = (tmp_path / "j").stat().st_size
    with pytest.raises(palpate.Error, match="to_value"):
        document.apply(cut % 7 + cut % 1e9)
    assert document.volume.to_numpy().max() == 5 and document.undo_steps == 1 and document.redo_steps == 0
    assert (tmp_path / "j").stat().st_size == size
    document.apply(cut % 7 + cut % 8)
    assert document.volume.to_numpy().max() == 8 and document.undo_steps == 3


def test_a_size_beyond_memory_is_refused():
    volume = palpate.Volume.from_numpy(np.zeros((60, 60, 60), np.uint8))
    with pytest.raises(palpate.Error, match="of memory, and the limit is"):
        palpate.filter(volume, "resample", 0.001, "nearest")


def test_documents_of_several_volumes():
    grey = np.arange(27000, dtype=np.float32).reshape(30, 30, 30)
    document = palpate.Document({"grey": grey, "organs": np.zeros(grey.shape, np.uint8)}, labels=["organs"])
    assert document.names == ["grey", "organs"]
    document.stroke(
        {"kind": "ball", "radius_mm": 6},
        {"kind": "draw", "label": 3, "only_values": [0, 13499]},
        [(15, 15, 15)],
        on="organs",
        guide="grey",
    )
    drawn = document["organs"].to_numpy() == 3
    assert drawn.any() and not drawn[grey > 13499].any()
    document.stroke(
        {"kind": "ball", "radius_mm": 6},
        {"kind": "draw", "label": 5},
        [(15, 15, 15)],
        on="organs",
        mask={"inside": [3]},
    )
    assert np.array_equal(document["organs"].to_numpy() == 5, drawn)
    document.undo()
    document.stroke(
        {"kind": "ball", "radius_mm": 8},
        {"kind": "draw", "label": 5},
        [(15, 15, 15)],
        on="organs",
        mask={"over": [0]},
    )
    assert np.array_equal(document["organs"].to_numpy() == 3, drawn)
    assert (document["organs"].to_numpy() == 5).sum() > drawn.sum()
    with pytest.raises(palpate.Error, match="mask: the operation has inside of its own"):
        document.stroke(
            {"kind": "point"}, {"kind": "erase", "inside": [3]}, [(15, 15, 15)], on="organs", mask={"inside": [5]}
        )
    document.put("grey", grey * 2, title="twice")
    assert document["grey"].to_numpy().max() == 2 * 26999
    document.undo()
    assert document["grey"].to_numpy().max() == 26999
    with pytest.raises(palpate.Error, match="liver"):
        document["liver"]


def test_filters_by_their_table(ball):
    table = {f["name"]: f for f in palpate.filters()}
    assert {"gaussian", "median"} <= set(table)
    field = np.zeros((33, 33, 33), np.float32)
    field[16, 16, 16] = 1
    smooth = palpate.filter(field, "gaussian", 2.0).to_numpy()
    x = np.arange(33) - 16.0
    line = np.exp(-x * x / 8) / np.exp(-x * x / 8).sum()
    # A sampled Gaussian; the filter may integrate over samples: they differ by sigma^-2 / 24 = 1 % of the peak.
    assert smooth[:, 16, 16] == pytest.approx(line * line[16] ** 2, abs=0.02 * line[16] ** 3)
    assert np.array_equal(
        palpate.filter(ball, "expression", "a + b", others={"b": ball}).to_numpy(), 2 * ball.to_numpy()
    )
    for wrong in [("gaussian", -1), ("gaussian", "x"), ("blur", 1), ("gaussian", np.nan)]:
        with pytest.raises(palpate.Error, match=wrong[0]):
            palpate.filter(ball, *wrong)


def test_filters_of_labels_leave_locked_ones():
    mm = np.array([0.5, 1.0, 2.0])
    labels = np.zeros((20, 12, 8), np.uint8)
    labels[4:8, 4:6, 3:5] = 1
    labels[10:13, 4:6, 3:5] = 2
    affine = np.diag([*mm, 1.0])
    volume = palpate.Volume.from_numpy(labels, affine)
    grown = palpate.filter(volume, "margin", 1, 1, labels=True).to_numpy()
    places = np.stack(np.meshgrid(*[np.arange(n) for n in labels.shape], indexing="ij"), -1) * mm
    ones = places[labels == 1]
    near = np.array([np.min(np.linalg.norm(ones - p, axis=1)) <= 1 for p in places.reshape(-1, 3)])
    expected = np.where(near.reshape(labels.shape) & (labels == 0), 1, labels)
    assert np.array_equal(grown, expected)
    kept = palpate.filter(volume, "margin", 1, labels=True, locked=[2]).to_numpy()
    assert np.array_equal(kept == 2, labels == 2) and np.array_equal(kept, expected)
    assert (palpate.filter(volume, "hollow", 0.5, "outside", 2, labels=True).to_numpy() == 1).sum() == 16
    joined = palpate.filter(volume, "logic", "add", 1, 2, labels=True).to_numpy()
    assert np.array_equal(joined == 1, labels > 0)
    # A click on the value of label 2 takes the box of it; its contour in a layer the rectangle there.
    here = [11 * mm[0], 4 * mm[1], 3 * mm[2]]
    grey = palpate.Volume.from_numpy(50 * labels, affine)
    alike = palpate.filter(grey, "local-threshold", *here, times=0.1, near=0).to_numpy()
    assert np.array_equal(alike, labels == 2)
    at = [9.4 * mm[0], 4 * mm[1], 3 * mm[2]]
    within = palpate.filter(grey, "level-trace", *at).to_numpy()
    assert np.array_equal(within, (labels == 2) & (np.arange(8) == 3))
    # Along x, label 1 hides label 2.
    outline = [[0, 4.5, -9], [0, 9, -9], [0, 9, 9], [0, 4.5, 9]]
    cut = palpate.scissors(volume, outline, [1, 0, 0], all_labels=True, seen_first=True).to_numpy()
    y = np.arange(labels.shape[1])[:, None] * mm[1]
    assert np.array_equal(cut, np.where((labels == 1) & (y > 4.5), 0, labels))
    near = palpate.scissors(volume, outline, [1, 0, 0], label=2, depths_mm=[5, 5.5], locked=[1]).to_numpy()
    x = np.arange(labels.shape[0])[:, None, None] * mm[0]
    assert np.array_equal(near, np.where((labels == 2) & (y > 4.5) & (x >= 5) & (x <= 5.5), 0, labels))
    with pytest.raises(palpate.Error, match="3 corners|outline_mm"):
        palpate.scissors(volume, outline[:2], [1, 0, 0])
    for wrong in [dict(locked=[0]), dict(locked=[1])]:
        with pytest.raises(palpate.Error, match="locked"):
            palpate.filter(volume, "margin", 1, 1, labels=True, **wrong)
    with pytest.raises(palpate.Error, match="locked"):
        palpate.filter(volume, "gaussian", 1, locked=[1])


def test_segmentation_from_seeds(ball):
    names = [m["name"] for m in palpate.methods()]
    assert "region-growing" in names and "threshold" in names
    found = palpate.segment(ball, "threshold", low=120)
    assert np.array_equal(found.labels.to_numpy() > 0, ball.to_numpy() >= 120)
    grown = palpate.segment(ball, "region-growing", [(4, (0, 0, 0))], low=120)
    assert set(np.unique(grown.labels.to_numpy())) == {0, 4}
    for wrong in [dict(seeds=[(1, (999, 0, 0))]), dict(seeds=None), dict(seeds=[(1,)]), dict(seeds=[(1, (0, 0, 0))], magic=1)]:
        with pytest.raises(palpate.Error):
            palpate.segment(ball, "region-growing", **wrong)


def test_measures_are_those_of_numpy(ball):
    inside = ball.to_numpy() >= 100
    labels = palpate.Volume.from_numpy(inside.astype(np.uint8), ball.affine)
    out = palpate.measure(
        ball,
        [{"kind": "ruler", "points_mm": [[0, 0, 0], [3, 4, 0]]}, {"kind": "sphere", "points_mm": [[0, 0, 0], [5, 0, 0]]}],
        labels=labels,
        histogram=8,
    )
    assert out["measures"][0]["length_mm"] == 5
    organ = out["labels"][0]
    assert organ["count"] == inside.sum()
    assert organ["volume_mm3"] == pytest.approx(inside.sum() * 1.6)
    assert organ["values"]["mean"] == pytest.approx(ball.to_numpy()[inside].mean(), rel=1e-5)
    for wrong in [[{"kind": "ruler", "points_mm": [[0, 0, 0]]}], [{"kind": "cube"}], [3], [{"points_mm": np.nan}]]:
        with pytest.raises(palpate.Error):
            palpate.measure(ball, wrong)


def test_comparisons(ball):
    other = palpate.Volume.from_numpy(ball.to_numpy() + np.float32(0.5), ball.affine)
    assert palpate.compare(ball, other)["max"] == pytest.approx(0.5, abs=2e-5)  # an ulp of float at 188
    a = np.zeros((10, 10, 10), np.uint8)
    b = a.copy()
    a[2:6, 2:6, 2:6], b[2:6, 2:6, 2:7] = 1, 1
    score = palpate.compare(a, b, labels=True)
    assert score["labels"][0]["dice"] == pytest.approx(2 * 64 / (64 + 80))
    picture = palpate.render(ball, size=(32, 32))
    assert palpate.compare(picture, picture)["max"] == 0
    for first, second in [(ball, picture), (ball, np.zeros((2, 2, 2))), (picture, palpate.render(ball, size=(16, 16)))]:
        with pytest.raises(palpate.Error):
            palpate.compare(first, second)
    with pytest.raises(palpate.Error, match="bound"):
        palpate.compare(ball, other, bound=-1)


@pytest.mark.parametrize(
    "call",
    [
        lambda v: palpate.surface(v, np.nan),
        lambda v: palpate.surface(v, 1e9),
        lambda v: palpate.surface(v, 100, topology="round"),
        lambda v: palpate.labels_to_meshes(v),
        lambda v: palpate.Mesh([[0, 0, 0]], [[0, 1, 2]]),
        lambda v: palpate.Mesh([[0, 0, np.nan]], [[0, 0, 0]]),
        lambda v: palpate.Mesh([[0, 0]], [[0, 0, 0]]),
        lambda v: palpate.Mesh([[0, 0, 0]], [["a", 0, 0]]),
        lambda v: palpate.surface(v, 100).smooth("ironed"),
        lambda v: palpate.surface(v, 100).smooth("mean", -1),
        lambda v: palpate.surface(v, 100).decimate(),
        lambda v: palpate.surface(v, 100).decimate(error_mm=-1),
        lambda v: palpate.surface(v, 100).of_label(-1),
        lambda v: palpate.surface(v, 100).save("/no/such/m.ply"),
        lambda v: palpate.load_mesh("no.ply"),
        lambda v: palpate.Document(v).stroke({"kind": "spoon"}, {"kind": "cut"}, [(0, 0, 0)]),
        lambda v: palpate.Document(v).stroke({"kind": "ball", "radius_mm": 1}, {"kind": "draw"}, [(0, 0, 0)]),
        lambda v: palpate.Document(v).stroke({"kind": "ball", "radius_mm": 1}, {"kind": "cut"}, []),
        lambda v: palpate.Document(v).stroke({"kind": "ball", "radius_mm": 1}, {"kind": "cut"}, [(np.nan, 0, 0)]),
        lambda v: palpate.Document(v).apply("nonsense"),
        lambda v: palpate.Document(v).undo(),
        lambda v: palpate.Document({}),
        lambda v: palpate.Document({"a/b": v}),
        lambda v: palpate.segment(v, "magic"),
        lambda v: palpate.as_volume(3),
        lambda v: palpate.as_volume("a mesh.ply"),
    ],
)
def test_wrong_calls_are_one_sentence(ball, call):
    with pytest.raises(palpate.Error) as caught:
        call(ball)
    assert str(caught.value) and "\n" not in str(caught.value)
