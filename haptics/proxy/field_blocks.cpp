// The cache of a Field: blocks of 4x4x4 cells of its views; declared in field.h.

#include <cmath>

#include "haptics/proxy/field.h"
#include "haptics/proxy/samples.h"
#include "haptics/proxy/spline_place.h"

namespace palpate::haptics {

namespace {

// Convolves kCount outputs with kTaps taps along one axis of a box; slabs of kRun values.
template <int kCount, int kTaps, int kRun>
void convolve(const float* from, float* to, int outer_count, const float* taps) {
    constexpr int kRead = kCount + kTaps - 1;
    for (int outer = 0; outer < outer_count; ++outer)
        for (int i = 0; i < kCount; ++i) {
            const float* source = from + kRun * (i + kRead * outer);
            float* target = to + kRun * (i + kCount * outer);
            int r = 0;
            for (; r + 4 <= kRun; r += 4) {
                Four total = taps[0] * load(source + r);
                for (int k = 1; k < kTaps; ++k)
                    total += taps[k] * load(source + r + k * kRun);
                store(target + r, total);
            }
            for (; r < kRun; ++r) {
                float total = taps[0] * source[r];
                for (int k = 1; k < kTaps; ++k)
                    total += taps[k] * source[r + k * kRun];
                target[r] = total;
            }
        }
}

// A box of kSide + kTaps - 1 samples on each axis becomes one of kSide.
template <int kSide, int kTaps>
void filter_box(const float* in, const float* taps_x, const float* taps_y, const float* taps_z,
                float* out) {
    constexpr int kRead = kSide + kTaps - 1;
    std::array<float, kSide * kRead * kRead> z;
    std::array<float, kSide * kSide * kRead> zy;
    convolve<kSide, kTaps, kRead * kRead>(in, z.data(), 1, taps_z);
    convolve<kSide, kTaps, kRead>(z.data(), zy.data(), kSide, taps_y);
    // Along x four neighbours at a time, the last four overlapping.
    for (int row = 0; row < kSide * kSide; ++row)
        for (int x = 0;; x = kSide - 4) {
            const float* source = zy.data() + kRead * row + x;
            Four total = taps_x[0] * load(source);
            for (int k = 1; k < kTaps; ++k)
                total += taps_x[k] * load(source + k);
            store(out + kSide * row + x, total);
            if (x == kSide - 4)
                break;
        }
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
        ++made_parts_;
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
    const float *x = filter.taps[0].data(), *y = filter.taps[1].data(), *z = filter.taps[2].data();
    float* out = part == kSmoothPart ? block.smooth.data() : block.sharp.data();
    if (filter.reach == 1)
        filter_box<kSpline, 3>(samples.data(), x, y, z, out);
    else if (filter.reach == 2)
        filter_box<kSpline, 5>(samples.data(), x, y, z, out);
    else if (filter.reach == 3)
        filter_box<kSpline, 7>(samples.data(), x, y, z, out);
    else
        filter_box<kSpline, 2 * Filter::kMostReach + 1>(samples.data(), x, y, z, out);
}

Field::Block& Field::block(glm::ivec3 position, Part part) {
    const glm::ivec3 slot = position & (kTable - 1);
    Block& block = blocks_[static_cast<size_t>(slot.x + kTable * (slot.y + kTable * slot.z))];
    if (block.made[part].generation != generation_ || block.position != position)
        renew(block, position, part);
    lacked_brick_ |= block.made[part].lacks;
    return block;
}

} // namespace palpate::haptics
