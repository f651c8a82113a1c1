#pragma once

#include "engine/decode/dicom_file.h"

namespace palpate::io {

// Fills a label map from a segmentation (SEG, PS3.3 A.51): the numbers of segments become labels,
// and each frame lies where its functional groups place it.
//
// The grid is that of the segmentation's own frames; slices without a frame are background. A
// sample of a fractional segmentation carries the segment with the largest share, where that is a
// half or more. Where segments overlap, the one with the higher number is kept (of fractional ones
// the one with the larger share), and a warning names them. An error where frames differ in
// orientation or size, lie on no even grid, or state no position (slide microscopy).
Result<Decoded> decode_segmentation(const std::string& name, const DicomFile& file,
                                    VoxelSink& sink);

} // namespace palpate::io
