"""Compares the structures of rt.dcm with labels.nii and with the images in ct: volumes, planes, references.

Prints "same", or says what differs.
"""

import glob
import sys

import nibabel
import numpy as np
import pydicom

folder = sys.argv[1]
rt = pydicom.dcmread(folder + "/rt.dcm")
nifti = nibabel.load(folder + "/labels.nii")
truth = np.asarray(nifti.dataobj)
sample_mm3 = abs(np.linalg.det(nifti.affine[:3, :3]))
images = {image.SOPInstanceUID: image for image in map(pydicom.dcmread, glob.glob(folder + "/ct/*.dcm"))}
first = next(iter(images.values()))
cosines = np.array(first.ImageOrientationPatient, float)
normal = np.cross(cosines[:3], cosines[3:])
places = sorted(float(np.dot(np.array(image.ImagePositionPatient, float), normal)) for image in images.values())
apart_mm = (places[-1] - places[0]) / (len(places) - 1)

assert str(rt.PatientName) == "Müller^Jörg" and rt.PatientID == first.PatientID
assert rt.StudyInstanceUID == first.StudyInstanceUID
frame = rt.ReferencedFrameOfReferenceSequence[0]
assert frame.FrameOfReferenceUID == first.FrameOfReferenceUID
series = frame.RTReferencedStudySequence[0].RTReferencedSeriesSequence[0]
assert series.SeriesInstanceUID == first.SeriesInstanceUID
assert {item.ReferencedSOPInstanceUID for item in series.ContourImageSequence} == set(images)

names = {int(roi.ROINumber): roi.ROIName for roi in rt.StructureSetROISequence}
assert names == {2: "kidney_right", 7: "Größe"}, names
for region in rt.ROIContourSequence:
    volume_mm3 = 0.0
    for contour in region.ContourSequence:
        points = np.array(contour.ContourData, float).reshape(-1, 3)
        assert len(points) == contour.NumberOfContourPoints
        image = images[contour.ContourImageSequence[0].ReferencedSOPInstanceUID]
        off = (points - np.array(image.ImagePositionPatient, float)) @ normal
        assert np.abs(off).max() < 1e-4, off
        x, y = points @ cosines[:3], points @ cosines[3:]
        x, y = x - x.mean(), y - y.mean()
        volume_mm3 += 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)) * apart_mm
    expected = (truth == int(region.ReferencedROINumber)).sum() * sample_mm3
    assert expected > 1000, expected  # a ml
    # Coordinates are rounded to 1e-9 of some 100 mm; the affine of NIfTI is in 32-bit floats.
    assert abs(volume_mm3 - expected) < 1e-5 * expected, (volume_mm3, expected)
print("same")
