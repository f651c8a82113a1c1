#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/decoder.h"

// From many DICOM images to one regular stack. Plain data: knows nothing of the library that reads.
namespace palpate::io {

// One image: a file, or a frame of a multi-frame file. Lengths in mm, LPS.
struct DicomFrame {
    std::filesystem::path file;
    uint32_t frame = 0; // within the file
    std::string series_uid, series_description, modality, instance_uid;
    int64_t instance_number = 0;
    glm::uvec2 size{};                    // columns, rows
    std::optional<glm::dvec3> position;   // centre of the first sample
    std::optional<glm::dmat2x3> axes;     // unit vectors along a row and along a column
    std::optional<glm::dvec2> spacing_mm; // along a row (x), along a column (y)
    std::optional<double> slice_step_mm;  // spacing between slices, else their thickness
    Rescale rescale;
};

// Images of one series, in the order in which they fill a volume.
struct DicomStack {
    std::vector<DicomFrame> frames;
    Grid grid;
    std::vector<std::string> warnings;
};

// One series of a folder, as people choose it.
struct DicomSeries {
    std::string uid, description, modality;
    std::vector<DicomFrame> frames;
};

// The series of a folder, by descending number of images, then by UID.
std::vector<DicomSeries> group_series(std::vector<DicomFrame> frames);

// The one meant by request.series (a UID, or part of a description in any case), or the first.
// An error lists the series when none or several match.
Result<size_t> choose_series(const DecodeRequest& request, const std::vector<DicomSeries>& all);

// Sorts the images along their normal, splits off the frame asked for where several images lie at
// each position, and derives the grid. Slices keep a shear (gantry tilt). What departs from a
// regular stack is a warning where the geometry stays true, and an error with the files and numbers
// where it would not: missing slices, uneven gaps beyond 10 %, mixed sizes or orientations without
// a clear majority.
Result<DicomStack> make_stack(const DecodeRequest& request, DicomSeries series);

} // namespace palpate::io
