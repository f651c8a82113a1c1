"""Images of SimpleITK, where it is installed (Debian 12 has no package of it)."""

import numpy as np

import palpate
from test_volume import noise


def test_a_real_simpleitk_image():
    affine = np.diag([0.5, 0.6, 2.0, 1.0])
    affine[:3, 3] = [7, -3, 5.5]
    volume = palpate.Volume.from_numpy(noise(np.int16), affine)
    image = volume.to_sitk()
    assert image.GetSize() == volume.shape
    back = palpate.as_volume(image)
    assert np.array_equal(back.to_numpy(), volume.to_numpy())
    assert np.allclose(back.affine, affine)
