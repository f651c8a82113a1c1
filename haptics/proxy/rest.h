#pragma once

#include <glm/glm.hpp>

#include "haptics/field/triangles.h"

namespace palpate::haptics {

// How far off the faces a point stays: more than what floats round, for the same vertex comes out
// of two windows up to 4e-6 mm apart.
constexpr double kSkin_mm = 1e-4;

// The place where a point rests among triangles.
struct Rest {
    glm::dvec3 point{0.0}; // outside of all of them
    // Where it is felt: as far out as SurfacePoint::curved of what it touches.
    glm::dvec3 curved{0.0};
    glm::dvec3 face_normal{0.0}, shaded_normal{0.0};
    bool touching = false, reached_side = false;
    bool settled = false; // settle() found what it looks for
};

// Sweeps a point towards `goal` until it rests: from triangle to triangle (front sides alone
// hold), on each slid along up to three planes at once (planes.h), until it moves by less than
// 1e-7 mm. It stays up to 1e-4 mm off the faces, and never goes but where the way is free.
// Triangles are known within the box only; at its side, and where looks end, the point stops and
// `reached_side` is set.
Rest come_to_rest(const TriangleSpan& surface, glm::dvec3 from, glm::dvec3 goal, glm::dvec3 low,
                  glm::dvec3 high);

// The same place, kSkin_mm off the face next to it, for triangles that were taken anew: a point
// that reached the side of the last ones may be as near to a face as floats round, or behind it,
// and would slip under the next one's edge.
glm::dvec3 off_the_faces(const TriangleSpan& surface, glm::dvec3 point);

// A point at a place that touches the face nearest to it, or none where none is `within_mm`.
Rest rest_at(const TriangleSpan& surface, glm::dvec3 point, double within_mm);

// Between a face and what it bulges to, a goal that is free is touched, too: then the point on the
// face that is nearest to it; else the goal, free.
Rest rest_under_bulge(const TriangleSpan& surface, glm::dvec3 goal);

// From there on over the faces, every step swept, to where the goal lies straight under the curved
// surface along its blended normal: force shading (Ruspini, Kolarov & Khatib 1997) as a place, so
// that the force is a spring's still and as smooth as the normals are. Where the curved surface
// does not hold against the goal, nothing is touched, and it is felt at the goal. Steps of at most
// half of grain_mm.
Rest settle(const TriangleSpan& surface, Rest rest, glm::dvec3 goal, glm::dvec3 low,
            glm::dvec3 high, double grain_mm);

} // namespace palpate::haptics
