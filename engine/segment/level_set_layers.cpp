// Distances of the layers beyond the active one, each from those before it.

#include <tbb/parallel_for.h>

#include "engine/base/clones.h"
#include "engine/segment/level_set_band.h"
#include "engine/segment/level_set_lanes.h"

namespace palpate {

namespace {

using namespace lanes;

constexpr float kFar = std::numeric_limits<float>::infinity(); // no neighbour

// SimplexDistance for eight samples.
struct Metric {
    explicit Metric(const SimplexDistance& distance, glm::vec3 spacing) : h(spacing) {
        const glm::mat3& m = distance.inverse(7);
        all = {m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]};
        for (size_t p = 0; p < 3; ++p) {
            const auto [i, j] = kPairs[p];
            const glm::mat3& two = distance.inverse(1u << i | 1u << j);
            pairs[p] = {two[i][i], two[j][j], two[i][j]};
            one[p] = 1.0f / std::sqrt(distance.inverse(1u << p)[int(p)][int(p)]);
            is_upright =
                is_upright && std::abs(two[i][j]) <= 1e-6f * std::sqrt(two[i][i] * two[j][j]);
        }
    }

    static constexpr std::array<std::array<int, 2>, 3> kPairs{{{0, 1}, {0, 2}, {1, 2}}};
    std::array<float, 6> all;                  // xx, yy, zz, xy, xz, yz
    std::array<std::array<float, 3>, 3> pairs; // aa, bb, ab
    std::array<float, 3> one;                  // mm
    bool is_upright = true;                    // no mixed terms
    glm::vec3 h;
};

// The nearer neighbour on each axis: its distance (kFar: none), side, and value of another field.
struct Nearer {
    Eight distance[3], side[3], other[3];
};

// u by the simplexes of SimplexDistance::solve(), and the other field where its way meets them.
template <bool kUpright>
PALPATE_INLINE void solve(const Metric& m, const Nearer& in, Eight& u, Eight& other) {
    const Eight base = least(in.distance[0], least(in.distance[1], in.distance[2]));
    Eight v[3];
    for (int i = 0; i < 3; ++i)
        v[i] = in.distance[i] - base; // so that nothing is lost
    u = Eight{} + kFar;
    other = Eight{};
    const auto take = [&](EightBits is_better, Eight found, Eight value)
        __attribute__((always_inline)) {
        u = is_better ? found : u;
        other = is_better ? value : other;
    };
    for (int i = 0; i < 3; ++i) {
        const Eight found = v[i] + m.one[size_t(i)];
        take(found < u, found, in.other[i]);
    }
    for (size_t p = 0; p < 3; ++p) {
        const int i = Metric::kPairs[p][0], j = Metric::kPairs[p][1];
        const auto& [ii, jj, ij] = m.pairs[p];
        Eight f = Eight{} + ii, g = Eight{} + jj, a = ii * v[i], b = jj * v[j];
        if constexpr (!kUpright) {
            const Eight mixed = ij * in.side[i] * in.side[j];
            f += mixed, g += mixed, a += mixed * v[j], b += mixed * v[i];
        }
        const Eight f_sum = f + g, sum = a + b;
        const Eight under = sum * sum - f_sum * (v[i] * a + v[j] * b - 1.0f);
        const Eight found = (sum + root(under)) / f_sum;
        const Eight to_i = found * f - a, to_j = found * g - b; // the way's parts, up to a factor
        take((under >= 0.0f) & (to_i >= 0.0f) & (to_j >= 0.0f) & (found < u), found,
             (to_i * in.other[i] + to_j * in.other[j]) / (to_i + to_j));
    }
    Eight f[3], a[3];
    for (int i = 0; i < 3; ++i)
        f[i] = Eight{} + m.all[size_t(i)], a[i] = m.all[size_t(i)] * v[i];
    if constexpr (!kUpright)
        for (size_t p = 0; p < 3; ++p) {
            const int i = Metric::kPairs[p][0], j = Metric::kPairs[p][1];
            const Eight mixed = m.all[3 + p] * in.side[i] * in.side[j];
            f[i] += mixed, f[j] += mixed, a[i] += mixed * v[j], a[j] += mixed * v[i];
        }
    const Eight f_sum = f[0] + f[1] + f[2], sum = a[0] + a[1] + a[2];
    const Eight under = sum * sum - f_sum * (v[0] * a[0] + v[1] * a[1] + v[2] * a[2] - 1.0f);
    const Eight found = (sum + root(under)) / f_sum;
    const Eight x = found * f[0] - a[0], y = found * f[1] - a[1], z = found * f[2] - a[2];
    take((under >= 0.0f) & (x >= 0.0f) & (y >= 0.0f) & (z >= 0.0f), found,
         (x * in.other[0] + y * in.other[1] + z * in.other[2]) / (x + y + z));
    u += base;
}

struct Pass {
    const Metric& metric;
    const Near& distances;
    const Near& changes;
    const BrickBits& bits;
    const BrickBits& inside;
    std::vector<glm::vec2>& solved; // distance and change of each bit
};

// Eight samples of a part of a row; `bits` are their sides.
template <bool kUpright>
PALPATE_INLINE void solve_part(const Metric& m, const Around& phi, const Around& moved,
                               uint32_t inside, Eight& u, Eight& change) {
    const Eight sign = sign_of(inside), one = Eight{} + 1.0f, none = Eight{} + kFar;
    Nearer nearer;
    for (int i = 0; i < 3; ++i) {
        const Eight low_moved = moved.along(i, -1), high_moved = moved.along(i, 1);
        // NaN: has not moved yet, or is in no layer.
        Eight low = sign * phi.along(i, -1), high = sign * phi.along(i, 1);
        low = is_none(low_moved) | is_none(low) ? none : low;
        high = is_none(high_moved) | is_none(high) ? none : high;
        const EightBits is_low = low <= high;
        nearer.distance[i] = is_low ? low : high;
        nearer.side[i] = is_low ? -one : one;
        nearer.other[i] = nearer.distance[i] < none ? (is_low ? low_moved : high_moved) : Eight{};
    }
    solve<kUpright>(m, nearer, u, change);
    // Samples of this layer and later ones count as they will be.
    const auto value = [&](int axis, int to) __attribute__((always_inline))->Eight {
        const Eight at = phi.along(axis, to), by = moved.along(axis, to);
        return sign * (is_none(by) ? at + change : at);
    };
    const Eight here = value(0, 0);
    for (int i = 0; i < 3; ++i) {
        const Eight low = value(i, -1), high = value(i, 1);
        const EightBits is_low = is_none(high) | (low <= high);
        const Eight beside = is_low ? low : high, away = is_low ? high : low;
        const Eight beyond = is_low ? value(i, -2) : value(i, 2);
        // 0 where its own is not known yet. A surface that bends more than one of a radius of two
        // samples is not on this grid: then values are off.
        const float h = m.h[i], half = 0.5f * h;
        Eight bend = upwind_bend(away - 2.0f * here + beside, here - 2.0f * beside + beyond, h);
        bend = most(least(bend, Eight{} + half), Eight{} - half);
        nearer.distance[i] = is_none(beside) ? none : beside - 0.5f * bend;
        nearer.side[i] = is_low ? -one : one;
        nearer.other[i] = Eight{};
    }
    Eight nothing;
    solve<kUpright>(m, nearer, u, nothing);
    u *= sign;
}

template <bool kUpright>
PALPATE_INLINE void solve_rows(const Pass& pass) {
    glm::vec2* to = pass.solved.data();
    Around phi, moved;
    for (uint32_t row = 0; row < kBrickRows; ++row)
        for (uint32_t part = 0; pass.bits[row] != 0 && part < kParts; ++part) {
            const uint32_t bits = pass.bits[row] >> kWidth * part & 0xffu;
            if (bits == 0)
                continue;
            const int y = int(row % kBrickSide), z = int(row / kBrickSide);
            pass.distances.around(y, z, part, false, phi);
            pass.changes.around(y, z, part, false, moved);
            Eight u, change;
            solve_part<kUpright>(pass.metric, phi, moved, pass.inside[row] >> kWidth * part, u,
                                 change);
            for (uint32_t left = bits; left != 0; left &= left - 1) {
                const int x = std::countr_zero(left);
                *to++ = {u[x], change[x]};
            }
        }
}
PALPATE_CLONES void solve_upright(const Pass& pass) {
    solve_rows<true>(pass);
}
PALPATE_CLONES void solve_sheared(const Pass& pass) {
    solve_rows<false>(pass);
}

} // namespace

