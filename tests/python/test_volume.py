"""Volumes: arrays, affines, files, and images of other packages."""

import numpy as np
import pytest

import palpate

AFFINE = np.array([[0.0, -0.5, 0.1, 7.0], [0.6, 0.0, 0.0, -3.0], [0.0, 0.2, -2.0, 5.5], [0, 0, 0, 1]])


def noise(dtype, shape=(37, 5, 41)):
    rng = np.random.default_rng(7)
    if np.dtype(dtype).kind == "f":
        return rng.normal(size=shape).astype(dtype)
    info = np.iinfo(dtype)
    return rng.integers(info.min, info.max, size=shape, dtype=dtype, endpoint=True)


@pytest.mark.parametrize("dtype", [np.uint8, np.int8, np.uint16, np.int16, np.float32])
@pytest.mark.parametrize("layout", ["C", "F", "strided", "swapped"])
def test_an_array_comes_back_as_it_went_in(dtype, layout):
    array = noise(dtype)
    given = {
        "C": np.ascontiguousarray(array),
        "F": np.asfortranarray(array),
        "strided": np.repeat(array, 2, axis=1)[:, ::2, :],
        "swapped": array.astype(np.dtype(dtype).newbyteorder(">")),
    }[layout]
    volume = palpate.Volume.from_numpy(given, AFFINE)
    back = volume.to_numpy()
    assert back.dtype == dtype == volume.dtype
    assert back.shape == array.shape == volume.shape
    assert np.array_equal(back, array)
    assert np.array_equal(volume.affine, AFFINE)
    assert np.allclose(volume.spacing, np.linalg.norm(AFFINE[:3, :3], axis=0), rtol=1e-15)


@pytest.mark.parametrize(
    "array, dtype",
    [
        (np.full((4, 4, 4), True), np.uint8),
        (np.arange(64, dtype=np.int64).reshape(4, 4, 4), np.uint8),
        (np.arange(64, dtype=np.float64).reshape(4, 4, 4) - 1000, np.int16),
        (np.arange(64, dtype=np.float64).reshape(4, 4, 4) / 4, np.float32),
        (np.arange(64, dtype=np.float16).reshape(4, 4, 4) / 4, np.float32),
        (np.arange(64, dtype=np.uint32).reshape(4, 4, 4) * 1000, np.uint16),
    ],
)
def test_other_types_become_the_smallest_that_holds_them(array, dtype):
    volume = palpate.Volume.from_numpy(array)
    assert volume.dtype == dtype
    assert np.array_equal(volume.to_numpy(), array)


def test_rounding_is_said():
    with pytest.warns(palpate.Warning, match="round"):
        palpate.Volume.from_numpy(np.array([[[0.1, 0.2]]], dtype=np.float64))


def test_no_data_is_nan_and_counted():
    array = noise(np.float32)
    array[3, 2, 1] = np.nan
    array[0, 0, 0] = np.inf
    volume = palpate.Volume.from_numpy(array)
    assert volume.no_data_count == 2
    assert np.isnan(volume.to_numpy()[[3, 0], [2, 0], [1, 0]]).all()


def test_a_box_is_that_of_the_array():
    array = noise(np.int16, (70, 33, 40))
    volume = palpate.Volume.from_numpy(array)
    assert np.array_equal(volume.box((30, 1, 31), (35, 32, 2)), array[30:65, 1:33, 31:33])
    with pytest.raises(palpate.Error, match="within 70 x 33 x 40"):
        volume.box((60, 0, 0), (20, 1, 1))
    with pytest.raises(palpate.Error):
        volume.box((-1, 0, 0), (1, 1, 1))


def test_ras_turns_the_first_two_axes():
    ras = palpate.Volume.from_numpy(noise(np.uint8), AFFINE, space="RAS")
    assert np.array_equal(ras.affine, np.diag([-1, -1, 1, 1]) @ AFFINE)
    assert np.array_equal(ras.affine_ras, AFFINE)


@pytest.mark.parametrize("name", ["v.nii", "v.nii.gz", "v.nrrd", "v.mha", "v.pbv"])
def test_a_file_keeps_samples_and_places(tmp_path, name):
    turned = AFFINE.copy()
    turned[:3, :3] = np.array([[0, 0.5, 0], [0.6, 0, 0], [0, 0, 2.0]])  # MetaImage holds no shear
    volume = palpate.Volume.from_numpy(noise(np.int16), turned)
    palpate.save(tmp_path / name, volume)
    back = palpate.load(tmp_path / name)
    assert np.array_equal(back.to_numpy(), volume.to_numpy())
    assert np.allclose(back.affine, volume.affine, atol=1e-5)  # NIfTI keeps floats


