#pragma once

#include "engine/decode/dicom_stack.h"

namespace palpate::io {

// Sorts the images at each place, so that the images of one number belong to one frame: an echo, a
// phase, a point in time. Every place holds equally many, two or more.
//
// An attribute tells images apart where it differs among the images of every place. The main keys
// of FrameKey are asked first, each alone; then all attributes that differ, one after the other.
// Values must fit together across places: an echo time, a b-value or a temporal position belongs to
// one frame. Frames of one file that lie at a single place stay in the order of the file.
//
// Returns the order in words: "EchoTime (1, 2, 3 ms)". An error names two files and what they state
// where nothing tells images apart, or where two attributes tell of different orders: the number of
// an instance says nothing of what belongs together.
Result<std::string> order_frames(const std::string& name,
                                 std::vector<std::vector<DicomFrame>>& places);

} // namespace palpate::io
