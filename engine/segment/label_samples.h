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

// Calls visit(index) for each sample of a label of a label map, brick by brick.
template <class Visit>
void for_each_of_label(const Volume& labels, uint16_t label, const Visit& visit) {
    for_each_brick(labels, [&](glm::uvec3 position) {
        const Brick& brick = labels.brick(position);
        if (!(brick.range().max >= float(label)))
            return;
        const Brick::Pinned pinned = brick.pin();
        const glm::uvec3 valid = labels.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x)
                    if (brick.value(pinned, offset_in_brick({x, y, z})) == float(label))
                        visit(glm::ivec3(position * kBrickSide) + glm::ivec3(x, y, z));
    });
}

} // namespace palpate
