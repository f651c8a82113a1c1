#pragma once

#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/grid.h"

// Positions of objects in the patient, and whether they overlap.
namespace palpate {

// A box along the world's axes, LPS mm.
struct WorldBox {
    glm::dvec3 low{0.0}, high{0.0};
};

// The smallest one that holds a volume's sample centres, `margin` samples beyond them on each side.
WorldBox world_box(const Grid& grid, double margin = 0.0);

// "left -10 .. 20, posterior 0 .. 40, superior 5 .. 9 mm".
std::string text_of(const WorldBox& box);

// The points x with dot(normal, x) >= offset; world mm, normal of any length but 0.
struct HalfSpace {
    glm::dvec3 normal{1.0, 0.0, 0.0};
    double offset = 0.0;
};

// The six whose common points are the sampled box, `margin` samples beyond the sample centres.
std::vector<HalfSpace> half_spaces(const Grid& grid, double margin = 0.0);
std::vector<HalfSpace> half_spaces(const WorldBox& box);

// Whether a point lies in all of them, give or take slack_mm. Together they are bounded, as they
// are where those of one box are among them: then a point is common if and only if a corner is,
// where three of their planes meet.
bool have_common_point(std::span<const HalfSpace> spaces, double slack_mm);

// A sentence with both boxes, beginning with `what` the first is, if no sample of one lies within a
// sample of the other. Empty where some do.
std::string apart_text(const std::string& what, const Grid& grid, const Grid& volume);

// Fails where a size is 0 or the matrix has no inverse. Makers of volumes take both for granted.
Result<void> check_grid(const Grid& grid);

// The smallest and the largest of the three spacings along the index axes; > 0.
double smallest_spacing_mm(const Grid& grid);
double largest_spacing_mm(const Grid& grid);

// A ten-thousandth of the smallest spacing: what is nearer is taken as the same place.
double slack_mm(const Grid& grid);

} // namespace palpate
