#pragma once

#include <algorithm>
#include <span>

#include "engine/base/error.h"
#include "engine/volume/edit.h"

// Boxes of samples, in and out of the bricks of a volume.
namespace palpate {

// The layout of a box's samples in an array, in elements: sample (x, y, z) at x + y * row +
// z * plane.
struct BoxStrides {
    size_t row = 0, plane = 0;
};
// One row after the other.
inline BoxStrides packed(glm::uvec3 size) {
    return {size.x, size_t{size.x} * size.y};
}

// Reads samples first .. first + size - 1 as Out; those beyond the volume repeat the nearest one
// within. Brick after brick, so that each is looked up once. Out holds every value of the volume's
// type that the box has; no data is NaN. A box without samples is left alone.
template <class Out>
void read_box(const Volume& volume, glm::ivec3 first, glm::ivec3 size, BoxStrides strides,
              Out* out) {
    if (glm::any(glm::lessThanEqual(size, glm::ivec3(0))))
        return;
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1, side(kBrickSide);
    const glm::ivec3 low = glm::clamp(first, glm::ivec3(0), last) / side;
    const glm::ivec3 high = glm::clamp(first + size - 1, glm::ivec3(0), last) / side;
    const auto read_brick = [&](glm::ivec3 at) {
        const glm::ivec3 origin = at * side;
        // Places of the box whose nearest sample lies in this brick.
        const glm::ivec3 begin = glm::mix(origin - first, glm::ivec3(0), glm::equal(at, low));
        const glm::ivec3 end = glm::mix(origin + side - first, size, glm::equal(at, high));
        // The samples of a row that are within the volume.
        const int inside = std::clamp(-first.x, begin.x, end.x);
        const int beyond = std::clamp(last.x + 1 - first.x, begin.x, end.x);
        const Brick& brick = volume.brick(glm::uvec3(at));
        const Brick::Pinned pinned = brick.pin();
        visit_scalar(brick.type(), [&](auto t) {
            const auto* samples = reinterpret_cast<const decltype(t)*>(pinned.bytes);
            for (int z = begin.z; z < end.z; ++z)
                for (int y = begin.y; y < end.y; ++y) {
                    Out* to = out + strides.row * size_t(y) + strides.plane * size_t(z);
                    if (brick.is_constant()) {
                        std::fill(to + begin.x, to + end.x, static_cast<Out>(samples[0]));
                        continue;
                    }
                    const glm::ivec3 local =
                        glm::clamp(first + glm::ivec3(0, y, z), glm::ivec3(0), last) - origin;
                    const auto* row = samples + kBrickSide * (local.y + kBrickSide * local.z);
                    std::fill(to + begin.x, to + inside, static_cast<Out>(row[0]));
                    const auto* in = row + (first.x + inside - origin.x);
                    for (int x = 0; x < beyond - inside; ++x)
                        to[inside + x] = static_cast<Out>(in[x]);
                    if (beyond < end.x)
                        std::fill(to + beyond, to + end.x,
                                  static_cast<Out>(row[last.x - origin.x]));
                }
        });
    };
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x)
                read_brick({x, y, z});
}

// Copies samples first .. first + size - 1 to an array, or from one into an edit, in the volume's
// own type; of f32, what is not finite goes in as "no data". Refused: another type T, a box that
// is empty or reaches beyond the volume, an array that ends before the last sample. T: uint8_t,
// int8_t, uint16_t, int16_t, float.
template <class T>
Result<void> copy_out(const Volume& volume, glm::uvec3 first, glm::uvec3 size, BoxStrides strides,
                      std::span<T> samples);
template <class T>
Result<void> copy_in(VolumeEdit& edit, glm::uvec3 first, glm::uvec3 size, BoxStrides strides,
                     std::span<const T> samples);

// A volume of a caller's array; make_volume() is for arrays that are known to fit. Refused beside
// the above: a grid without samples, or whose matrix has no inverse.
template <class T>
Result<Volume> volume_of_array(const Grid& grid, BoxStrides strides, std::span<const T> samples);

} // namespace palpate
