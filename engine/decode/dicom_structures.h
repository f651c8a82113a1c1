#pragma once

#include "engine/decode/formats.h"

namespace palpate::io {

// Whether a file says that its class is that of structure sets (RTSTRUCT): in its meta header, or,
// without one, in its data set.
bool is_structure_set(const std::filesystem::path& path);

// Fills a label map on the grid of the series request.onto from the closed planar contours of a
// structure set (PS3.3 C.8.8.6): a sample belongs to a structure whose contours enclose half of its
// area or more. Numbers of structures become labels where they are distinct and in 1 .. 65535, else
// they are counted from 1, with a warning. Where structures overlap, the one with the higher number
// is kept, with a warning. An error where they lie in another frame of reference, between the
// slices of the series, or so far away that a place among its samples is no number.
Result<Decoded> decode_structures(const DecodeRequest& request, VoxelSink& sink);

} // namespace palpate::io
