"""See, touch and carve CT and MR volumes.

    import palpate
    head = palpate.load("head.nii.gz")
    palpate.render(head, mode="iso", iso=300).save("skull.png")

Arrays are (x, y, z): ``array[i, j, k]`` is the sample with index (i, j, k) along the volume's axes, as
nibabel has it. World space is millimetres, left-posterior-superior (LPS, as DICOM); ``affine`` maps
indices to it. nibabel's affines are RAS: conversions from and to nibabel change the signs of x and y.

Errors are ``palpate.Error`` with one sentence. Warnings of the libraries are ``palpate.Warning``; notes
go to the logger "palpate".
"""

from ._core import Error
from ._core import version as __version__
from ._messages import Warning
from ._program import decoder_program
from .document import Document
from .measure import compare, measure
from .mesh import Mesh, labels_to_meshes, load_mesh, surface
from .picture import (
    Camera,
    Picture,
    Renderer,
    Scene,
    TransferFunction,
    presets,
    release,
    render,
)
from .segment import Segmented, filter, filters, methods, scissors, segment, segment_by_net
from .touch import CONTACTS, Felt, Servo, Touched, touch, touch_algorithms, touch_devices
from .volume import Volume, as_volume, load, load_structures, save, save_dicom

__all__ = [
    "CONTACTS",
    "Camera",
    "Document",
    "Error",
    "Felt",
    "Mesh",
    "Picture",
    "Renderer",
    "Scene",
    "Segmented",
    "Servo",
    "Touched",
    "TransferFunction",
    "Volume",
    "Warning",
    "as_volume",
    "compare",
    "decoder_program",
    "filter",
    "filters",
    "labels_to_meshes",
    "load",
    "load_mesh",
    "load_structures",
    "measure",
    "methods",
    "presets",
    "release",
    "render",
    "save",
    "save_dicom",
    "scissors",
    "segment",
    "segment_by_net",
    "surface",
    "touch",
    "touch_algorithms",
    "touch_devices",
]
