#pragma once

#include <filesystem>

#include "engine/base/error.h"
#include "engine/io/dicom_parts.h"
#include "engine/io/volume_io.h"
#include "engine/volume/grid.h"

namespace palpate {

// A series of images that others refer to.
struct DicomReference {
    DicomParts parts;
    Grid grid; // as load_volume() has it
    std::vector<std::string> warnings{};
};

// Reads the headers of a series (a folder, a DICOMDIR or a file; options.series chooses among
// several), without pixels. An error where it is no series of DICOM images, or where its images
// state no study, several frames of reference, or UIDs that are none. Where they state none, as is
// seen in series that were made anonymous, what is made from them gets a new one, with a warning.
Result<DicomReference> load_dicom_reference(const std::filesystem::path& path,
                                            const ReadOptions& options = {});

// Reads a structure set (RTSTRUCT) as a label map on the grid of a series of images: a sample
// belongs to a structure whose contours enclose half of its area or more. options.series chooses
// among several series of the reference. An error where the contours lie in another frame of
// reference, or between the slices.
Result<LoadedVolume> load_structures(const std::filesystem::path& path,
                                     const std::filesystem::path& reference,
                                     const ReadOptions& options = {});

} // namespace palpate
