#include "engine/surface_gpu/range_allocator.h"

#include <iterator>

#include "engine/base/assert.h"

namespace palpate {

RangeAllocator::RangeAllocator(uint32_t capacity, uint32_t quantum)
    : capacity_(capacity / quantum * quantum), quantum_(quantum) {
    if (capacity_ > 0)
        add(0, capacity_);
}

void RangeAllocator::add(uint32_t first, uint32_t length) {
    by_first_.emplace(first, length);
    by_length_.emplace(length, first);
}

void RangeAllocator::remove(std::map<uint32_t, uint32_t>::iterator range) {
    by_length_.erase({range->second, range->first});
    by_first_.erase(range);
}

std::optional<uint32_t> RangeAllocator::take(uint32_t count) {
    PALPATE_ASSERT(count > 0);
    const uint32_t length = rounded(count);
    const auto found = by_length_.lower_bound({length, 0});
    if (found == by_length_.end())
        return std::nullopt;
    const auto [free, first] = *found;
    remove(by_first_.find(first));
    if (free > length)
        add(first + length, free - length);
    taken_ += length;
    return first;
}

void RangeAllocator::give(uint32_t first, uint32_t count) {
    uint32_t length = rounded(count);
    taken_ -= length;
    const auto after = by_first_.lower_bound(first);
    PALPATE_ASSERT(after == by_first_.end() || first + length <= after->first);
    if (after != by_first_.begin()) {
        const auto before = std::prev(after);
        PALPATE_ASSERT_CMP(before->first + before->second, <=, first);
        if (before->first + before->second == first) {
            first = before->first;
            length += before->second;
            remove(before);
        }
    }
    if (after != by_first_.end() && first + length == after->first) {
        length += after->second;
        remove(after);
    }
    add(first, length);
}

} // namespace palpate
