#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>

#include "engine/volume/brick_source.h"
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

using BlockRanges = std::array<ValueRange, kBlocksPerBrick>;
using BlockStamps = std::array<uint64_t, kBlocksPerBrick>;

// The samples of a brick, in memory for as long as this lives: kBrickSamples of them, x fastest, or
// one for a constant brick. Name it before taking its data().
template <class T>
class BrickSamples {
 public:
    BrickSamples(const T* data, uint32_t size, SamplesPtr keep)
        : data_(data), size_(size), keep_(std::move(keep)) {}
    const T* data() const& { return data_; }
    const T* data() && = delete; // would outlive the samples
    uint32_t size() const { return size_; }
    T operator[](uint32_t i) const { return data_[i]; }
    const T* begin() const& { return data_; }
    const T* end() const& { return data_ + size_; }

 private:
    const T* data_;
    uint32_t size_;
    SamplesPtr keep_; // null where the brick itself holds them
};

// 32x32x32 samples of one type, immutable once made and shared between snapshots.
//
// Type, ranges and no-data count are always in memory. The samples may lie in a BrickSource, such
// as a file, and are then fetched when they are read.
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

    // make() for the result of an edit of `before`: unchanged blocks keep their stamps. Null if no
    // block changed.
    template <class T>
    static std::shared_ptr<const Brick> make_after(const Brick& before, std::span<const T> samples,
                                                   glm::uvec3 valid);

    // A brick that is not constant, with samples in `source` under `key`. The ranges and counts
    // passed must be those that make() would find.
    struct Known {
        ScalarType type;
        std::shared_ptr<const BlockRanges> block_ranges;
        uint32_t no_data_count;
    };
    static std::shared_ptr<const Brick> in_source(std::shared_ptr<const BrickSource> source,
                                                  uint64_t key, Known known);
    bool is_in_source() const { return source_ != nullptr; }

    ScalarType type() const { return type_; }
    bool is_constant() const { return stride_ == 0; }

    // No-data reads as NaN. offset < kBrickSamples.
    float value(uint32_t offset) const;

    // One sample if constant, else kBrickSamples. T must be the stored type. Reading a brick whose
    // samples lie in a source throws what the source throws.
    template <class T>
    BrickSamples<T> samples() const {
        Pinned pinned = pin();
        return {reinterpret_cast<const T*>(pinned.bytes), is_constant() ? 1 : kBrickSamples,
                std::move(pinned.keep)};
    }

    // The same without a type: value(), for many samples of one brick.
    struct Pinned {
        const std::byte* bytes = nullptr;
        SamplesPtr keep;
    };
    Pinned pin() const {
        if (!source_)
            return {samples_.get(), nullptr};
        SamplesPtr keep = source_->fetch(key_);
        const std::byte* bytes = keep.get();
        return {bytes, std::move(keep)};
    }
    float value(const Pinned& pinned, uint32_t offset) const;

    // Expands to kBrickSamples values of T, converted; T must hold every value of the stored type.
    template <class T>
    void read(std::span<T> samples) const;

    ValueRange range() const { return range_; }
    ValueRange block_range(uint32_t block) const {
        return block_ranges_ ? (*block_ranges_)[block] : range_;
    }
    // Two bricks with the same stamp for a block have the same samples there (the converse need not
    // hold). Never 0, never reused. For caches that cannot keep bricks alive.
    uint64_t block_stamp(uint32_t block) const {
        return block_stamps_ ? (*block_stamps_)[block] : stamp_;
    }
    uint32_t no_data_count() const { return no_data_count_; } // within the volume, padding apart
    size_t bytes() const; // memory this brick holds; a source's apart

    // Blocks whose samples (padding included) differ in any bit between two bricks of one type:
    // bit b stands for block b.
    friend uint64_t differing_blocks(const Brick& a, const Brick& b);

    // 0 for a constant brick, 1 else: samples()[stride() * offset] is the sample at offset.
    uint32_t stride() const { return stride_; }

 private:
    struct Free {
        void operator()(std::byte* p) const;
    };
    template <class T>
    static std::shared_ptr<Brick> make_new(std::span<const T> samples, glm::uvec3 valid);
    static uint64_t next_stamp();

    ScalarType type_ = ScalarType::u8;
    uint32_t stride_ = 0;
    uint32_t no_data_count_ = 0;
    ValueRange range_;
    std::unique_ptr<std::byte[], Free> samples_;
    std::shared_ptr<const BlockRanges> block_ranges_; // null if constant
    std::shared_ptr<const BrickSource> source_;       // null where samples_ has them
    uint64_t key_ = 0;                                // in the source
    uint64_t stamp_ = next_stamp();
    std::shared_ptr<const BlockStamps> block_stamps_; // null where all are stamp_
};

uint64_t differing_blocks(const Brick& a, const Brick& b);

using BrickPtr = std::shared_ptr<const Brick>;

} // namespace palpate
