#pragma once

#include <cmath>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

// Bodies whose touch has a closed form: what a frictionless point pressed into them must feel is
// computed here in double precision, and every algorithm is held against it.
namespace palpate::touch {

// Material in free space, millimetres. All functions may be called from several threads.
struct Solid {
    // Signed distance to the surface, negative inside the material; exact within 3 mm of it.
    std::function<double(glm::dvec3 mm)> distance_mm;
    // The nearest point that is free: where a frictionless proxy rests. A point that is free is
    // returned itself; none where the nearest is not unique or not known.
    std::function<std::optional<glm::dvec3>(glm::dvec3 mm)> nearest_free;
    // The scanner's value, 0 in free space to 1 in material, 0.5 at the surface. `edge_mm` is
    // the standard deviation of its blur.
    std::function<double(glm::dvec3 mm, double edge_mm)> density;
    // The connected part of free space at a point; -1 in material. Absent: there is one.
    std::function<int(glm::dvec3 mm)> part;
    bool free_is_convex = false;
    // The least radius at which material bulges: the nearest free point moves faster than the hand
    // about a bulge. Infinite where free space is convex, for then the projection does not expand.
    double bulge_mm = INFINITY;
};

// How much faster than the hand a true force may change at this depth, in units of the stiffness.
double expansion(const Solid& solid, double depth_mm);

// The body for the middle of a ball of this radius: its surface moved out by the radius. A
// hollow edge must be rounded by at least as much. The density stays the body's.
Solid grown(const Solid& solid, double radius_mm);

// Nothing at all, anywhere; `value` is what is stored of it.
Solid nothing(double value = 0.0);

// Material where dot(normal, x - point) < 0.
Solid plane(glm::dvec3 point, glm::dvec3 normal);
Solid ball(glm::dvec3 center, double radius_mm);
Solid cavity(glm::dvec3 center, double radius_mm); // material outside the ball

// Free space is the meeting of half spaces dot(normal_i, x - point) > 0, up to three, with its
// edges rounded by fillet_mm: the sum of the sharp wedge moved inwards and a ball. Concave.
Solid hollow_corner(glm::dvec3 point, std::span<const glm::dvec3> normals, double fillet_mm);
// The same with material and free space exchanged: a rounded convex edge or corner. normals point
// into the material.
Solid solid_corner(glm::dvec3 point, std::span<const glm::dvec3> normals, double fillet_mm);

// A wall between two half spaces, or a ball's shell about mid radius_mm. The surface is where the
// blurred wall has density 0.5, so thin walls are somewhat thinner than their name.
// edge_mm must be the blur it is stored with; 2 erf-blurs of a wall thinner than 1.35 edge_mm never
// reach 0.5 and are no wall: thickness above that is required.
Solid slab(glm::dvec3 point, glm::dvec3 normal, double thickness_mm, double edge_mm);
Solid shell(glm::dvec3 center, double radius_mm, double thickness_mm, double edge_mm);

Solid torus(glm::dvec3 center, double ring_mm, double tube_mm);
Solid capped_cylinder(glm::dvec3 center, glm::dvec3 axis, double half_length_mm, double radius_mm,
                      double fillet_mm);
Solid two_balls(glm::dvec3 a, glm::dvec3 b, double radius_mm); // touching or apart, not overlapping
// sin X cos Y + sin Y cos Z + sin Z cos X > 0, X = 2 pi x / period; distance to first order, no
// nearest_free.
Solid gyroid(double period_mm);

// The point of the polyhedral cone { dot(n_i, x - point) >= 0 } nearest to x, by trying every
// subset of active planes; at most three planes, linearly independent. Exact.
glm::dvec3 project_to_wedge(glm::dvec3 x, glm::dvec3 point, std::span<const glm::dvec3> normals);

// Two unit normals that enclose free space (or material) of this angle about direction `up`.
std::vector<glm::dvec3> wedge_normals(double angle_deg, glm::dvec3 up, glm::dvec3 along);

} // namespace palpate::touch
