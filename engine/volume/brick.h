#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>

#include "engine/volume/scalar.h"

namespace palpate {

constexpr uint32_t kBrickSide = 32;                                      // samples
constexpr uint32_t kBrickSamples = kBrickSide * kBrickSide * kBrickSide; // 32768
constexpr uint32_t kBlockSide = 8;                                       // samples
constexpr uint32_t kBlocksPerSide = kBrickSide / kBlockSide;             // 4
constexpr uint32_t kBlocksPerBrick = 64;

// Position of sample `local` (each component < 32) within a brick: x fastest.
constexpr uint32_t offset_in_brick(glm::uvec3 local) {
    return local.x + kBrickSide * (local.y + kBrickSide * local.z);
}

// Number of the 8x8x8 block that holds sample `local`: 0 .. 63, x fastest.
constexpr uint32_t block_of(glm::uvec3 local) {
    return local.x / kBlockSide +
           kBlocksPerSide * (local.y / kBlockSide + kBlocksPerSide * (local.z / kBlockSide));
}

// 32x32x32 samples of one type, immutable once made and shared between snapshots.
//
// A brick of one value stores that value once. Where a volume's size is no multiple of 32, the
// samples beyond it repeat the nearest sample inside and count in no range. No-data is NaN.
class Brick {
 public:
    // Samples in x-fastest order; exactly kBrickSamples of them, or 1 for a constant brick.
    // `valid` is how many samples on each axis lie inside the volume: 1 .. 32; padding beyond is
    // overwritten. Infinities become NaN. A brick whose samples are all equal becomes constant.
    template <class T>
    static std::shared_ptr<const Brick> make(std::span<const T> samples,
                                             glm::uvec3 valid = glm::uvec3(kBrickSide));

    ScalarType type() const { return type_; }
    bool is_constant() const { return stride_ == 0; }

    // No-data reads as NaN. offset < kBrickSamples.
    float value(uint32_t offset) const;

    // One sample if constant, else kBrickSamples. T must be the stored type.
    template <class T>
    std::span<const T> samples() const {
        return {reinterpret_cast<const T*>(samples_.get()), is_constant() ? 1 : kBrickSamples};
    }

    // Expands to kBrickSamples values of T, converted; T must hold every value of the stored type.
    template <class T>
    void read(std::span<T> samples) const;

    ValueRange range() const { return range_; }
    ValueRange block_range(uint32_t block) const {
        return block_ranges_ ? (*block_ranges_)[block] : range_;
    }
    uint32_t no_data_count() const { return no_data_count_; } // within the volume, padding apart
    size_t bytes() const;                                     // memory this brick holds

    // Blocks whose samples (padding included) differ in any bit between two bricks of one type:
    // bit b stands for block b.
    friend uint64_t differing_blocks(const Brick& a, const Brick& b);

    // 0 for a constant brick, 1 else: samples()[stride() * offset] is the sample at offset.
    uint32_t stride() const { return stride_; }

 private:
    struct Free {
        void operator()(std::byte* p) const;
    };
    ScalarType type_ = ScalarType::u8;
    uint32_t stride_ = 0;
    uint32_t no_data_count_ = 0;
    ValueRange range_;
    std::unique_ptr<std::byte[], Free> samples_;
    std::unique_ptr<std::array<ValueRange, kBlocksPerBrick>> block_ranges_; // null if constant
};

uint64_t differing_blocks(const Brick& a, const Brick& b);

using BrickPtr = std::shared_ptr<const Brick>;

} // namespace palpate
