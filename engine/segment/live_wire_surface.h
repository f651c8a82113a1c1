#pragma once

#include <span>

#include "engine/segment/seeds.h"
#include "engine/segment/task.h"

namespace palpate {

// A closed discrete surface through closed curves drawn freely in the volume, and the body within.
//
// Nystroem et al. 2008 (section 4, figure 8) connect live-wire curves to a discrete surface and
// state no algorithm; the work they cite (Malmberg, Vidholm & Nystroem 2006) connects two curves.
// Here any number of curves that cross each other is connected, in any planes or none:
// the crossings give the surface's normal on all curves (wire_bodies()), the smoothest function
// that is 0 on them and rises along the normals is found (SmoothInterpolant), and the samples on
// its inner side that share a face with its outer one are followed from the curves on. The image
// has its say in the curves alone.
//
// The surface's samples separate: no path over faces leads from a sample within to one outside that
// avoids them. The curves' samples are on it or beside it. What lies beyond the volume is outside.
struct LiveWireSurface {
    Volume surface; // u8 or u16: the label of the body whose surface a sample is on, else 0
    Volume labels;  // the surfaces and what they enclose; of two bodies the one of the lower label
};

// Refused, in one sentence: what wire_bodies() refuses, and curves whose surface does not close
// within half their extent about them. Memory: a byte a sample of the boxes of all bodies, and
// those of the interpolant, of kMostPlaces places.
constexpr size_t kMostPlaces = 800;
Result<LiveWireSurface> live_wire_surface(const Grid& grid, std::span<const WireCurve> curves,
                                          const Task& task);

} // namespace palpate
