#pragma once

#include "engine/decode/nrrd_header.h"
#include "engine/decode/payload.h"

// Segmentations of 3D Slicer (.seg.nrrd). Segments that overlap lie in several layers, along an
// axis of their own; each is a value of its layer. Files before Slicer 4.11 state neither: every
// segment is the value 1 of a layer of its own. Source: Slicer's documentation, "Segmentations",
// file format (slicer.readthedocs.io).
namespace palpate::io {

// Whether the file is such a segmentation with an axis of layers.
bool has_layers(const NrrdHeader& header);

// Names and colours of the labels of a segmentation without layers.
std::vector<LabelName> names_of_labels(const NrrdHeader& header);

// Fills a label map from the layers, which are the frames of the payload. Labels are the values
// that the header states, or the numbers of segments from 1 on where several layers use the same
// value. Where segments overlap, the one with the higher number is kept, and a warning names them;
// decoded gets names and colours. An error where two segments are one value, or a layer does not
// exist.
Result<void> read_layers(const std::string& name, const NrrdHeader& header, const Payload& payload,
                         VoxelSink& sink, Decoded& decoded);

} // namespace palpate::io
