"""Pictures: those of the command line, renderers, cameras, errors."""

import io

import numpy as np
import pytest

import palpate

SMALL = dict(size=(96, 80))


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(mode="mip"), ["--mode", "mip"]),
        (dict(mode="alpha", window=(20, 180), background="white"), "--mode alpha --window 20,180 --background white".split()),
        (dict(iso=[80, 120], view="left"), "--iso 80,120 --view left".split()),
        (dict(slice=["axial", "coronal:1.5"], annotate="letters,scale-bar"), "--slice axial --slice coronal:1.5 --annotate letters,scale-bar".split()),
        (dict(iso=100, background="transparent", stereo="anaglyph"), "--iso 100 --background transparent --stereo anaglyph".split()),
        (dict(mode="alpha", clip=[(0, 0, 0, 1, 0, 0), (0, 0, 0, 0, 1, 0)]), "--mode alpha --clip 0,0,0,1,0,0 --clip 0,0,0,0,1,0".split()),
        (dict(iso=100, error=0.02), "--iso 100 --error 0.02".split()),
        (dict(iso=100, light=(-50, 30), ambient_occlusion=8), "--iso 100 --light=-50,30 --ambient-occlusion 8".split()),
    ],
)
def test_files_are_those_of_the_command_line(ball, command, tmp_path, options, words):
    file = tmp_path / "ball.nrrd"
    palpate.save(file, ball)
    for name in ("theirs.png", "theirs.exr"):
        command("render", file, *words, "--size", "96,80", "-o", tmp_path / name)
    from_file = palpate.render(str(file), **options, **SMALL)
    in_memory = palpate.render(palpate.load(file), **options, **SMALL)
    for picture in (from_file, in_memory):
        picture.save(tmp_path / "ours.png")
        assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "theirs.png").read_bytes()
    assert picture._repr_png_() == (tmp_path / "theirs.png").read_bytes()
    from_file.save(tmp_path / "ours.exr")  # it names the volume: by a hash of the scene
    assert (tmp_path / "ours.exr").read_bytes() == (tmp_path / "theirs.exr").read_bytes()


def test_arrays_of_a_picture(ball):
    picture = palpate.render(ball, iso=100, values=True, camera=palpate.Camera((0, -100, 0), (0, 0, 0)), **SMALL)
    assert picture.to_numpy().shape == (80, 96, 3) and picture.to_numpy().dtype == np.float32
    eye = picture.eyes[0]
    assert eye.shape == (80, 96, 4) and np.array_equal(eye[..., :3], picture.to_numpy())
    bytes_ = picture.to_numpy(np.uint8)
    assert np.array_equal(bytes_, np.floor(255 * np.clip(picture.to_numpy(), 0, 1) + 0.5).astype(np.uint8))
    assert picture.value[40, 48] == 100
    # The ball's front is 10 mm from its centre, 90 from the eye; beside it nothing is met.
    assert picture.depth[40, 48] == pytest.approx(90, abs=0.2)
    assert np.isnan(picture.depth[0, 0]) and np.isnan(picture.value[0, 0])
    assert set(picture.metadata) >= {"palpate:device", "palpate:scene"}
    assert picture.passes and all(ms >= 0 for ms in picture.passes.values())


def test_labels_fused_overlay_and_meshes_in_memory(ball, command, tmp_path):
    labels = palpate.Volume.from_numpy((ball.to_numpy() > 100).astype(np.uint8), ball.affine)
    mesh = palpate.surface(ball, 120)
    for name, volume in (("v.nrrd", ball), ("l.nrrd", labels)):
        palpate.save(tmp_path / name, volume)
    mesh.save(tmp_path / "m.ply")
    words = ["--labels", "l.nrrd", "--overlay", "l.nrrd", "--fused", "v.nrrd", "--surface", "m.ply"]
    words = [str(tmp_path / w) if "." in w else w for w in words]
    command("render", tmp_path / "v.nrrd", *words, "--slice", "axial", "--size", "96,80", "-o", tmp_path / "theirs.png")
    picture = palpate.render(
        ball, labels=labels, overlay=labels, fused=ball, surface=mesh, slice="axial", **SMALL
    )
    assert picture._repr_png_() == (tmp_path / "theirs.png").read_bytes()
    mixed = palpate.render(tmp_path / "v.nrrd", labels=labels, overlay=tmp_path / "l.nrrd", fused=ball, surface=[tmp_path / "m.ply"], slice="axial", **SMALL)
    assert mixed._repr_png_() == picture._repr_png_()


def test_a_transfer_function_is_that_of_a_file(ball, command, tmp_path):
    import json

    function = palpate.TransferFunction([(50, 0, 0, 1), (150, 1, 0.5, 0)], [(80, 0), (160, 0.2)])
    (tmp_path / "tf.json").write_text(json.dumps(function.json()))
    palpate.save(tmp_path / "v.nrrd", ball)
    command("render", tmp_path / "v.nrrd", "--tf", tmp_path / "tf.json", "--size", "96,80", "-o", tmp_path / "t.png")
    assert palpate.render(ball, tf=function, **SMALL)._repr_png_() == (tmp_path / "t.png").read_bytes()
    assert "ct-bone" in palpate.presets()
    for name in palpate.presets():
        palpate.render(ball, tf=name, **SMALL)


