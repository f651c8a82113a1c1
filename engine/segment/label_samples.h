#pragma once

#include <cstdint>

#include "engine/base/error.h"
#include "engine/volume/box.h"

// Reading a volume as a label map: whole numbers 0 .. 65535, of any sample type.
namespace palpate {

// Refused: a volume with values outside 0 .. 65535. `name` begins the sentence.
Result<void> check_labels(const Volume& labels, const char* name);

// read_box() of a volume that check_labels() accepts, rows packed. No data is 0; values between two
// whole numbers are rounded down.
void read_labels(const Volume& labels, glm::ivec3 first, glm::ivec3 size, uint16_t* out);

// The same for samples beyond the volume, which are 0.
void read_labels_in_background(const Volume& labels, glm::ivec3 first, glm::ivec3 size,
                               uint16_t* out);

} // namespace palpate
