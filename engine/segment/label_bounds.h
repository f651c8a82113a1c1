#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "engine/segment/task.h"

namespace palpate {

// Samples low .. high on each axis, both included, by index.
struct IndexBox {
    glm::ivec3 low{}, high{};

    friend bool operator==(const IndexBox&, const IndexBox&) = default;
};

// The smallest box about the samples of each label of a label map that has any, but for 0. NaN is
// 0. Nothing where it was stopped.
std::optional<std::map<uint16_t, IndexBox>> label_bounds(const Volume& labels, const Task& task);

} // namespace palpate
