#pragma once

#include <cstdint>
#include <span>

#include "engine/segment/task.h"

namespace palpate {

// The samples that a label gets, from its own and a second set.
enum class LabelLogic {
    copy,      // the set
    add,       // its samples and those of the set
    subtract,  // its samples that are not of the set
    intersect, // its samples that are of the set
    invert,    // the samples of 0; its own become 0. No set
};

struct LabelLogicOptions {
    LabelLogic logic = LabelLogic::add;
    uint16_t label = 1; // that changes
    // The set: the samples of this label, without one those of all, in `other`, else in the map.
    uint16_t of = 0;
    const Volume* other = nullptr;      // a label map of the same size
    std::span<const uint16_t> locked{}; // labels that neither lose nor gain a sample
};

// A map with one label changed so. A sample has one label: one that joins leaves its own, and one
// that leaves becomes 0. In the map's own type, u16 where that does not hold the label; NaN is 0;
// bricks that do not change stay shared. Refused: values that are no labels, label 0, a label that
// is locked, another size. Memory: a brick of each for each thread.
Result<Volume> label_logic(const Volume& labels, const LabelLogicOptions& options,
                           const Task& task);

} // namespace palpate