def test_a_renderer_draws_what_changed(ball):
    with palpate.Renderer() as renderer:
        scene = palpate.Scene(ball, iso=100, **SMALL)
        first = renderer.render(scene).to_numpy()
        scene.orbit(40)
        turned = renderer.render(scene).to_numpy()
        assert not np.array_equal(first, turned)
        scene.camera = palpate.Camera((0, -90, 0), (0, 0, 0), view_angle=20)
        assert scene.camera.eye == (0, -90, 0) and scene.camera.view_angle == 20
        document = palpate.Document(ball)
        document.stroke({"kind": "ball", "radius_mm": 4}, {"kind": "cut"}, [(0, -10, 0)])
        whole = renderer.render(scene).to_numpy()
        scene.set_volume(document.volume)
        cut = renderer.render(scene).to_numpy()
        assert not np.array_equal(whole, cut)
        fresh = palpate.Scene(document.volume, iso=100, **SMALL)
        fresh.camera = scene.camera
        assert np.array_equal(renderer.render(fresh).to_numpy(), cut)
        assert renderer.device
    with pytest.raises(palpate.Error, match="closed"):
        renderer.render(scene)


def test_a_budget_of_time_draws_fewer_rays(ball):
    scene = palpate.Scene(ball, iso=100, frame_ms=0.01, size=(256, 256))
    with palpate.Renderer() as renderer:
        for _ in range(4):
            scene.orbit(3)
            picture = renderer.render(scene)
    assert picture.error_estimate > 0


def test_scenes_by_path_and_as_json(ball, tmp_path):
    import json

    scene = palpate.Scene(ball, mode="mip", **SMALL)
    text = scene.json()
    assert text["ray_cast"]["mode"] == "mip"
    palpate.save(tmp_path / "v.nrrd", ball)
    text["volume"] = "v.nrrd"
    (tmp_path / "scene.json").write_text(json.dumps(text))
    assert np.array_equal(palpate.render(tmp_path / "scene.json").to_numpy(), palpate.render(scene).to_numpy())


def test_png_bytes_are_a_png(ball):
    assert palpate.render(ball, **SMALL)._repr_png_().startswith(b"\x89PNG\r\n")


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(mode="x-ray"), "mode: "),
        (dict(colour="red"), "colour"),
        (dict(iso=float("nan")), "iso"),
        (dict(iso=object()), "iso: expected a number"),
        (dict(size=(0, 5)), "size"),
        (dict(window=(5, 1)), "window: expected LOW below HIGH"),
        (dict(clip=[(1, 2)]), "clip"),
        (dict(camera=(0, 0, 0, 0, 0, 0)), "camera: expected a target"),
        (dict(labels="no/such.nii"), "no/such.nii"),
        (dict(tf={"colors": []}), "tf"),
        (dict(device="no such device"), "no such device"),
        (dict(surface="labels"), "surface labels: expected a label map"),
        (dict(iso=100, frame_ms=5, values=True), "frame_ms: "),
    ],
)
def test_wrong_options_are_one_sentence(ball, options, words):
    with pytest.raises(palpate.Error, match=words) as caught:
        palpate.render(ball, **options)
    assert "\n" not in str(caught.value)


def test_idle_options_are_warned_of(ball):
    with pytest.warns(palpate.Warning, match="slab"):
        palpate.render(ball, mode="mip", slab=3, **SMALL)


def test_wrong_cameras_leave_the_scene_as_it_was(ball):
    scene = palpate.Scene(ball, **SMALL)
    before = scene.camera
    for eye in [(0, 0, 0), (np.nan, 0, 0), (np.inf, 0, 0)]:
        with pytest.raises(palpate.Error):
            scene.camera = palpate.Camera(eye, (0, 0, 0))
    with pytest.raises(palpate.Error):
        palpate.Camera((1, 2), (0, 0, 0))
    assert scene.camera.eye == before.eye


def test_one_iso_surface_is_where_numpy_has_it(ball):
    """Depths of the picture against the ball's own distance: 10 mm about the origin, orthographic."""
    camera = palpate.Camera((0, -100, 0), (0, 0, 0), orthographic=True, view_height=30)
    picture = palpate.render(ball, iso=100, values=True, integrator="exact", camera=camera, size=(64, 64))
    px = (np.arange(64) + 0.5) / 64 * 30 - 15
    x, z = np.meshgrid(px, px)
    inside = x * x + z * z < 81
    depth = 100 - np.sqrt(100 - x * x - z * z, where=inside, out=np.zeros_like(x))
    # The trilinear field of a cone is off by h^2 / (8 r) of second derivative across the largest spacing,
    # 2 mm at r = 10: 0.05 mm in value's distance; along a ray at 9 mm from the axis by 1 / cos = 2.3 of it.
    assert np.abs(picture.depth - depth)[inside].max() < 0.05 * 2.3 + 1e-3
    assert isinstance(io.BytesIO(picture._repr_png_()).read(), bytes)


def test_a_wrong_keyword_is_named_as_it_was_typed(ball):
    for wrong in ("ambient_oclusion", "windowLevel", "Iso", "_iso", "iso_", "view-angel", "background_colour2"):
        with pytest.raises(palpate.Error) as raised:
            palpate.Scene(ball, **{wrong: 3})
        assert str(raised.value).startswith(f"{wrong}: expected an option of palpate render"), raised.value
    with pytest.raises(palpate.Error) as raised:
        palpate.Scene(ball, view_angle=-5)
    assert "view_angle" in str(raised.value) and "--" not in str(raised.value)
