#include "engine/surface/block_reader.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

namespace palpate::block {

namespace {

// By way of a copy, which the compiler knows to lie apart from `out`: several samples at a time.
template <class T, int kCount>
[[gnu::always_inline]] inline void copy_as_floats(const T* in, float* out) {
    T samples[kCount];
    std::memcpy(samples, in, sizeof samples);
    float floats[kCount];
    for (int i = 0; i < kCount; ++i)
        floats[i] = static_cast<float>(samples[i]);
    std::memcpy(out, floats, sizeof floats);
}

} // namespace

BlockReader::BlockReader(const Volume& volume, bool closed_at_border)
    : volume_(volume), closed_(closed_at_border), size_(volume.size()) {}

void BlockReader::pin(int number) {
    Slot& s = slots_[number];
    if (s.is_pinned)
        return;
    const glm::ivec3 at = brick_ + glm::ivec3(number % 3, number / 3 % 3, number / 9) - 1;
    const Brick& brick = volume_.brick(glm::uvec3(at));
    s.pinned = brick.pin();
    s.stride = static_cast<int>(brick.stride());
    s.has_gaps = brick.no_data_count() > 0;
    s.is_pinned = true;
}

BlockReader::Axis BlockReader::axis_of(int axis, int first) const {
    Axis a;
    a.any_beyond = false;
    for (int i = 0; i < 11; ++i) {
        const int wanted = first - 1 + i;
        const int sample = std::clamp(wanted, 0, size_[axis] - 1);
        const int brick = sample / static_cast<int>(kBrickSide);
        a.slot[i] = brick - brick_[axis] + 1;
        a.local[i] = sample % static_cast<int>(kBrickSide);
        a.is_beyond[i] = sample != wanted;
        a.any_beyond = a.any_beyond || a.is_beyond[i];
    }
    return a;
}

void BlockReader::read(glm::ivec3 block, Samples& samples, const Rows& rows) {
    const glm::ivec3 first = block * kSide;
    // The brick whose samples the block reads most of: blocks before the volume belong to the
    // first.
    const glm::ivec3 brick =
        glm::clamp(first, glm::ivec3(0), size_ - 1) / static_cast<int>(kBrickSide);
    if (brick != brick_) {
        brick_ = brick;
        for (Slot& s : slots_)
            s = {};
    }
    const std::array<Axis, 3> axes{axis_of(0, first.x), axis_of(1, first.y), axis_of(2, first.z)};
    visit_scalar(volume_.type(), [&](auto t) { read_as<decltype(t)>(axes, samples, rows); });
}

template <class T>
void BlockReader::read_as(const std::array<Axis, 3>& axes, Samples& samples, const Rows& wanted) {
    const auto& [ax, ay, az] = axes;
    bool may_have_gaps = false;
    for (int z = az.slot[0]; z <= az.slot[10]; ++z)
        for (int y = ay.slot[0]; y <= ay.slot[10]; ++y)
            for (int x = ax.slot[0]; x <= ax.slot[10]; ++x) {
                pin(x + 3 * (y + 3 * z));
                may_have_gaps |= slots_[x + 3 * (y + 3 * z)].has_gaps;
            }
    // Samples 0 .. 7 of a row lie side by side, unless the block begins beyond the volume; padding
    // repeats the last sample where it ends within. Often the whole row does.
    const bool eight = !ax.is_beyond[1];
    const bool eleven = eight && ax.slot[0] == ax.slot[10] && !ax.any_beyond;
    // Gaps are looked for everywhere, so that nothing old may be there.
    const Rows& rows = may_have_gaps || closed_ ? kAllRows : wanted;
    for (int z = 0; z < 11; ++z)
        for (uint32_t left = rows[z]; left != 0; left &= left - 1) {
            const int y = std::countr_zero(left);
            float* out = samples.value.data() + Samples::at(-1, y - 1, z - 1);
            const Slot* slots = slots_.data() + 3 * (ay.slot[y] + 3 * az.slot[z]);
            const int row = static_cast<int>(kBrickSide) *
                            (ay.local[y] + static_cast<int>(kBrickSide) * az.local[z]);
            const auto one = [&](int i) {
                const Slot& s = slots[ax.slot[i]];
                return static_cast<float>(
                    reinterpret_cast<const T*>(s.pinned.bytes)[s.stride * (row + ax.local[i])]);
            };
            const Slot& own = slots[ax.slot[1]];
            const T* in = reinterpret_cast<const T*>(own.pinned.bytes);
            if (own.stride != 0 && eleven) {
                copy_as_floats<T, 12>(in + row + ax.local[0], out); // 12th: in the brick, not used
            } else if (own.stride != 0 && eight) {
                copy_as_floats<T, 8>(in + row + ax.local[1], out + 1);
                out[0] = one(0);
                out[9] = one(9);
                out[10] = one(10);
            } else {
                for (int i = 0; i < 11; ++i)
                    out[i] = one(i);
            }
        }
    samples.has_gaps = false;
    if (closed_ && (ax.any_beyond || ay.any_beyond || az.any_beyond)) {
        samples.has_gaps = true;
        for (int z = 0; z < 11; ++z)
            for (int y = 0; y < 11; ++y)
                for (int x = 0; x < 11; ++x)
                    if (ax.is_beyond[x] || ay.is_beyond[y] || az.is_beyond[z])
                        samples.value[Samples::at(x - 1, y - 1, z - 1)] =
                            std::numeric_limits<float>::quiet_NaN();
    } else if (may_have_gaps) {
        for (int row = 0; row < 121; ++row)
            for (int x = 0; x < 11; ++x)
                if (const float v = samples.value[12 * row + x]; v != v)
                    samples.has_gaps = true;
    }
}

} // namespace palpate::block
