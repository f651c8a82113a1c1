#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace palpate::haptics {

// Counts of whole numbers, one thread adding, any thread reading meanwhile, without a lock.
//
// Numbers below 64 have a bin each; beyond, every power of two has 32, so a percentile is at most
// 1 / 32 above the truth. The largest is kept exactly.
class Histogram {
 public:
    void add(uint64_t value) noexcept;
    uint64_t count() const noexcept { return count_.load(std::memory_order_relaxed); }
    uint64_t max() const noexcept { return max_.load(std::memory_order_relaxed); }
    // The upper edge of the bin below or in which `share` of all lie, at most max(); 0 where there
    // are none.
    uint64_t percentile(double share) const noexcept;

 private:
    static constexpr uint32_t kSub = 32;
    static uint32_t bin_of(uint64_t value) noexcept;
    static uint64_t upper_edge(uint32_t bin) noexcept;
    std::array<std::atomic<uint64_t>, 64 + 58 * kSub> bins_{};
    std::atomic<uint64_t> count_{0}, max_{0};
};

} // namespace palpate::haptics
