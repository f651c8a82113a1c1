#include "engine/segment/level_set_rates.h"

#include <algorithm>
#include <cmath>

#include "engine/base/clones.h"
#include "engine/segment/level_set_lanes.h"
#include "engine/segment/packed_floats.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

using namespace lanes;
using EightShorts = uint16_t __attribute__((vector_size(16)));

constexpr int kSide = int(kBrickSide), kWide = kSide + 2;

// Samples of a brick of f32 or of packed floats; null where it is not given.
struct Field {
    const void* samples = nullptr;
    uint32_t stride = 0; // 0: all are the first
    bool is_packed = false;

    PALPATE_INLINE Eight at(size_t offset) const {
        if (is_packed) {
            const auto* from = static_cast<const uint16_t*>(samples);
            if (stride == 0)
                return Eight{} + unpacked_float(*from);
            EightShorts halves;
            std::memcpy(&halves, from + offset, sizeof halves);
            const EightBits bits = __builtin_convertvector(halves, EightBits) << 16;
            Eight v;
            std::memcpy(&v, &bits, sizeof v);
            return v;
        }
        const auto* from = static_cast<const float*>(samples);
        return stride == 0 ? Eight{} + *from : load(from + offset);
    }
};

struct Pass {
    const LevelSetRates::Factors& factors;
    const Near& distances;
    const BrickBits& active;
    const float* speeds; // with a sample around the brick; null where there are none
    Field edge;
    const float* edges; // as speeds; null where none are needed
    std::array<Field, 3> flow;
    std::vector<float>& rates;
    LevelSetRates::Bounds& bounds;
};

// One-sided differences, and the central ones, along an axis.
struct Differences {
    Eight back, forth, central, second;
};

PALPATE_INLINE Differences differences(const Around& phi, Eight here, int axis, float h) {
    const Eight low_value = phi.along(axis, -1), high_value = phi.along(axis, 1);
    // A wall has the sample's own distance: the surface meets it at a right angle.
    const EightBits no_low = is_none(low_value), no_high = is_none(high_value);
    const Eight low = no_low ? here : low_value, high = no_high ? here : high_value;
    const Eight bend = high - 2.0f * here + low;
    const auto side_bend = [&](EightBits has_none, Eight beside, int steps)
                               __attribute__((always_inline))
                                   ->Eight {
        const Eight found = upwind_bend(bend, phi.along(axis, steps) - 2.0f * beside + here, h);
        return has_none ? Eight{} : found;
    };
    return {here - low + 0.5f * side_bend(no_low, low, -2),
            high - here - 0.5f * side_bend(no_high, high, 2), 0.5f * (high - low), bend};
}

// Second derivative along two axes from the rows that hold the corners and the samples between
// them; a wall beside takes what lies beside the other.
PALPATE_INLINE Eight mixed(Eight here, const std::array<Eight, 4>& sides,
                           const std::array<Eight, 4>& corners) {
    Eight sum{};
    for (size_t i = 0; i < 4; ++i) { // low-low, high-low, low-high, high-high
        const Eight a = sides[i % 2], b = sides[2 + i / 2];
        const Eight beside = (is_none(a) ? here : a) + (is_none(b) ? here : b) - here;
        const Eight corner = is_none(corners[i]) ? beside : corners[i];
        sum = i == 0 || i == 3 ? sum + corner : sum - corner;
    }
    return 0.25f * sum;
}

// b Z k |grad phi|, the curvature at most that of a ball of a sample.
PALPATE_INLINE Eight bent(const LevelSetRates::Factors& f, const Around& phi, Eight here,
                          const std::array<Differences, 3>& d) {
    const Eight x0 = phi.at(0, -1), x1 = phi.at(0, 1), y0 = phi.at(1), y1 = phi.at(2),
                z0 = phi.at(3), z1 = phi.at(4);
    const Eight xy =
        mixed(here, {x0, x1, y0, y1}, {phi.at(1, -1), phi.at(1, 1), phi.at(2, -1), phi.at(2, 1)});
    const Eight xz =
        mixed(here, {x0, x1, z0, z1}, {phi.at(3, -1), phi.at(3, 1), phi.at(4, -1), phi.at(4, 1)});
    const Eight yz = mixed(here, {y0, y1, z0, z1}, {phi.at(9), phi.at(10), phi.at(11), phi.at(12)});
    const glm::mat3& m = f.metric;
    std::array<Eight, 3> along;
    for (int i = 0; i < 3; ++i)
        along[size_t(i)] = m[i][0] * d[0].central + m[i][1] * d[1].central + m[i][2] * d[2].central;
    const auto [u, v, w] = along;
    const Eight length = d[0].central * u + d[1].central * v + d[2].central * w;
    const Eight trace = m[0][0] * d[0].second + m[1][1] * d[1].second + m[2][2] * d[2].second +
                        2.0f * (m[0][1] * xy + m[0][2] * xz + m[1][2] * yz);
    const Eight way = u * u * d[0].second + v * v * d[1].second + w * w * d[2].second +
                      2.0f * (u * v * xy + u * w * xz + v * w * yz);
    const Eight found = length > 1e-12f ? trace - way / length : trace;
    const Eight limit = Eight{} + f.most_curvature;
    return most(least(found, limit), -limit);
}

