#pragma once

#include <gdcmDataSet.h>

#include "engine/decode/dicom_file.h"

// Facts that images state in rarer places: pixel spacings beside Pixel Spacing, and padding.
namespace palpate::io {

// Gives a frame without Pixel Spacing that of its detector, or of its ultrasound regions, and words
// for a warning where that is not a length in the patient, or none can be told. Regions count where
// they are measured in centimetres; all that are must agree within 0.1 % (PS3.3 C.8.5.5, C.8.7.1).
void take_other_spacing(const gdcm::DataSet& set, DicomFrame& frame);

// Pixel Padding Value and Pixel Padding Range Limit, in any order, as stored values (PS3.3
// C.7.5.1.1.2); those of floating-point pixels. `file` must have its type and its bits.
StoredRange padding_of(const gdcm::DataSet& set, const DicomFile& file);

} // namespace palpate::io
