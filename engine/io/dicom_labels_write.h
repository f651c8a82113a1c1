#pragma once

#include <filesystem>
#include <span>
#include <stop_token>
#include <string>

#include "engine/base/error.h"
#include "engine/io/dicom_reference.h"
#include "engine/io/label_names.h"
#include "engine/io/segment_codes.h"
#include "engine/volume/volume.h"

namespace palpate {

// How labels are stored as a DICOM object.
enum class DicomLabels {
    binary,     // SEG (PS3.3 A.51) with one bit a sample and segment
    fractional, // SEG with one byte a sample and segment: 0, or 255 where the segment is
    label_map,  // Label Map SEG (PS3.3 A.51 of 2024): the labels themselves
};

struct DicomLabelOptions {
    DicomLabels kind = DicomLabels::binary;
    SegmentCodes codes{};
    std::string frame_of_reference{}; // UID of that of the labels; empty: unknown
    std::string description{};        // of the series; empty: "Segmentation"
    std::stop_token stop{};
};

// Writes labels as an object of the study that the reference belongs to, with names and colours;
// of labels without a name "Label 7", without a colour the generated one. The samples must be where
// those of the reference are; axes may be exchanged or reversed. Each slice refers to its image.
//
// Segments of SEG are numbered 1, 2, .. by rising label; a private element keeps the label, which
// load_labels() gives back. The first and the last slice of the reference have a frame also where
// they are empty, so that the grid comes back whole.
//
// An error, without a file, where samples are of another type than u8 and u16, where there are no
// labels, where samples with a label lie beyond the reference, or where the labels lie on another
// grid or in another frame of reference.
Result<void> save_dicom_labels(const std::filesystem::path& path, const Volume& labels,
                               std::span<const LabelName> names, const DicomReference& reference,
                               const DicomLabelOptions& options = {});

} // namespace palpate
