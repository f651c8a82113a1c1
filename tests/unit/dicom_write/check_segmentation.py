"""Compares seg.dcm with labels.nii and with the images in ct: samples, places, references, patient.

Prints "same", or says what differs.
"""

import glob
import sys

import nibabel
import numpy as np
import pydicom

folder = sys.argv[1]
seg = pydicom.dcmread(folder + "/seg.dcm")
nifti = nibabel.load(folder + "/labels.nii")
truth = np.asarray(nifti.dataobj)
lps_from_index = np.diag([-1.0, -1.0, 1.0, 1.0]) @ nifti.affine
images = {image.SOPInstanceUID: image for image in map(pydicom.dcmread, glob.glob(folder + "/ct/*.dcm"))}
first = next(iter(images.values()))

for keyword in ("PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyInstanceUID", "StudyDate",
                "AccessionNumber", "StudyID", "FrameOfReferenceUID"):
    assert seg[keyword].value == first[keyword].value, keyword
assert str(seg.PatientName) == "Müller^Jörg"
assert seg.SeriesInstanceUID != first.SeriesInstanceUID
referenced = seg.ReferencedSeriesSequence[0]
assert referenced.SeriesInstanceUID == first.SeriesInstanceUID
assert {item.ReferencedSOPInstanceUID for item in referenced.ReferencedInstanceSequence} == set(images)

labels = sorted(set(truth.ravel()) - {0})
kind = seg.SegmentationType
numbers = [segment.SegmentNumber for segment in seg.SegmentSequence]
assert numbers == (labels if kind == "LABELMAP" else list(range(1, len(labels) + 1))), numbers
names = {2: "kidney_right", 7: "Größe", 200: "Label 200"}
for label, segment in zip(labels, seg.SegmentSequence):
    assert segment.SegmentLabel == names[label], segment.SegmentLabel
kidney = seg.SegmentSequence[0].SegmentedPropertyTypeCodeSequence[0]
assert (kidney.CodeValue, kidney.CodeMeaning) == ("64033007", "Kidney")
assert kidney.SegmentedPropertyTypeModifierCodeSequence[0].CodeMeaning == "Right"

# Samples, frame by frame, without the library's own unpacking.
raw = np.frombuffer(seg.PixelData, np.uint8)
count, rows, columns = int(seg.NumberOfFrames), seg.Rows, seg.Columns
if seg.BitsAllocated == 1:
    raw = np.unpackbits(raw, bitorder="little")
frames = raw[: count * rows * columns].reshape(count, rows, columns)
assert len(seg.PixelData) % 2 == 0
assert (frames == seg.pixel_array.reshape(frames.shape)).all()

shared = seg.SharedFunctionalGroupsSequence[0]
cosines = np.array(shared.PlaneOrientationSequence[0].ImageOrientationPatient, float)
down_mm, along_mm = map(float, shared.PixelMeasuresSequence[0].PixelSpacing)
column, row = np.meshgrid(np.arange(columns), np.arange(rows))
met = np.zeros(truth.shape, truth.dtype)
for frame, group in zip(frames, seg.PerFrameFunctionalGroupsSequence):
    position = np.array(group.PlanePositionSequence[0].ImagePositionPatient, float)
    source = group.DerivationImageSequence[0].SourceImageSequence[0]
    image = images[source.ReferencedSOPInstanceUID]
    assert source.ReferencedSOPClassUID == image.SOPClassUID
    assert np.allclose(position, np.array(image.ImagePositionPatient, float), atol=1e-4)
    world = position + along_mm * column[..., None] * cosines[:3] + down_mm * row[..., None] * cosines[3:]
    index = (world - lps_from_index[:3, 3]) @ np.linalg.inv(lps_from_index[:3, :3]).T
    near = np.rint(index).astype(int)
    assert np.abs(index - near).max() < 1e-3
    if kind == "LABELMAP":
        met[tuple(near[..., axis] for axis in range(3))] = frame
        continue
    number = group.SegmentIdentificationSequence[0].ReferencedSegmentNumber
    full = 1 if kind == "BINARY" else seg.MaximumFractionalValue
    assert set(np.unique(frame)) <= {0, full}
    chosen = near[frame == full]
    assert (met[tuple(chosen.T)] == 0).all()
    met[tuple(chosen.T)] = labels[number - 1]
assert (met == truth).all()
print("same")
