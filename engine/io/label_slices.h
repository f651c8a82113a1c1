#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

namespace palpate::io {

// A label map as the slices of another grid whose samples are where its own are: of the same
// spacing, with axes that may be exchanged or reversed, and of another extent.
class LabelSlices {
 public:
    // An error, without a name before it, where samples are of another type than u8 and u16, or lie
    // more than a twentieth of the spacing off those of `grid`.
    static Result<LabelSlices> make(const Volume& labels, const Grid& grid);

    // The slices of `grid` in which the label map has samples, also beyond its ends.
    int64_t first() const { return first_; }
    int64_t last() const { return last_; }

    // Fills one of them, x fastest; 0 where the label map has no sample. Returns how many samples
    // with a label lie beyond the ends of the grid.
    uint64_t read(int64_t slice, std::vector<uint16_t>& out) const;

    // Calls visit(slice, samples, labels) for each slice that has labels, which are told by rising
    // number. An error, with a name before it, where there is none, where samples with a label lie
    // beyond the grid, and where it was stopped.
    using Visit = std::function<void(uint32_t slice, std::span<const uint16_t> samples,
                                     const std::vector<uint16_t>& labels)>;
    Result<void> visit(const std::string& name, const std::stop_token& stop,
                       const Visit& visit) const;

 private:
    LabelSlices(const Volume& labels, glm::uvec3 size) : labels_(labels), size_(size) {}

    Volume labels_;
    glm::uvec3 size_;           // of the grid
    std::array<int, 3> axis_{}; // of the grid, for each of the label map's axes
    glm::ivec3 sign_{};         // along which it runs, by axis of the label map
    glm::dvec3 start_{};        // where sample 0 0 0 of the label map is in the grid: whole numbers
    int64_t first_ = 0, last_ = 0;
};

} // namespace palpate::io
