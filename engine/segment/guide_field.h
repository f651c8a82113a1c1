#pragma once

#include <limits>

#include "engine/segment/task.h"
#include "engine/volume/volume.h"

// Volumes of distances in mm that a hand is guided by (haptics/proxy/guide.h): f32, with
// kGuideMargin samples beyond the volume they were made from, on each side, so that a cubic spline
// of them is right to its faces. All refuse what signed_distance() does. Memory: the result, and a
// byte a sample; guide_to_edges() also 4 bytes a sample while it smooths.
namespace palpate {

constexpr int kGuideMargin = 4;

// Signed distance to the labels that are not 0, negative within: for guide-inside, to place seeds
// in an object. The labels are those of any method: an arrival volume's by its threshold, or what
// the statistics of the first seeds find. Values beyond reach_mm are cut there, and draw nothing.
// On thick slices it is off by up to half the difference of the spacings, and 0 in its place.
// Refused: no label.
Result<Volume> guide_to_labels(const Volume& labels, double reach_mm, const Task& task);

// Signed distance to edges of the grey values, negative within half a sample of one: for
// guide-inside, so that what is drawn along a boundary, and seeds of a live-wire, come to lie where
// its paths are cheap. An edge is a sample at which the gradient magnitude of the smoothed volume
// is at least `least` and at least that a sample of the smallest spacing away on both sides along
// the gradient (Canny 1986). Samples farther apart than sample_mm are first interpolated (cubic) to
// so many that none is, as far as the result has at most kMostGuideSamples: so the edge is narrower
// than a thick slice. Memory of this one: 16 bytes a sample of the result. Refused: no edge.
constexpr uint64_t kMostGuideSamples = uint64_t{1} << 27;
struct GuideToEdges {
    double sample_mm = 1.0;
    double sigma_mm = 1.5; // of the Gaussian; 0: none
    double least = 0.0;    // value units per mm; 0: three times the median over the volume
    double reach_mm = 6.0; // > 0; farther off nothing draws
};
Result<Volume> guide_to_edges(const Volume& volume, const GuideToEdges& options, const Task& task);

// Signed distance to a plane, for guide-onto, about the volume of a grid: 16 samples on each axis,
// so that a plane that is moved is cheap to make anew. Refused: a normal of no length.
Result<Volume> guide_to_plane(const Grid& grid, glm::dvec3 point_mm, glm::dvec3 normal);

} // namespace palpate
