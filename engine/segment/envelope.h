#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

// 32 lines side by side, and along each the lower envelope of parabolas.
//
// `squared` has a squared distance of each sample to samples of other labels in earlier axes
// (infinite where there is none). Results are those also with the parabolas of the samples on its
// line: result(i) = min over j of squared(j) + weight (i - j)^2, j of the same run of one label,
// and weight (i - j)^2 for the samples that end the run.
//
// Each sample looks for its lowest parabola outward from its place, in blocks of rows, all lines at
// once. A block is passed over where its least squared distance, raised by the way to its nearest
// row, is no lower than what is known: the lowest parabola found so far, and what the row before
// allows, since the distance of neighbours differs by their spacing at most.
class EnvelopeTile {
 public:
    static constexpr size_t kLanes = 32;

    struct Lines {
        const float* squared; // row i, the samples i of all lines, begins at i * squared_stride
        size_t squared_stride;
        const int32_t* labels; // likewise
        size_t labels_stride;
        size_t n; // samples of each line, >= 1
    };
    // `weight` > 0 is the squared spacing along the lines; results above `limit` become it.
    void lower(const Lines& lines, float weight, float limit);
    const float* result(size_t i) const { return result_.data() + i * kLanes; }

 private:
    std::vector<float> result_;
    std::vector<float> least_; // of each block of rows, and last of all rows
};

} // namespace palpate
