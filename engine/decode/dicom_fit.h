#pragma once

#include "engine/decode/dicom_stack.h"

// One orientation, one pixel spacing and one line of positions for images that state each of them a
// little differently.
namespace palpate::io {

// Images of one plane differ by noise and rounding of at most this: the distance between unit
// vectors (0.29 degrees), and a share of the pixel spacing. An image of 512 samples is then at most
// two and a half samples off at its edges. Half of it is 0.35 beside 0.3515625 mm.
constexpr double kSameDirection = 5e-3;

// Differences that are not worth a word: 0.006 degrees.
constexpr double kEqualDirection = 1e-4;

// Whether two images agree about what they state: their size, and which of position, orientation
// and spacing.
bool same_kind(const DicomFrame& a, const DicomFrame& b);

// Sets of images of one plane: each lies within kSameDirection of the medians of its set. In the
// order of their first images.
std::vector<std::vector<DicomFrame>> split_planes(std::vector<DicomFrame> images);

// "another orientation (turned by 5 degrees, axial)", or another size or pixel spacing, or no
// position: how an image differs from one of another plane.
std::string difference_words(const DicomFrame& image, const DicomFrame& other);

struct FittedPlane {
    glm::dmat2x3 axes{{1, 0, 0}, {0, 1, 0}};
    std::optional<glm::dvec2> spacing_mm;
    bool from_noise = false; // the axes are a mean of such as differ
    double degrees = 0;      // the largest angle between an image's axes and these, of noise
};

// The axes and the spacing of images of one plane (one or more): those of the first where all are
// equal within kEqualDirection. Else the mean of the axes, made orthonormal, without images that
// lie three times as far off as the median one; and the median of the spacings.
FittedPlane fit_plane(const std::vector<DicomFrame>& images);

// Turns axes that are a mean of noise until they are at right angles to the line of the images'
// positions, which is known better, where that is no further than the noise. `step` points along
// the normal, not against it.
void turn_to_line(FittedPlane& plane, glm::dvec3 step);

// How much images differ from the plane that is used for them, and how far a sample in a corner of
// one is moved at most; empty where that is not worth a word.
std::string noise_words(const std::vector<DicomFrame>& images, const FittedPlane& plane);

// A line on which sample k lies at `first + k * step`.
struct FittedLine {
    glm::dvec3 first{}, step{};
    std::vector<double> off_mm; // the distance of each point from its place
    double farthest_mm = 0;     // the largest of them
};

// The line of two or more points whose places on it are `at`, which rise strictly: through the
// first and the last where all others lie on that within kPositionRoundingMm and a twentieth of the
// step. Else the least-squares line of the points that lie within three times the median distance
// of the Theil-Sen line.
FittedLine fit_line(const std::vector<glm::dvec3>& points, const std::vector<double>& at);

// The least-squares line of all of them.
FittedLine least_squares_line(const std::vector<glm::dvec3>& points, const std::vector<double>& at);

// Half of the last decimal place to which positions are rounded, in mm: 0.005 for 1.25, 0.5 for
// whole ones. At most 0.5; 0 where they have more than four decimals.
double rounding_mm(const std::vector<glm::dvec3>& points);

} // namespace palpate::io