def test_nibabel_reads_what_is_written_and_is_read(tmp_path):
    import nibabel

    array = noise(np.int16)
    volume = palpate.Volume.from_numpy(array, AFFINE)
    palpate.save(tmp_path / "ours.nii.gz", volume)
    theirs = nibabel.load(tmp_path / "ours.nii.gz")
    assert np.array_equal(np.asanyarray(theirs.dataobj), array)
    assert np.allclose(theirs.affine, volume.affine_ras, atol=1e-5)

    image = volume.to_nibabel()
    assert np.array_equal(image.affine, volume.affine_ras)
    nibabel.save(image, tmp_path / "theirs.nii")
    for back in (palpate.load(tmp_path / "theirs.nii"), palpate.as_volume(nibabel.load(tmp_path / "theirs.nii"))):
        assert np.array_equal(back.to_numpy(), array)
        assert np.allclose(back.affine, AFFINE, atol=1e-5)


def test_nibabel_scaled_values_are_taken(tmp_path):
    import nibabel

    image = nibabel.Nifti1Image(noise(np.int16, (4, 5, 6)), np.eye(4))
    image.header.set_slope_inter(0.5, 3.0)
    nibabel.save(image, tmp_path / "scaled.nii")
    volume = palpate.as_volume(nibabel.load(tmp_path / "scaled.nii"))
    assert np.array_equal(volume.to_numpy(), nibabel.load(tmp_path / "scaled.nii").get_fdata())
    assert np.array_equal(palpate.load(tmp_path / "scaled.nii").to_numpy(), volume.to_numpy())


def test_dlpack_and_array_protocols():
    volume = palpate.Volume.from_numpy(noise(np.int16))
    assert np.array_equal(np.from_dlpack(volume), volume.to_numpy())
    assert np.array_equal(np.asarray(volume, dtype=np.float64), volume.to_numpy())

    class Tensor:
        def __init__(self, array):
            self._array = array

        def __dlpack__(self, stream=None):
            return self._array.__dlpack__()

        def __dlpack_device__(self):
            return self._array.__dlpack_device__()

    assert np.array_equal(palpate.as_volume(Tensor(volume.to_numpy())).to_numpy(), volume.to_numpy())


class Image:
    """As SimpleITK's: z, y, x arrays, and geometry in LPS."""

    def __init__(self, array, affine):
        self.array, self.affine = array, affine

    def GetSpacing(self):
        return tuple(np.linalg.norm(self.affine[:3, :3], axis=0))

    def GetDirection(self):
        return tuple((self.affine[:3, :3] / self.GetSpacing()).ravel())

    def GetOrigin(self):
        return tuple(self.affine[:3, 3])


def test_images_with_the_interface_of_simpleitk(monkeypatch):
    import sys
    import types

    module = types.ModuleType("fakeitk")
    module.GetArrayViewFromImage = lambda image: image.array
    monkeypatch.setitem(sys.modules, "fakeitk", module)
    monkeypatch.setattr(Image, "__module__", "fakeitk")
    array = noise(np.int16)
    volume = palpate.as_volume(Image(np.ascontiguousarray(array.T), AFFINE))
    assert np.array_equal(volume.to_numpy(), array)
    assert np.allclose(volume.affine, AFFINE, atol=1e-12)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: palpate.load("no/such/file.nii"), "no/such/file.nii"),
        (lambda: palpate.Volume.from_numpy(np.zeros((3, 3))), "3 dimensions"),
        (lambda: palpate.Volume.from_numpy(np.zeros((3, 0, 3))), "samples on each axis"),
        (lambda: palpate.Volume.from_numpy(np.zeros((2, 2, 2)), np.eye(3)), "4 x 4"),
        (lambda: palpate.Volume.from_numpy(np.zeros((2, 2, 2)), np.full((4, 4), np.nan)), "finite"),
        (lambda: palpate.Volume.from_numpy(np.zeros((2, 2, 2)), np.diag([1, 0, 1, 1])), "inverse"),
        (lambda: palpate.Volume.from_numpy(np.zeros((2, 2, 2), np.uint8), np.diag([1, 0, 1, 1])), "inverse"),
        (lambda: palpate.Volume.from_numpy(np.zeros((2, 2, 2)), np.eye(4), "XYZ"), "LPS"),
        (lambda: palpate.Volume.from_numpy(np.zeros((2, 2, 2), complex)), "type"),
        (lambda: palpate.Volume.from_numpy(np.full((2, 2, 2), "a")), "type"),
        (lambda: palpate.Volume.from_numpy(np.full((2, 2, 2), 1.5), labels=True), "1.5"),
        (lambda: palpate.Volume.from_numpy(np.zeros((2, 2, 2)), spacing=(1, -1, 1)), "above 0"),
        (lambda: palpate.Volume(None), "palpate.load"),
        (lambda: palpate.save("/no/such/folder/v.nrrd", np.zeros((2, 2, 2))), "/no/such/folder"),
        (lambda: palpate.save("v.bmp", np.zeros((2, 2, 2))), "v.bmp"),
        (lambda: palpate.load("synthetic:nothing"), "nothing"),
        (lambda: palpate.load("x.nii", frame=-1), "frame"),
    ],
)
def test_what_cannot_be_is_one_sentence(call, words):
    with pytest.raises(palpate.Error, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_the_decoder_is_found():
    assert palpate.decoder_program().endswith("bin/palpate")
