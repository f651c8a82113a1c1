#pragma once

#include "engine/volume/volume.h"

// Volumes for drawing: an axis with one sample has no extent between samples, so that neither a
// plane across it nor a ray meets anything.
namespace palpate {

// Whether an axis has one sample.
bool is_thin(const Grid& grid);

// Such an axis with two samples, half a spacing to either side of the one there was; other axes as
// they are. So the sampled box is as thick as the sample is wide.
Grid thickened(Grid grid);

// Both samples have the value of the one. Shares all bricks, whose padding repeats the last sample;
// has the version of `volume`.
Volume thickened(const Volume& volume);

} // namespace palpate
