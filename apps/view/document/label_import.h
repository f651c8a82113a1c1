#pragma once

#include <stop_token>

#include "engine/base/error.h"
#include "engine/io/volume_io.h"

namespace palpate::view {

// Whether two grids have their samples at the same places of the patient, within 2 % of a sample:
// in the same order, or along other axes, as other programs store them.
bool have_same_samples(const Grid& a, const Grid& b);

// A label map on the grid of a volume, on which it can be drawn and segmented: reordered where both
// have the same samples, else by the nearest ones, which a note tells. Refused: one that lies
// beside the volume.
Result<LoadedVolume> on_grid(LoadedVolume labels, const Grid& grid, const std::stop_token& stop);

} // namespace palpate::view
