#pragma once

#include <glm/glm.hpp>

#include "engine/volume/volume.h"

// Samples of a volume as the servo thread may read them: bricks in memory only, nothing allocated,
// locked or thrown.
namespace palpate::haptics {

// The sample at `index`; NaN where there is none: beyond the volume, without data, or in a brick
// that is not in memory.
float resident_sample(const Volume& volume, glm::ivec3 index);

// The trilinear interpolant at a point of index space, NaN where a corner is NaN. The same bits as
// trilinear() where all is in memory.
double resident_trilinear(const Volume& volume, glm::dvec3 index);

// Central differences of it, one sample to each side, in value units per sample; NaN likewise.
glm::dvec3 resident_gradient(const Volume& volume, glm::dvec3 index);

// Copies the box [start, start + size) to `out`, x fastest. What is not there becomes `missing`,
// and what has no data, too. Returns whether any brick was not in memory.
bool copy_resident(const Volume& volume, glm::ivec3 start, glm::ivec3 size, float missing,
                   float* out);

// Whether any sample of the box [low, high] (index space, both ends included) is in the volume and
// has no data, or is not in memory. In bricks without no-data it costs some ns, else about 1 ns a
// sample.
bool lacks_data(const Volume& volume, glm::ivec3 low, glm::ivec3 high);
// The same where only no-data counts; of a brick that is not in memory, any of it.
bool has_no_data(const Volume& volume, glm::ivec3 low, glm::ivec3 high);

// A range that holds every sample in the box [low, high] (index space, both ends included): that of
// the blocks of 8x8x8 samples it has a part in. Empty where it has none. `lacks_some`: some of the
// box may be beyond the volume or without data.
ValueRange range_about(const Volume& volume, glm::ivec3 low, glm::ivec3 high, bool& lacks_some);

} // namespace palpate::haptics
