#pragma once

#include <span>
#include <vector>

#include "engine/segment/live_wire.h"
#include "engine/segment/seeds.h"

// Closed curves on the surface of a body, and what they tell of the surface's normal.
namespace palpate {

// A place on the surface, with the surface's outward normal.
struct SurfacePoint {
    glm::dvec3 at_mm, normal;
};
// A body: the curves that meet each other, evened and cut into short steps.
struct WireBody {
    uint16_t label = 1;
    std::vector<std::vector<SurfacePoint>> curves; // closed, in the order of the input
};

// Two curves meet where they come within a sample's diagonal of each other, and cross where their
// directions differ by 12 degrees or more. Where they cross, the surface's normal is across both;
// along a curve it turns evenly about the curve from one crossing to the next. Of the two signs,
// those are taken that turn least, and in all those that point away from the curves' centre.
//
// Curves of one label that are joined by crossings make a body; bodies come in the order of their
// labels. Refused, in a sentence with the number of the curve in the input (from 1): ends farther
// apart than a sample's diagonal, fewer than three places, a point outside the volume, a curve
// around nothing, one that crosses no other.
Result<std::vector<WireBody>> wire_bodies(const Grid& grid, std::span<const WireCurve> curves);

// The curve through the same points on which each goes to the next along a live-wire, in the box of
// both and half their distance more (8 samples at least); where all points lie in a slice, within
// that. A wire of samples leaps from side to side of a sharp edge, which lies between them, and
// wanders along its surface. So the curve is the smooth one through the points (Catmull & Rom
// 1974), moved across the edge where the wire says that it lies elsewhere: not at all by half a
// sample, wholly by one and a half, and to where values change most (smoothed by a Gaussian of a
// sample). Refused: what wire_bodies() refuses of a single curve.
Result<WireCurve> along_edges(const Volume& volume, const WireCurve& curve,
                              const LiveWireOptions& options, const Task& task);

} // namespace palpate
