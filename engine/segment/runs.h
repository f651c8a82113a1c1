#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "engine/segment/bit_mask.h"

namespace palpate {

// Samples begin .. end - 1 of one row, which carry one label.
struct LabelRun {
    uint32_t begin, end;
    uint16_t label; // of its first sample
};

// The runs of a label map, row by row, and which of them are connected.
class LabelRuns {
 public:
    // The kinds that are told apart: equal numbers are joined, 0 is in no run.
    using Kind = std::function<uint16_t(uint16_t label)>;

    // False where it was stopped: then nothing is known.
    bool find(const Volume& labels, const Kind& kind, Neighbours neighbours, const Task& task);

    const std::vector<LabelRun>& runs() const { return runs_; }
    // The runs of row (y, z): from the first number up to the second, not included.
    std::pair<uint32_t, uint32_t> row(uint32_t y, uint32_t z) const;
    // For each run the first run of its component.
    const std::vector<uint32_t>& roots() const { return roots_; }
    glm::uvec3 first_sample(uint32_t run) const;

 private:
    glm::uvec3 size_{};
    std::vector<LabelRun> runs_;
    std::vector<uint16_t> kinds_;
    std::vector<uint32_t> first_of_row_; // one more than rows
    std::vector<uint32_t> roots_;
};

} // namespace palpate
