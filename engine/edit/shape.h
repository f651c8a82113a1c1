#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/mesh/mesh.h"

namespace palpate {

struct BoxMm { // closed; low <= high
    glm::dvec3 low{0.0}, high{0.0};

    // Distance to the box, negative inside. 1-Lipschitz.
    double signed_mm(glm::dvec3 p) const;
    // The length of the vector to its farthest corner.
    double reach_mm() const;
};

// A tool as an implicit function of its own space, in millimetres.
//
// The tool's origin is the point a pose places, and +z runs from the tip up the shaft.
//
// The function is negative inside and at most 0 on the surface; it is 1-Lipschitz,
// |f(p) - f(q)| <= |p - q|, and so never larger than the distance to the surface. This is what lets
// rows be filled in leaps and motion be swept without gaps. Nothing but + - * / and square roots
// happens in it: the same bits on every machine.
class Shape {
 public:
    virtual ~Shape() = default;
    virtual double signed_mm(glm::dvec3 p) const = 0;
    virtual BoxMm bounds() const = 0; // holds every point with signed_mm <= 0
    // The radius, if this is a ball about the origin: its motion is swept in closed form.
    virtual std::optional<double> ball_radius_mm() const { return std::nullopt; }
};

using ShapePtr = std::shared_ptr<const Shape>;

// Radii and lengths in mm, > 0. "Exact" ones return the distance itself outside the shape.
ShapePtr make_ball(double radius_mm);                       // exact
ShapePtr make_ellipsoid(glm::dvec3 radii_mm);               // along the axes
ShapePtr make_capsule(double radius_mm, double length_mm);  // exact; centre line z = 0 .. length
ShapePtr make_cylinder(double radius_mm, double length_mm); // exact; z = 0 .. length
ShapePtr make_box(glm::dvec3 size_mm);                      // exact; about the origin

// A ball drill with `flutes` grooves along meridians, from pole to pole, each the tube of
// flute_radius_mm about a half circle on the surface. flutes = 0 is the plain ball.
ShapePtr make_burr(double radius_mm, uint32_t flutes, double flute_radius_mm);

// Lists are not empty. difference: the first without all others.
ShapePtr make_union(std::vector<ShapePtr> parts);
ShapePtr make_intersection(std::vector<ShapePtr> parts);
ShapePtr make_difference(std::vector<ShapePtr> parts);

// scale > 0 first, then the turn (of unit length), then the offset.
ShapePtr make_placed(ShapePtr shape, glm::dvec3 offset_mm, glm::dquat turn, double scale);

// The inside of a closed mesh in tool space, through its distance at the corners of cells of
// cell_mm, interpolated linearly and divided by sqrt(3), the most by which interpolation can be
// steeper than what it interpolates. Features thinner than a cell may be lost. Inside is where
// the mesh winds about a point, in either sense. Refused: an open mesh, more than 2^24 cells.
Result<ShapePtr> make_mesh_shape(const Mesh& mesh, double cell_mm);

// How often the mesh winds about a point: not 0 if it encloses it. For tests and make_mesh_shape();
// counts the crossings of a ray along +x, each edge for one of its two triangles.
int winding_number(const Mesh& mesh, glm::dvec3 p);

// The distance from a point to a triangle.
double triangle_distance(glm::dvec3 p, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c);

// Whether every edge is used as often in one direction as in the other.
bool is_closed(const Mesh& mesh);

} // namespace palpate
