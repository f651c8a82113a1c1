#pragma once

#include "engine/decode/dicom_elements.h"
#include "engine/decode/dicom_stack.h"

// Where the frames of a DICOM file lie: the elements that say so, in the places where they may be.
namespace palpate::io {

// Takes position, orientation, spacing and rescale from the elements of an image, or of a
// functional group. An element that is absent or malformed changes nothing.
void take_geometry(const gdcm::DataSet& set, DicomFrame& frame);

// The same from the functional groups of an enhanced multi-frame image (PS3.3 C.7.6.16), the
// frame's segment, and its marks; `groups` may be empty.
void take_groups(const DicomItem& groups, DicomFrame& frame);

} // namespace palpate::io