void LevelSetBand::solve_layers() {
    const Metric metric(metric_, glm::vec3(spacing_mm(grid_)));
    for (int k = 1; k < kLayers; ++k) {
        tbb::parallel_for(size_t{0}, near_.size(), [&](size_t i) {
            BandBrick& brick = bricks_[near_[i]];
            const Bits bits = layer(brick, k);
            size_t count = 0;
            for (const uint32_t row : bits)
                count += size_t(std::popcount(row));
            brick.solved.resize(count);
            if (count == 0)
                return;
            const glm::uvec3 position = position_of(near_[i]);
            const Near distances(phi_, position), changes(change_, position);
            (metric.is_upright ? solve_upright : solve_sheared)(
                {metric, distances, changes, bits, brick.inside, brick.solved});
        });
        tbb::parallel_for(size_t{0}, near_.size(), [&](size_t i) {
            BandBrick& brick = bricks_[near_[i]];
            if (brick.solved.empty())
                return;
            float* phi = phi_.find(position_of(near_[i]));
            float* change = change_.find(position_of(near_[i]));
            const glm::vec2* next = brick.solved.data();
            for_each_bit(layer(brick, k), [&](uint32_t row, int x) {
                phi[row * kBrickSide + uint32_t(x)] = next->x;
                change[row * kBrickSide + uint32_t(x)] = next++->y;
            });
        });
    }
}

} // namespace palpate
