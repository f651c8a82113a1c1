#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/segment/task.h"

namespace palpate {

// Which samples are joined: those that share a face; a face or an edge; a face, an edge or a
// corner.
enum class Neighbours : int { faces = 6, edges = 18, corners = 26 };

// A set of samples, a bit for each, rows along x in words of 64.
class BitMask {
 public:
    explicit BitMask(glm::uvec3 size)
        : size_(size), words_((size.x + 63) / 64), bits_(words_ * size.y * size.z, 0) {}

    glm::uvec3 size() const { return size_; }
    size_t words() const { return words_; } // of a row
    uint64_t* row(size_t y, size_t z) { return bits_.data() + words_ * (y + size_.y * z); }
    const uint64_t* row(size_t y, size_t z) const {
        return bits_.data() + words_ * (y + size_.y * z);
    }
    bool has(glm::uvec3 at) const { return row(at.y, at.z)[at.x / 64] >> at.x % 64 & 1; }
    // The bits of the last word of a row that stand for samples.
    uint64_t last_word() const { return ~uint64_t{0} >> (words_ * 64 - size_.x); }

    friend bool operator==(const BitMask&, const BitMask&) = default;

 private:
    glm::uvec3 size_;
    size_t words_;
    std::vector<uint64_t> bits_;
};

// Samples of a label map that have `label`; without one those that are not 0. Nothing where it was
// stopped, likewise below.
std::optional<BitMask> mask_of(const Volume& labels, std::optional<uint16_t> label,
                               const Task& task);

// A row of a structuring element: the samples -half .. half along x, at (y, z) from the middle.
struct ElementRow {
    int y, z, half;
};
// A sample and its neighbours; and the samples whose centres are at most reach_mm from its own.
std::vector<ElementRow> element_of(Neighbours neighbours);
constexpr double kOnTheBall = 1.0 + 1e-6; // a reach that holds what is a rounding farther
std::vector<ElementRow> ball_of(glm::dvec3 spacing_mm, double reach_mm);

// Grows a set by an element about each of its samples, or takes those away whose element leaves the
// set. The element is symmetric. Beyond the volume there is nothing to grow from, and nothing that
// erodes. 64 samples at once; time grows with the element's rows.
std::optional<BitMask> dilated(const BitMask& mask, std::span<const ElementRow> element,
                               const Task& task);
std::optional<BitMask> eroded(const BitMask& mask, std::span<const ElementRow> element,
                              const Task& task);

// The set as a volume of 0 and 1.
Result<Volume> volume_of(const BitMask& mask, const Grid& grid, const Task& task);

} // namespace palpate
