#pragma once

#include <span>

#include "engine/segment/seeds.h"
#include "engine/volume/volume.h"

namespace palpate {

// Seeds that lie on a blurred edge have values of neither side. This moves the seeds of a label
// from there to the side that they are on.
//
// A seed is on an edge where the gradient of `smooth` (the volume smoothed by (1 2 1) / 4 along
// each axis) is longer than that of noise: 0.5 standard deviations a sample, which 99 of 100
// samples of white noise stay below. The noise is that of the second differences beside the seeds.
// From there the steepest ways up and down lead to both sides, as long as the gradient becomes
// shorter. A seed is on the side whose value is nearer to its own; where noise may have decided
// that, by the sign of g . H g / |g|^2 + trace H (Verbeek & van Vliet 1994).
//
// Where the seeds of one ball then have values of two kinds (upper_kind), those of its centre's
// kind stay; of seeds in no ball, those of the more frequent kind. Balls of several kinds, such as
// white and grey matter, all count: that is what a person says by setting them. The result is a map
// of the label alone, on the seeds' grid.
Volume settled_seeds(const Volume& volume, const Volume& smooth, const Volume& seeds,
                     uint16_t label, std::span<const SeedBall> balls);

} // namespace palpate
