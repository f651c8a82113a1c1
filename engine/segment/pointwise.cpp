#include "engine/segment/pointwise.h"

#include <algorithm>
#include <cmath>

#include "engine/segment/expression.h"
#include "engine/volume/extent.h"
#include "engine/volume/nearest_stored.h"

namespace palpate {

namespace {

// make(inputs, count, out): `count`, a multiple of 8, samples from those at the same place of each
// input. No volume: the input is not read, and null.
using Make = std::function<void(std::span<const float* const>, size_t count, float* out)>;

BrickMaker pointwise(std::vector<std::optional<Volume>> inputs, const Grid& grid, ScalarType type,
                     Make make) {
    return {grid, type,
            [inputs = std::move(inputs), grid, type, make = std::move(make)](glm::uvec3 at) {
                thread_local std::vector<std::vector<float>> read;
                thread_local std::vector<float> made(kBrickSamples);
                read.resize(std::max(read.size(), inputs.size()));
                std::vector<const float*> from(inputs.size(), nullptr);
                const bool constant = std::all_of(inputs.begin(), inputs.end(), [&](const auto& v) {
                    return !v || v->brick(at).is_constant();
                });
                const size_t count = constant ? 8 : kBrickSamples;
                for (size_t i = 0; i < inputs.size(); ++i) {
                    if (!inputs[i])
                        continue;
                    const Brick& brick = inputs[i]->brick(at);
                    read[i].resize(kBrickSamples);
                    if (constant)
                        std::fill_n(read[i].begin(), count, brick.value(0));
                    else
                        brick.read(std::span(read[i]));
                    from[i] = read[i].data();
                }
                make(from, count, made.data());
                return visit_scalar(type, [&](auto t) -> BrickPtr {
                    using T = decltype(t);
                    thread_local std::vector<T> stored(kBrickSamples);
                    for (size_t i = 0; i < count; ++i)
                        stored[i] = std::isnan(made[i]) && !std::is_floating_point_v<T>
                                        ? T{}
                                        : nearest_stored<T>(double{made[i]});
                    return Brick::make(
                        std::span<const T>(stored.data(), constant ? 1 : count),
                        glm::min(glm::uvec3(kBrickSide), grid.size - at * kBrickSide));
                });
            }};
}

template <class F>
BrickMaker of_value(const Volume& volume, ScalarType type, const F& f) {
    return pointwise({volume}, volume.grid(), type,
                     [f](std::span<const float* const> in, size_t count, float* out) {
                         for (size_t i = 0; i < count; ++i)
                             out[i] = f(in[0][i]);
                     });
}

Result<void> expect_ascending(double low, double high) {
    if (!(low <= high))
        return fail("expected low <= high, found {:g} and {:g}", low, high);
    return {};
}

} // namespace

Result<void> expect_grid(const Grid& grid, const Volume& volume, std::string_view name) {
    const glm::uvec3 n = grid.size, m = volume.size();
    if (n != m)
        return fail("{}: expected {} x {} x {} samples as in V, found {} x {} x {}", name, n.x, n.y,
                    n.z, m.x, m.y, m.z);
    double off = 0;
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index(glm::uvec3(corner & 1, corner >> 1 & 1, corner >> 2) * (n - 1u));
        off = std::max(off,
                       glm::distance(world_point(grid, index), world_point(volume.grid(), index)));
    }
    if (off > slack_mm(grid))
        return fail(
            "{}: expected the positions of V's samples, found some {:g} mm away; resample "
            "it first (--resample-like)",
            name, off);
    return {};
}

Result<BrickMaker> expression_bricks(const Volume& volume, std::string_view text,
                                     const std::map<std::string, Volume>& others) {
    std::vector<std::string> names{"a"};
    std::vector<std::optional<Volume>> inputs{volume};
    for (const auto& [name, other] : others) {
        names.push_back(name);
        inputs.emplace_back(other);
    }
    PALPATE_TRY(const Expression expression, Expression::compile(text, names));
    for (size_t i = 0; i < inputs.size(); ++i) {
        if (!expression.uses(i))
            inputs[i].reset();
        else if (i > 0) {
            PALPATE_TRY(expect_grid(volume.grid(), *inputs[i], names[i]));
        }
    }
    return pointwise(std::move(inputs), volume.grid(),
                     expression.is_logical() ? ScalarType::u8 : ScalarType::f32,
                     [expression](std::span<const float* const> in, size_t count, float* out) {
                         expression.evaluate(in, count, out);
                     });
}

Result<BrickMaker> threshold_bricks(const Volume& volume, double low, double high) {
    PALPATE_TRY(expect_ascending(low, high));
    return of_value(volume, ScalarType::u8, [low, high](float v) {
        return double{v} >= low && double{v} <= high ? 1.0f : 0.0f;
    });
}

Result<BrickMaker> clamp_bricks(const Volume& volume, double low, double high) {
    PALPATE_TRY(expect_ascending(low, high));
    return of_value(volume, volume.type(), [a = float(low), b = float(high)](float v) {
        return v < a ? a : v > b ? b : v;
    });
}

Result<BrickMaker> rescale_bricks(const Volume& volume, double low, double high, double to_low,
                                  double to_high) {
    if (low == high)
        return fail("expected two values that differ, found {:g} twice", low);
    const double slope = (to_high - to_low) / (high - low);
    return of_value(volume, ScalarType::f32,
                    [=](float v) { return float(to_low + slope * (double{v} - low)); });
}

Result<BrickMaker> invert_bricks(const Volume& volume) {
    const ValueRange range = volume.range();
    return of_value(volume, volume.type(), [sum = double{range.min} + double{range.max}](float v) {
        return float(sum - double{v});
    });
}

Result<BrickMaker> mask_bricks(const Volume& volume, const Volume& mask, double outside) {
    PALPATE_TRY(expect_grid(volume.grid(), mask, "the mask"));
    const bool holds = visit_scalar(volume.type(), [&](auto t) {
        return double(nearest_stored<decltype(t)>(outside)) == outside ||
               volume.type() == ScalarType::f32;
    });
    if (!holds)
        return fail("outside: expected a value of the type {}, found {:g}", name_of(volume.type()),
                    outside);
    return pointwise({volume, mask}, volume.grid(), volume.type(),
                     [outside](std::span<const float* const> in, size_t count, float* out) {
                         for (size_t i = 0; i < count; ++i)
                             out[i] = std::isnan(in[1][i]) || in[1][i] == 0.0f ? float(outside)
                                                                               : in[0][i];
                     });
}

} // namespace palpate
