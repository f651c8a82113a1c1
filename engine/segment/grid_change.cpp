#include "engine/segment/grid_change.h"

#include <algorithm>
#include <cmath>

#include "engine/volume/box.h"
#include "engine/volume/nearest_stored.h"

namespace palpate {

namespace {

// A grid of `size` samples whose first is the one at `first` of another.
Grid moved(const Grid& grid, glm::ivec3 first, glm::uvec3 size) {
    Grid made = grid;
    made.size = size;
    made.world_from_index[3] = grid.world_from_index * glm::dvec4(glm::dvec3(first), 1.0);
    return made;
}

constexpr glm::ivec3 kWhole(kBrickSide);

// read(first, out): 32 x 32 x 32 samples of T of which those beyond `size` hold anything.
template <class Read>
BrickPtr brick_from(ScalarType type, glm::uvec3 at, glm::uvec3 size, const Read& read) {
    return visit_scalar(type, [&](auto t) -> BrickPtr {
        using T = decltype(t);
        thread_local std::vector<T> samples(kBrickSamples);
        read(glm::ivec3(at * kBrickSide), samples.data());
        return Brick::make(std::span<const T>(samples),
                           glm::min(glm::uvec3(kBrickSide), size - at * kBrickSide));
    });
}

} // namespace

Result<BrickMaker> crop_bricks(const Volume& volume, glm::ivec3 low, glm::ivec3 high) {
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1;
    for (int a = 0; a < 3; ++a)
        if (low[a] < 0 || high[a] < low[a] || high[a] > last[a])
            return fail("expected samples within 0 .. {} on axis {}, found {} .. {}", last[a],
                        "xyz"[a], low[a], high[a]);
    const Grid grid = moved(volume.grid(), low, glm::uvec3(high - low + 1));
    return BrickMaker{
        grid, volume.type(), [volume, low, size = grid.size](glm::uvec3 at) {
            return brick_from(volume.type(), at, size, [&](glm::ivec3 first, auto* out) {
                read_box(volume, first + low, kWhole, packed(glm::uvec3(kWhole)), out);
            });
        }};
}

Result<BrickMaker> pad_bricks(const Volume& volume, glm::ivec3 before, glm::ivec3 after,
                              double value) {
    constexpr int kMost = 4096;
    for (int a = 0; a < 3; ++a)
        if (std::min(before[a], after[a]) < 0 || std::max(before[a], after[a]) > kMost)
            return fail("expected 0 .. {} samples on axis {}, found {} and {}", kMost, "xyz"[a],
                        before[a], after[a]);
    const bool holds = visit_scalar(volume.type(), [&](auto t) {
        return volume.type() == ScalarType::f32 ||
               double(nearest_stored<decltype(t)>(value)) == value;
    });
    if (!holds)
        return fail("value: expected one of the type {}, found {:g}", name_of(volume.type()),
                    value);
    const Grid grid = moved(volume.grid(), -before, volume.size() + glm::uvec3(before + after));
    return BrickMaker{grid, volume.type(),
                      [volume, before, value, size = grid.size](glm::uvec3 at) {
                          const glm::ivec3 first = glm::ivec3(at * kBrickSide) - before;
                          const glm::ivec3 low = glm::clamp(-first, glm::ivec3(0), kWhole);
                          const glm::ivec3 high =
                              glm::clamp(glm::ivec3(volume.size()) - first, glm::ivec3(0), kWhole);
                          if (glm::any(glm::greaterThanEqual(low, high)))
                              return constant_brick(volume.type(), float(value));
                          return brick_from(volume.type(), at, size, [&](glm::ivec3, auto* out) {
                              using T = std::remove_pointer_t<decltype(out)>;
                              std::fill_n(out, kBrickSamples, nearest_stored<T>(value));
                              read_box(volume, first + low, high - low, packed(glm::uvec3(kWhole)),
                                       out + offset_in_brick(glm::uvec3(low)));
                          });
                      }};
}

Result<BrickMaker> flip_bricks(const Volume& volume, int axis) {
    if (axis < 0 || axis > 2)
        return fail("expected an axis 0 .. 2, found {}", axis);
    Grid grid = volume.grid();
    const int last = int(grid.size[axis]) - 1;
    glm::ivec3 end(0);
    end[axis] = last;
    grid = moved(grid, end, grid.size);
    grid.world_from_index[axis] = -grid.world_from_index[axis];
    return BrickMaker{
        grid, volume.type(), [volume, axis, last](glm::uvec3 at) {
            return brick_from(volume.type(), at, volume.size(), [&](glm::ivec3 first, auto* out) {
                // Sample i of the result is last - i of the input: the box ends at last - first.
                glm::ivec3 from = first;
                from[axis] = last - first[axis] - int(kBrickSide) + 1;
                read_box(volume, from, kWhole, packed(glm::uvec3(kWhole)), out);
                for (uint32_t i = 0; i < kBrickSide * kBrickSide; ++i)
                    for (uint32_t k = 0; k < kBrickSide / 2; ++k) {
                        const uint32_t u = i % kBrickSide, v = i / kBrickSide;
                        glm::uvec3 a(u, v, v);
                        a = axis == 0   ? glm::uvec3(k, u, v)
                            : axis == 1 ? glm::uvec3(u, k, v)
                                        : glm::uvec3(u, v, k);
                        glm::uvec3 b = a;
                        b[axis] = kBrickSide - 1 - k;
                        std::swap(out[offset_in_brick(a)], out[offset_in_brick(b)]);
                    }
            });
        }};
}

Result<BrickMaker> reorient_bricks(const Volume& volume, std::string_view letters) {
    constexpr std::string_view kLetters = "LRPASI"; // towards +x, -x, +y, -y, +z, -z of LPS
    glm::ivec3 world(-1);
    glm::dvec3 sign(0.0);
    for (size_t i = 0; i < letters.size() && i < 3; ++i) {
        const size_t at = kLetters.find(letters[i]);
        world[int(i)] = at == std::string_view::npos ? -1 : int(at / 2);
        sign[int(i)] = at % 2 == 0 ? 1.0 : -1.0;
    }
    if (letters.size() != 3 || glm::any(glm::lessThan(world, glm::ivec3(0))) ||
        world.x == world.y || world.y == world.z || world.z == world.x)
        return fail(
            "expected three letters, one of L or R, P or A, S or I each, such as LPS, found '{}'",
            letters);
    // Which index axis becomes each axis of the result: the order in which they agree best.
    const Grid& grid = volume.grid();
    glm::ivec3 from(0, 1, 2), best = from;
    double most = -1.0;
    do {
        double agreement = 0.0;
        for (int a = 0; a < 3; ++a)
            agreement +=
                std::abs(glm::normalize(glm::dvec3(grid.world_from_index[from[a]]))[world[a]]);
        if (agreement > most) {
            most = agreement;
            best = from;
        }
    } while (std::next_permutation(&from.x, &from.x + 3));
    from = best;
    glm::bvec3 reversed;
    glm::ivec3 end(0);
    Grid made = grid;
    for (int a = 0; a < 3; ++a) {
        const glm::dvec4 column = grid.world_from_index[from[a]];
        reversed[a] = column[world[a]] * sign[a] < 0.0;
        end[from[a]] = reversed[a] ? int(grid.size[from[a]]) - 1 : 0;
        made.world_from_index[a] = reversed[a] ? -column : column;
        made.size[a] = grid.size[from[a]];
    }
    made = Grid{made.size, made.world_from_index};
    made.world_from_index[3] = grid.world_from_index * glm::dvec4(glm::dvec3(end), 1.0);
    return BrickMaker{
        made, volume.type(), [volume, from, reversed, size = made.size](glm::uvec3 at) {
            return brick_from(volume.type(), at, size, [&](glm::ivec3 first, auto* out) {
                using T = std::remove_pointer_t<decltype(out)>;
                glm::ivec3 box(0); // where the samples of the brick begin in the input
                for (int a = 0; a < 3; ++a)
                    box[from[a]] =
                        reversed[a] ? int(size[a]) - first[a] - int(kBrickSide) : first[a];
                thread_local std::vector<T> samples(kBrickSamples);
                read_box(volume, box, kWhole, packed(glm::uvec3(kWhole)), samples.data());
                glm::uvec3 i, in;
                for (i.z = 0; i.z < kBrickSide; ++i.z)
                    for (i.y = 0; i.y < kBrickSide; ++i.y)
                        for (i.x = 0; i.x < kBrickSide; ++i.x) {
                            for (int a = 0; a < 3; ++a)
                                in[from[a]] = reversed[a] ? kBrickSide - 1 - i[a] : i[a];
                            out[offset_in_brick(i)] = samples[offset_in_brick(in)];
                        }
            });
        }};
}

} // namespace palpate
