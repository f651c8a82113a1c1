#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace palpate {

// Which ranges of an array are taken: the smallest free one that suffices is given, of equal ones
// the first, and freed neighbours become one again. A function of what was asked, in its order.
class RangeAllocator {
 public:
    // Ranges are multiples of `quantum` long, and begin at one; so that what is freed fits again.
    RangeAllocator(uint32_t capacity, uint32_t quantum);

    // The first of `count` (at least 1) free elements; nothing where no range is long enough.
    std::optional<uint32_t> take(uint32_t count);
    // Frees the range that take(count) returned.
    void give(uint32_t first, uint32_t count);

    uint32_t capacity() const { return capacity_; }
    uint32_t taken() const { return taken_; } // rounded up to quanta

 private:
    uint32_t rounded(uint32_t count) const { return (count + quantum_ - 1) / quantum_ * quantum_; }
    void add(uint32_t first, uint32_t length);
    void remove(std::map<uint32_t, uint32_t>::iterator range);

    uint32_t capacity_, quantum_, taken_ = 0;
    std::map<uint32_t, uint32_t> by_first_;             // free: first to length
    std::set<std::pair<uint32_t, uint32_t>> by_length_; // the same: (length, first)
};

} // namespace palpate
