#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/volume/volume.h"

namespace palpate {

// Labels of a box of samples, x fastest; -1 beyond the volume. What operations on neighbourhoods
// read: a piece of S' at a time.
struct LabelBox {
    glm::ivec3 low{0}, size{0};
    std::vector<int32_t> values;

    int32_t* row(int y, int z) { return values.data() + size_t(size.x) * (y + size_t(size.y) * z); }
    size_t at(glm::ivec3 index) const {
        const glm::ivec3 i = index - low;
        return i.x + size_t(size.x) * (i.y + size_t(size.y) * i.z);
    }
};

// Samples low .. high, both included; may reach beyond the volume, which holds u8 or u16.
LabelBox read_labels(const Volume& volume, glm::ivec3 low, glm::ivec3 high);

// A label map of u8 as one of u16, which holds every label, 0 .. 65535: the same samples in a later
// snapshot. A map of u16 is returned as it is. Reads every brick, on all cores.
Volume as_u16_labels(const Volume& labels);

} // namespace palpate