// The length of the gradient of differences that information comes from, on each axis the larger
// where both sides do (Godunov).
PALPATE_INLINE Eight slope(const LevelSetRates::Factors& f, Eight sign,
                           const std::array<Differences, 3>& d) {
    const Eight zero{};
    std::array<Eight, 3> g;
    for (size_t i = 0; i < 3; ++i) {
        const Eight back = most(sign * d[i].back, zero), forth = least(sign * d[i].forth, zero);
        g[i] = sign * (back > -forth ? back : forth);
    }
    const glm::mat3& m = f.metric;
    const Eight squares =
        m[0][0] * g[0] * g[0] + m[1][1] * g[1] * g[1] + m[2][2] * g[2] * g[2] +
        2.0f * (m[0][1] * g[0] * g[1] + m[0][2] * g[0] * g[2] + m[1][2] * g[1] * g[2]);
    return root(most(squares, zero));
}

// P where the surface is nearest to the samples, by differences to the neighbours on that side; the
// samples themselves may lie where it is quite another. `steps` grows by what stability asks for,
// as P changes with the distance.
PALPATE_INLINE Eight speed_at_surface(const Pass& pass, Eight here,
                                      const std::array<Differences, 3>& d, int x, int y, int z,
                                      Eight& steps) {
    const LevelSetRates::Factors& f = pass.factors;
    const glm::mat3& m = f.metric;
    std::array<Eight, 3> along;
    Eight square{};
    for (int i = 0; i < 3; ++i) {
        along[size_t(i)] = m[i][0] * d[0].central + m[i][1] * d[1].central + m[i][2] * d[2].central;
        square += along[size_t(i)] * d[size_t(i)].central;
    }
    const float* at = pass.speeds + (x + 1 + kWide * (y + 1 + kWide * (z + 1)));
    const int strides[] = {1, kWide, kWide * kWide};
    const Eight zero{}, one = zero + 1.0f, own = load(at);
    Eight speed = own;
    for (size_t i = 0; i < 3; ++i) {
        const Eight way = square > 1e-6f ? -here * along[i] / square : zero; // samples
        const Eight low = own - load(at - strides[i]), high = load(at + strides[i]) - own;
        const Eight to = way > 0.0f ? high : low;
        const Eight rise = is_none(to) ? zero : to;
        speed += most(least(way, one), -one) * rise;
        steps += std::abs(f.propagation) * f.per_mm[int(i)] * absolute(rise);
    }
    return speed;
}

// v + w by the index.
PALPATE_INLINE std::array<Eight, 3> wind_of(const Pass& pass, int x, int y, int z) {
    const LevelSetRates::Factors& f = pass.factors;
    std::array<Eight, 3> wind{};
    if (pass.edges) {
        const float* at = pass.edges + (x + 1 + kWide * (y + 1 + kWide * (z + 1)));
        const int strides[] = {1, kWide, kWide * kWide};
        std::array<Eight, 3> rise;
        for (size_t i = 0; i < 3; ++i) {
            const Eight by = 0.5f * (load(at + strides[i]) - load(at - strides[i]));
            rise[i] = is_none(by) ? Eight{} : by;
        }
        for (int i = 0; i < 3; ++i)
            wind[size_t(i)] = -f.advection * (f.metric[i][0] * rise[0] + f.metric[i][1] * rise[1] +
                                              f.metric[i][2] * rise[2]);
    }
    if (pass.flow[0].samples) {
        const size_t offset = size_t(x + kSide * (y + kSide * z));
        const Eight a = pass.flow[0].at(offset), b = pass.flow[1].at(offset),
                    c = pass.flow[2].at(offset);
        const glm::mat3& m = f.index_from_world; // m[column][row]
        for (int i = 0; i < 3; ++i)
            wind[size_t(i)] += f.flow * (m[0][i] * a + m[1][i] * b + m[2][i] * c);
    }
    return wind;
}

