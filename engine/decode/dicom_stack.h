#pragma once

#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/decode/frame_marks.h"
#include "engine/io/decoder.h"

// From many DICOM images to one regular stack. Plain data: knows nothing of the library that reads.
namespace palpate::io {

enum class DicomObject {
    image,
    segmentation, // SEG
    other,        // nothing that is read
};

// One image: a file, a frame of a multi-frame file, or a tile of a mosaic. Lengths in mm, LPS.
struct DicomFrame {
    std::filesystem::path file; // empty: a place of the stack for which there is no image
    uint32_t frame = 0;         // within the file
    std::string series_uid, series_description, modality, class_uid, instance_uid;
    std::string frame_of_reference; // UID
    DicomObject object = DicomObject::image;
    std::string object_words; // of others: "is a ..", why it is not read
    int64_t instance_number = 0;
    uint32_t segment = 0;                 // of a segmentation, from 1; 0 where none is stated
    glm::uvec2 size{};                    // columns, rows
    std::optional<glm::dvec3> position;   // centre of the first sample
    std::optional<glm::dmat2x3> axes;     // unit vectors along a row and along a column
    std::optional<glm::dvec2> spacing_mm; // along a row (x), along a column (y)
    std::string spacing_words;            // a warning about it; empty: none
    std::optional<double> slice_step_mm;  // spacing between slices, else their thickness
    bool against_normal = false;          // slices follow one another against the axes' normal
    Rescale rescale;
    FrameMarks marks;
    StoredRange padding;   // stored values without data
    bool inverted = false; // MONOCHROME1: small values are bright
    // The instance of which this image is a version that lost detail in compression; empty: none.
    std::string lossless_uid;
};

// Whether the samples of two images are the same.
using SameSamples = std::function<bool(const DicomFrame&, const DicomFrame&)>;

// Images of one series, in the order in which they fill a volume.
struct DicomStack {
    std::vector<DicomFrame> frames;
    Grid grid;
    // The images do not lie on the grid: they are to be resampled to it (dicom_resample.h).
    bool resampled = false;
    std::vector<std::string> warnings, notes;
};

// One choice in a folder: the images of a series that have one size and orientation, or a
// segmentation, or the other objects of a series.
struct DicomSeries {
    std::string uid, description, modality;
    std::vector<DicomFrame> frames; // one or more
};

// Positions and spacings are decimal strings, often of few digits: this much is rounding.
constexpr double kPositionRoundingMm = 0.01;

// Whether two images have one size, spacing and orientation, up to 1e-4.
bool same_plane(const DicomFrame& a, const DicomFrame& b);

// "64 x 48 at 0.5 x 0.5 mm, axial", as far as the image says it.
std::string plane_words(const DicomFrame& frame);

// The file's name, and the frame's number where it is not the first.
std::string leaf(const DicomFrame& frame);

// Images of one series lie in one plane where they differ by noise alone (dicom_fit.h).
// Images first, then segmentations, then others; each by descending number of images, then by UID.
std::vector<DicomSeries> group_series(std::vector<DicomFrame> frames);

// The one meant by request.series, or the first: a UID, a number as the list of series counts them
// (from 1), a description, or part of one (both in any case). An error lists all when none or
// several match, or says why the one that matches is not read.
Result<size_t> choose_series(const DecodeRequest& request, const std::vector<DicomSeries>& all);

// Each as people read it.
std::vector<SeriesInfo> list_series(const std::vector<DicomSeries>& all,
                                    std::optional<size_t> chosen = {});

// Sorts the images along their normal, splits off the frame asked for where several images lie at
// each position (frame_order.h), and derives the grid. Slices keep a shear (gantry tilt). What
// departs from a regular stack is a warning where the geometry stays true, and an error with the
// files and numbers where it would not: missing slices, uneven gaps beyond 10 %, images out of
// line. Orientations, pixel spacings and positions that differ by noise are fitted (dicom_fit.h),
// with a warning that states the largest difference.
//
// Up to `damaged` slices (files that could not be read) may be missing from an otherwise regular
// stack, and those that `left_out` explains: images of the series in another plane. It then has
// frames without a file in their places (dicom_places.h).
//
// Copies are left out with a warning: images of one instance, versions that lost detail in
// compression beside the image they were made of, and images of other instances at the same place
// whose samples are the same, where without them one image is left at each place.
//
// With request.resample_slices, uneven and tilted stacks get an upright grid of even spacing, to
// which their images are to be resampled. The spacing is the smallest that occurs between three or
// more slices in a row, made to fit between the first and the last; the grid holds all images.
Result<DicomStack> make_stack(const DecodeRequest& request, DicomSeries series, size_t damaged = 0,
                              const std::vector<DicomFrame>& left_out = {},
                              const SameSamples& same_samples = {});

} // namespace palpate::io
