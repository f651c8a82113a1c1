#pragma once

#include "engine/io/dicom_labels_write.h"

namespace palpate {

// As save_dicom_labels(), as a structure set (RTSTRUCT, PS3.3 A.19): each label
// is a region of interest with the label as its number, and closed planar
// contours in the slices of the reference, each of which refers to its image.
// options.kind does not count.
//
// Contours run along the edges of samples (engine/io/outlines.h), so that they
// enclose exactly the area of the samples in each slice; those of holes are
// joined to them by channels of no width.
Result<void> save_dicom_structures(const std::filesystem::path& path, const Volume& labels,
                                   std::span<const LabelName> names,
                                   const DicomReference& reference,
                                   const DicomLabelOptions& options = {});

} // namespace palpate