PALPATE_INLINE void find_part(const Pass& pass, int x, int y, int z, Eight& rate, Eight& steps) {
    const LevelSetRates::Factors& f = pass.factors;
    const size_t offset = size_t(x + kSide * (y + kSide * z));
    Around phi;
    pass.distances.around(y, z, uint32_t(x / kWidth), f.curvature != 0.0f, phi);
    const Eight here = phi.at(0), zero{};
    std::array<Differences, 3> d;
    for (int i = 0; i < 3; ++i)
        d[size_t(i)] = differences(phi, here, i, f.spacing[i]);
    rate = steps = zero;
    if (f.propagation != 0.0f) {
        const Eight speed =
            f.propagation *
            (pass.speeds ? speed_at_surface(pass, here, d, x, y, z, steps) : zero + 1.0f);
        rate -= speed * slope(f, speed > 0.0f ? zero + 1.0f : zero - 1.0f, d);
        steps += 2.0f * (f.per_mm.x + f.per_mm.y + f.per_mm.z) * absolute(speed);
    }
    if (pass.edges || pass.flow[0].samples) {
        const std::array<Eight, 3> wind = wind_of(pass, x, y, z);
        for (size_t i = 0; i < 3; ++i) {
            rate -= wind[i] * (wind[i] > 0.0f ? d[i].back : d[i].forth);
            steps += 2.0f * absolute(wind[i]);
        }
    }
    if (f.curvature != 0.0f) {
        const Eight bending =
            pass.edge.samples ? f.curvature * pass.edge.at(offset) : zero + f.curvature;
        rate += bending * bent(f, phi, here, d);
        steps += 2.0f * f.metric_sum * absolute(bending);
    }
}

PALPATE_CLONES void find_rates(const Pass& pass) {
    float* to = pass.rates.data();
    for (uint32_t row = 0; row < kBrickRows; ++row)
        for (uint32_t part = 0; pass.active[row] != 0 && part < kParts; ++part) {
            const uint32_t bits = pass.active[row] >> kWidth * part & 0xffu;
            if (bits == 0)
                continue;
            Eight rate, steps;
            find_part(pass, kWidth * int(part), int(row) % kSide, int(row) / kSide, rate, steps);
            for (uint32_t left = bits; left != 0; left &= left - 1) {
                const int x = std::countr_zero(left);
                *to++ = rate[x];
                pass.bounds.fastest = std::max(pass.bounds.fastest, std::abs(rate[x]));
                pass.bounds.steps = std::max(pass.bounds.steps, steps[x]);
            }
        }
}

} // namespace

LevelSetRates::LevelSetRates(const Grid& grid, const LevelSetForces& forces,
                             const LevelSetOptions& options)
    : forces_(forces) {
    Factors& f = factors_;
    f.propagation = float(options.propagation);
    f.curvature = float(options.curvature_mm);
    f.advection = float(options.advection_mm);
    f.flow = float(options.flow);
    f.spacing = glm::vec3(spacing_mm(grid));
    const glm::dmat3 axes(grid.world_from_index);
    const glm::dmat3 inverse = glm::inverse(axes), metric = inverse * glm::transpose(inverse);
    f.index_from_world = glm::mat3(inverse);
    f.metric = glm::mat3(metric);
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
        f.per_mm[i] = float(std::sqrt(metric[i][i]));
        for (int j = 0; j < 3; ++j)
            sum += std::abs(metric[i][j]);
    }
    f.metric_sum = float(sum);
    // A ball of one sample has no greater one on the grid.
    f.most_curvature = 2.0f * std::max({f.per_mm.x, f.per_mm.y, f.per_mm.z});
}

LevelSetRates::Bounds LevelSetRates::of(const LevelSetBand& band, size_t brick,
                                        std::vector<float>& rates) const {
    Bounds bounds;
    const LevelSetBand::Bits& active = band.active(brick);
    size_t count = 0;
    for (const uint32_t row : active)
        count += size_t(std::popcount(row));
    rates.resize(count);
    if (count == 0)
        return bounds;
    const glm::uvec3 position = band.position_of(brick);
    std::array<SamplesPtr, 5> kept;
    const auto field = [&](const Volume& volume, size_t i) -> Field {
        const Brick& given = volume.brick(position);
        Brick::Pinned pinned = given.pin();
        kept[i] = std::move(pinned.keep);
        return {pinned.bytes, given.stride(), volume.type() == ScalarType::u16};
    };
    const Near distances(band.distances(), position);
    Pass pass{factors_, distances, active, nullptr, {}, nullptr, {}, rates, bounds};
    thread_local std::vector<float> speeds(size_t{kWide} * kWide * kWide);
    if (forces_.speed && factors_.propagation != 0.0f) {
        read_box(*forces_.speed, glm::ivec3(position) * kSide - 1, glm::ivec3(kWide),
                 packed(glm::uvec3(kWide)), speeds.data());
        pass.speeds = speeds.data();
    }
    if (forces_.edge)
        pass.edge = field(*forces_.edge, 1);
    thread_local std::vector<float> edges(size_t{kWide} * kWide * kWide);
    if (forces_.edge && factors_.advection != 0.0f) {
        read_box(*forces_.edge, glm::ivec3(position) * kSide - 1, glm::ivec3(kWide),
                 packed(glm::uvec3(kWide)), edges.data());
        pass.edges = edges.data();
    }
    for (size_t k = 0; forces_.flow && k < 3; ++k)
        pass.flow[k] = field((*forces_.flow)[k], 2 + k);
    find_rates(pass);
    return bounds;
}

} // namespace palpate
