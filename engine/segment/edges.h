#pragma once

#include "engine/segment/task.h"
#include "engine/volume/volume.h"

namespace palpate {

// Length of the gradient at each sample, in value units per world mm: f32 on the volume's grid.
// Central differences, one-sided at faces and beside samples without data; no data where the
// sample has none. Any grid, sheared too. No smoothing: edges of noise are edges.
Result<Volume> edge_strength(const Volume& volume, const Task& task);

} // namespace palpate
