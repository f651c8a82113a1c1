#pragma once

#include <array>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <stop_token>
#include <string>

#include "engine/measure/label_statistics.h"

namespace palpate {

// The solid ellipsoid with the same second moments: its axes, the longest first.
struct PrincipalAxes {
    std::array<glm::dvec3, 3> direction; // unit length, world; the largest component is positive
    glm::dvec3 semi_axes_mm;             // sqrt(5 x second moment), falling
};
PrincipalAxes principal_axes(const glm::dmat3& covariance_mm2);

// The surface of each label (surface_nets(), 20 passes of smoothing, which keep every vertex within
// 0.375 of a sample on each axis from the middle between samples).
struct LabelSurface {
    double area_mm2 = 0.0;
    double volume_mm3 = 0.0; // enclosed by it
    // The area of a ball of the enclosed volume over the label's: 1 for a ball, less for all else.
    double sphericity = 0.0;
    // A sentence if fewer than half of the label's samples can lie in blocks of 2 x 2 x 2: it says
    // that the label is one sample thick, which smoothing makes thinner still, and names the area
    // of its samples' outer faces. Empty else.
    std::string note{};
};
// By label. Labels are whole numbers 0 .. 65535. Nothing where `stop` was asked.
std::optional<std::map<uint16_t, LabelSurface>> label_surfaces(const Volume& labels,
                                                               const std::stop_token& stop = {});

} // namespace palpate
