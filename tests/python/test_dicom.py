"""Labels leave as DICOM objects, and come back."""

import os
import warnings

import numpy as np
import palpate
import pydicom
import pytest
from pydicom.dataset import Dataset, FileMetaDataset

CT = "1.2.840.10008.5.1.4.1.1.2"


@pytest.fixture
def series(tmp_path):
    folder = tmp_path / "ct"
    folder.mkdir()
    for z in range(4):
        image = Dataset()
        image.file_meta = FileMetaDataset()
        image.file_meta.MediaStorageSOPClassUID = image.SOPClassUID = CT
        image.file_meta.MediaStorageSOPInstanceUID = image.SOPInstanceUID = f"1.2.3.4.{z + 1}"
        image.file_meta.TransferSyntaxUID = "1.2.840.10008.1.2.1"
        image.is_little_endian, image.is_implicit_VR = True, False
        image.PatientName, image.PatientID, image.Modality = "Doe^Jane", "P-1", "CT"
        image.StudyInstanceUID, image.SeriesInstanceUID, image.FrameOfReferenceUID = "1.2.3", "1.2.3.4", "1.2.3.5"
        image.InstanceNumber = z + 1
        image.ImagePositionPatient, image.ImageOrientationPatient = [-5, 7, 2.5 * z], [1, 0, 0, 0, 1, 0]
        image.PixelSpacing = [0.75, 0.5]
        image.Rows, image.Columns, image.SamplesPerPixel = 5, 6, 1
        image.PhotometricInterpretation, image.PixelRepresentation = "MONOCHROME2", 0
        image.BitsAllocated, image.BitsStored, image.HighBit = 16, 16, 15
        image.PixelData = np.full((5, 6), z, np.uint16).tobytes()
        image.save_as(folder / f"{z}.dcm", write_like_original=False)
    return folder


def test_labels_leave_as_dicom_and_come_back(series, tmp_path):
    ct = palpate.load(series)
    rng = np.random.default_rng(3)
    samples = rng.choice(np.array([0, 2, 5], np.uint8), ct.shape)
    labels = palpate.Volume.from_numpy(samples, ct.affine, labels=True)
    for kind in ("seg", "seg-fractional", "seg-labelmap", "rtstruct"):
        path = tmp_path / f"{kind}.dcm"
        palpate.save_dicom(path, labels, series, kind=kind, names={5: "liver"})
        assert pydicom.dcmread(path).PatientName == "Doe^Jane"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of fractional ones: that half a share counts
            back = palpate.load_structures(path, series) if kind == "rtstruct" else palpate.load(path, labels=True)
        assert (back.to_numpy() == samples).all(), kind
        assert back.label_names == {2: "Label 2", 5: "liver"}, kind


def test_what_does_not_fit_is_an_error_without_a_file(series, tmp_path):
    path = os.fspath(tmp_path / "seg.dcm")
    ones = np.ones((6, 5, 4), np.uint8)
    for match, call in (
        ("another grid", lambda: palpate.save_dicom(path, ones, series)),
        ("kind", lambda: palpate.save_dicom(path, ones, series, kind="surface")),
        ("no such file", lambda: palpate.save_dicom(path, ones, "/no/such/series")),
    ):
        with pytest.raises(palpate.Error, match=match):
            call()
    assert not os.path.exists(path)
