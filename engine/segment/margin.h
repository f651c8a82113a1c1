#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "engine/segment/task.h"

namespace palpate {

// Which labels a margin or a wall is made of, and what they may take.
struct ChangedLabels {
    std::optional<uint16_t> label; // without one each label apart, all at once
    // A label alone also takes samples of other labels, not of 0 alone.
    bool overwrite = false;
    std::span<const uint16_t> locked{}; // labels that neither lose nor gain a sample
};

// Grows labels by by_mm > 0, or shrinks them by as much < 0, on any grid with perpendicular axes.
// A sample joins whose centre is at most that far from the centre of one of the label's (to 1e-6
// of it); one stays that is farther than that from every sample outside its label. That is
// morphology() by a ball, and the border of the volume is no border of a label.
//
// Among labels that reach a sample the nearest takes it, and of equally near ones the lowest; so
// labels that grow meet half-way and do not overlap. Labels that touch shrink from each other.
//
// The result has the type of the map; NaN is 0; bricks that do not change stay shared. Refused:
// values that are no labels, 0 mm, label 0, a label that is locked. Memory: 8 bytes a sample of the
// largest label's box and its margin, and 8 a sample of the bricks that change.
Result<Volume> margin(const Volume& labels, double by_mm, const ChangedLabels& which,
                      const Task& task);

// The wall between a label and what is around it: within the label, outside of it, or half on each
// side of its border.
enum class Wall { inside, middle, outside };

// Hollows labels: what stays of each is a wall of that thickness (mm, > 0), by the distances and
// rules of margin(). The rest of the label becomes 0. Refused, too: a wall that does not reach from
// one sample to the next on any axis, where nothing would be left.
Result<Volume> hollow(const Volume& labels, double thickness_mm, Wall wall,
                      const ChangedLabels& which, const Task& task);

} // namespace palpate
