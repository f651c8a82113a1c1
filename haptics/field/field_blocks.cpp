// The cache of a Field: blocks of 4x4x4 cells of its views; declared in field.h.

#include <algorithm>
#include <cstring>

#include "engine/base/clones.h"
#include "haptics/field/field.h"
#include "haptics/field/samples.h"
#include "haptics/field/spline_place.h"

namespace palpate::haptics {

namespace {

// Eight floats at once: two registers, or one with AVX2 (clones.h).
using Eight = float __attribute__((vector_size(32)));

// Convolves kCount outputs with kTaps taps along one axis of a box; slabs of kRun values, eight or
// more. The last eight of a slab overlap those before.
template <int kCount, int kTaps, int kRun>
[[gnu::always_inline]] inline void convolve(const float* from, float* to, int outer_count,
                                            const std::array<float, kTaps>& taps) {
    constexpr int kRead = kCount + kTaps - 1;
    static_assert(kRun >= 8);
    for (int outer = 0; outer < outer_count; ++outer)
        for (int i = 0; i < kCount; ++i) {
            const float* source = from + kRun * (i + kRead * outer);
            float* target = to + kRun * (i + kCount * outer);
            for (int r = 0;; r = std::min(r + 8, kRun - 8)) {
                Eight row;
                std::memcpy(&row, source + r, sizeof row);
                Eight total = taps[0] * row;
                for (int k = 1; k < kTaps; ++k) {
                    std::memcpy(&row, source + r + k * kRun, sizeof row);
                    total += taps[size_t(k)] * row;
                }
                std::memcpy(target + r, &total, sizeof total);
                if (r == kRun - 8)
                    break;
            }
        }
}

// A box of kSide + kTaps - 1 samples on each axis becomes one of kSide.
template <int kSide, int kTaps>
[[gnu::always_inline]] inline void filter_box(const float* in, const Filter& filter, float* out) {
    constexpr int kRead = kSide + kTaps - 1;
    std::array<float, kSide * kRead * kRead> z;
    std::array<float, kSide * kSide * kRead> zy;
    std::array<std::array<float, kTaps>, 3> taps;
    for (size_t axis = 0; axis < 3; ++axis)
        std::copy_n(filter.taps[axis].begin(), kTaps, taps[axis].begin());
    convolve<kSide, kTaps, kRead * kRead>(in, z.data(), 1, taps[2]);
    convolve<kSide, kTaps, kRead>(z.data(), zy.data(), kSide, taps[1]);
    // Along x four neighbours at a time, the last four overlapping.
    for (int row = 0; row < kSide * kSide; ++row)
        for (int x = 0;; x = kSide - 4) {
            const float* source = zy.data() + kRead * row + x;
            Four total = taps[0][0] * load(source);
            for (int k = 1; k < kTaps; ++k)
                total += taps[0][size_t(k)] * load(source + k);
            store(out + kSide * row + x, total);
            if (x == kSide - 4)
                break;
        }
}

constexpr int kSide = SplinePlace::kSide;
PALPATE_CLONES void filter_1(const float* in, const Filter& filter, float* out) {
    filter_box<kSide, 3>(in, filter, out);
}
PALPATE_CLONES void filter_2(const float* in, const Filter& filter, float* out) {
    filter_box<kSide, 5>(in, filter, out);
}
PALPATE_CLONES void filter_3(const float* in, const Filter& filter, float* out) {
    filter_box<kSide, 7>(in, filter, out);
}
PALPATE_CLONES void filter_5(const float* in, const Filter& filter, float* out) {
    filter_box<kSide, 11>(in, filter, out);
}

} // namespace

// The samples that a part is made of: their first, and how many on each axis.
Field::Box Field::box_of(glm::ivec3 position, Part part) const {
    const int reach = filter_of(part).reach;
    return {kBlock * position - 1 - reach, kSpline + 2 * reach};
}

// A hash of the stamps of everything in a box; never 0. Two sets of stamps share it once in 2^64.
uint64_t Field::stamps_of(Box box) const {
    uint64_t hash = 1;
    const glm::ivec3 low = glm::max(box.start, glm::ivec3(0));
    const glm::ivec3 high = glm::min(box.start + box.side, glm::ivec3(volume_->size())) - 1;
    for (int z = low.z >> 3; z <= high.z >> 3; ++z)
        for (int y = low.y >> 3; y <= high.y >> 3; ++y)
            for (int x = low.x >> 3; x <= high.x >> 3; ++x) {
                const glm::uvec3 at = glm::uvec3(x, y, z) * kBlockSide;
                const Brick& brick = volume_->brick(at / kBrickSide);
                hash = (hash ^ brick.block_stamp(block_of(at % kBrickSide))) * 0x9e3779b97f4a7c15u;
                hash ^= hash >> 29;
            }
    return hash ? hash : 1;
}

uint64_t Field::stamps_about(glm::dvec3 at_mm, double reach_samples) const {
    constexpr double kMostReach = 24.0;
    const glm::dvec3 at = index_of(at_mm);
    if (!volume_ || !(glm::length(at) < kFarthest) || !(reach_samples < kMostReach))
        return generation_ | uint64_t{1} << 63;
    // A cell's corners, the spline's and the filters' samples.
    const int reach = static_cast<int>(reach_samples) + 3 + Filter::kMostReach;
    const uint64_t stamps = stamps_of({glm::ivec3(glm::floor(at)) - reach, 2 * reach + 1});
    return (stamps ^ settings_ * 0x9e3779b97f4a7c15u) | 1;
}

void Field::renew(Block& block, glm::ivec3 position, Part part) {
    if (block.position != position || block.settings != settings_) {
        block.position = position;
        block.settings = settings_;
        block.made = {};
    }
    Made& made = block.made[part];
    const Box box = box_of(position, part);
    const uint64_t stamps = stamps_of(box);
    if (made.stamps != stamps) {
        fill(block, box, part);
        made.stamps = stamps;
        filtered_samples_ += static_cast<uint32_t>(box.side * box.side * box.side);
    }
    made.generation = generation_;
}

void Field::fill(Block& block, Box box, Part part) {
    constexpr int kMostRead = kSpline + 2 * Filter::kMostReach;
    std::array<float, kMostRead * kMostRead * kMostRead> samples;
    block.made[part].lacks =
        copy_resident(*volume_, box.start, glm::ivec3(box.side), lowest_, samples.data());
    stored_.make({samples.data(), static_cast<size_t>(box.side * box.side * box.side)});
    const Filter& filter = filter_of(part);
    const auto apply = filter.reach == 1   ? filter_1
                       : filter.reach == 2 ? filter_2
                       : filter.reach == 3 ? filter_3
                                           : filter_5;
    apply(samples.data(), filter, part == kSmoothPart ? block.smooth.data() : block.sharp.data());
}

// A set has two blocks, of which the first was made later. Blocks of any box that is kTable wide
// stay, and so do those of two places farther apart: with one block a set, a ball wider than the
// table was held at two ends whose blocks displaced each other in each look.
Field::Block& Field::block(glm::ivec3 position, Part part) {
    constexpr int kSets = kTable / 2; // along z
    const glm::ivec3 slot = position & glm::ivec3(kTable - 1, kTable - 1, kSets - 1);
    Block* set = &blocks_[2 * static_cast<size_t>(slot.x + kTable * (slot.y + kTable * slot.z))];
    const auto is_right = [&](const Block& block) {
        return block.made[part].generation == generation_ && block.position == position;
    };
    Block* block = set;
    if (!is_right(*block)) {
        if (set[1].position == position) {
            block = set + 1;
        } else if (set[0].position != position) {
            set[1] = set[0];
        }
        if (!is_right(*block))
            renew(*block, position, part);
    }
    lacked_brick_ |= block->made[part].lacks;
    return *block;
}

} // namespace palpate::haptics
