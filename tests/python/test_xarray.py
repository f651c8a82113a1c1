"""Arrays of xarray."""

import numpy as np

import palpate
from test_volume import AFFINE, noise


def test_xarray_by_name_of_axis():
    import xarray

    volume = palpate.Volume.from_numpy(noise(np.int16), AFFINE, modality="CT")
    data = volume.to_xarray()
    back = palpate.as_volume(data.transpose("z", "x", "y"))
    assert np.array_equal(back.to_numpy(), volume.to_numpy())
    assert np.array_equal(back.affine, AFFINE)
    assert back.modality == "CT"
    by_coords = xarray.DataArray(
        noise(np.uint8, (3, 4, 5)),
        dims=("x", "y", "z"),
        coords={"x": [1.0, 1.5, 2.0], "y": [0.0, 2, 4, 6], "z": np.arange(5.0)},
    )
    assert palpate.as_volume(by_coords).spacing == (0.5, 2.0, 1.0)
    assert palpate.as_volume(by_coords).affine[0, 3] == 1.0
