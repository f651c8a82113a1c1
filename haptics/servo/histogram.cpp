#include "haptics/servo/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace palpate::haptics {

namespace {

// One thread writes, so that no exchange is needed.
void raise(std::atomic<uint64_t>& counter) {
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

} // namespace

uint32_t Histogram::bin_of(uint64_t value) noexcept {
    if (value < 2 * kSub)
        return static_cast<uint32_t>(value);
    const auto shift = static_cast<uint32_t>(std::bit_width(value)) - 6; // 32 .. 63 are left
    return 2 * kSub + (shift - 1) * kSub + static_cast<uint32_t>((value >> shift) - kSub);
}

uint64_t Histogram::upper_edge(uint32_t bin) noexcept {
    if (bin < 2 * kSub)
        return bin;
    const uint32_t shift = (bin - 2 * kSub) / kSub + 1;
    const uint64_t lead = (bin - 2 * kSub) % kSub + kSub;
    return (lead << shift) + ((uint64_t{1} << shift) - 1);
}

void Histogram::add(uint64_t value) noexcept {
    raise(bins_[bin_of(value)]);
    raise(count_);
    if (value > max_.load(std::memory_order_relaxed))
        max_.store(value, std::memory_order_relaxed);
}

uint64_t Histogram::percentile(double share) const noexcept {
    uint64_t total = 0;
    for (const auto& bin : bins_)
        total += bin.load(std::memory_order_relaxed);
    if (total == 0)
        return 0;
    const auto wanted = static_cast<uint64_t>(std::ceil(share * static_cast<double>(total)));
    uint64_t below = 0;
    for (uint32_t bin = 0; bin < bins_.size(); ++bin) {
        below += bins_[bin].load(std::memory_order_relaxed);
        if (below >= wanted && below > 0)
            return std::min(upper_edge(bin), max());
    }
    return max();
}

} // namespace palpate::haptics
