#pragma once

#include "engine/decode/dicom_elements.h"
#include "engine/decode/dicom_stack.h"

// The places of a DICOM file's frames: the elements that state them, wherever they may be.
namespace palpate::io {

// Takes position, orientation, spacing and rescale from the elements of an image, or of a
// functional group. An element that is absent or malformed changes nothing.
void take_geometry(const gdcm::DataSet& set, DicomFrame& frame);

// The `count` (>= 1) frames of a file, each where the file places it. `plane` holds what
// take_geometry took from the file's own elements. A frame lies where these say:
//
// 1. the functional groups of enhanced images (PS3.3 C.7.6.16), those of ultrasound volumes
//    (C.8.24.3) among them: their axes are the transducer's, with a warning;
// 2. the detectors of nuclear medicine (C.8.4.11). The slice vector counts slices from the first,
//    along the normal for a positive spacing and against it for a negative one (C.8.4.15); the
//    other vectors that the frame increment points to become the frame's indices;
// 3. one position for the whole file: its frames are slices at the stated spacing, unless the frame
//    increment is a time, or no spacing is stated: then all lie at that position.
//
// Otherwise frames have no position. An error names a vector that does not fit the frames.
Result<std::vector<DicomFrame>> frames_of(const std::string& name, const gdcm::DataSet& set,
                                          const DicomFrame& plane, uint32_t count,
                                          std::vector<std::string>& warnings);

} // namespace palpate::io
