#include "engine/segment/bilateral.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/base/clones.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

// Eight floats at once: two registers, or one with AVX2 (clones.h).
using Eight = float __attribute__((vector_size(32)));
using EightBits = int32_t __attribute__((vector_size(32)));

constexpr int kLongest = 24; // samples to each side

struct Tap {
    glm::ivec3 at;
    std::ptrdiff_t offset; // in the box
    float weight;
};

struct Pass {
    const float* in;
    const float* has; // 1 where there is data, else 0; null where all have
    float* out;
    glm::ivec3 size; // of all three boxes
    glm::ivec3 low, high;
    const Tap* taps;
    size_t tap_count;
    float range_factor; // t = -(range_factor * difference)^2 is the exponent of 2
};

// 2^t for t <= 0; below -126 as at -126. Relative error below 5e-6: the polynomial is Taylor's to
// the fifth power, whose last term c x^5 is replaced by c (5/16 x^3 - 5/256 x) (Chebyshev) for |x|
// <= 1/2.
[[gnu::always_inline]] inline Eight power_of_two(Eight t) {
    constexpr float kRound = 12582912.0f; // 1.5 * 2^23: adding it rounds to whole numbers
    const Eight least = Eight{} - 126.0f;
    t = t < least ? least : t;
    const Eight shifted = t + kRound;
    const Eight f = t - (shifted - kRound);
    Eight p = f * 0.0096181291f + 0.0559207826f;
    p = p * f + 0.2402265070f;
    p = p * f + 0.6931211384f;
    p = p * f + 1.0f;
    EightBits bits, exponent;
    std::memcpy(&bits, &p, sizeof p);
    std::memcpy(&exponent, &shifted, sizeof p);
    bits += exponent << 23;
    std::memcpy(&p, &bits, sizeof p);
    return p;
}

// 16 samples.
template <bool kLacks>
[[gnu::always_inline]] inline void row_part(const Pass& pass, size_t at) {
    Eight centre[2], sum[2]{}, total[2];
    std::memcpy(centre, pass.in + at, sizeof centre);
    total[0] = total[1] = Eight{} + 1.0f;
    for (size_t i = 0; i < pass.tap_count; ++i) {
        const size_t from = at + size_t(pass.taps[i].offset);
        const float weight = pass.taps[i].weight;
        for (size_t half = 0; half < 2; ++half) {
            Eight value;
            std::memcpy(&value, pass.in + from + 8 * half, sizeof value);
            const Eight d = value - centre[half];
            const Eight share = pass.range_factor * d;
            Eight w = weight * power_of_two(-(share * share));
            if (kLacks) {
                Eight has;
                std::memcpy(&has, pass.has + from + 8 * half, sizeof has);
                w *= has;
            }
            sum[half] += w * d;
            total[half] += w;
        }
    }
    for (size_t half = 0; half < 2; ++half)
        sum[half] = centre[half] + sum[half] / total[half];
    std::memcpy(pass.out + at, sum, sizeof sum);
}

template <bool kLacks>
[[gnu::always_inline]] inline void all_of(const Pass& pass) {
    for (int z = pass.low.z; z < pass.high.z; ++z)
        for (int y = pass.low.y; y < pass.high.y; ++y) {
            const size_t row = size_t(pass.size.x) * (size_t(y) + size_t(pass.size.y) * size_t(z));
            for (int x = pass.low.x; x < pass.high.x; x += 16)
                row_part<kLacks>(pass, row + size_t(x));
        }
}
PALPATE_CLONES void run(const Pass& pass) {
    all_of<false>(pass);
}
PALPATE_CLONES void run_where_data(const Pass& pass) {
    all_of<true>(pass);
}

struct Bilateral {
    Volume volume;
    std::vector<std::vector<Tap>> passes; // offsets unset
    std::vector<glm::ivec3> reach;        // of each
    glm::ivec3 halo{};
    float range_factor;

    BrickPtr brick(glm::uvec3 at) const;
};

struct Scratch {
    Neighbourhood near;
    std::vector<float> has, other, made;
    std::vector<Tap> taps;
};

BrickPtr Bilateral::brick(glm::uvec3 at) const {
    thread_local Scratch s;
    read_neighbourhood(volume, at, halo, s.near);
    if (s.near.constant)
        return constant_brick(ScalarType::f32, *s.near.constant);
    const glm::ivec3 size = s.near.size;
    std::vector<float>& samples = s.near.samples;
    const float* has = nullptr;
    if (s.near.lacks_data) {
        s.has.resize(samples.size());
        for (size_t i = 0; i < samples.size(); ++i) {
            s.has[i] = std::isnan(samples[i]) ? 0.0f : 1.0f;
            samples[i] = std::isnan(samples[i]) ? 0.0f : samples[i];
        }
        has = s.has.data();
    }
    s.other.resize(samples.size());
    float *in = samples.data(), *out = s.other.data();
    glm::ivec3 margin(0); // of the box, where passes were not run
    for (size_t pass = 0; pass < passes.size(); ++pass) {
        margin += reach[pass];
        s.taps = passes[pass];
        for (Tap& tap : s.taps)
            tap.offset =
                tap.at.x + std::ptrdiff_t{size.x} * (tap.at.y + std::ptrdiff_t{size.y} * tap.at.z);
        glm::ivec3 low = margin, high = size - margin;
        low.x = halo.x; // rows of 32: of no other is a result read
        high.x = halo.x + int(kBrickSide);
        (has ? run_where_data
             : run)({in, has, out, size, low, high, s.taps.data(), s.taps.size(), range_factor});
        std::swap(in, out);
    }
    s.made.resize(kBrickSamples);
    const glm::uvec3 valid = volume.valid_in_brick(at);
    for (uint32_t z = 0; z < valid.z; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y)
            for (uint32_t x = 0; x < kBrickSide; ++x) {
                const size_t from =
                    size_t(halo.x) + x +
                    size_t(size.x) * (size_t(halo.y) + y + size_t(size.y) * (size_t(halo.z) + z));
                s.made[offset_in_brick({x, y, z})] = has && has[from] == 0.0f ? NAN : in[from];
            }
    return Brick::make(std::span<const float>(s.made), valid);
}

} // namespace

Result<BrickMaker> bilateral_bricks(const Volume& volume, const BilateralOptions& o) {
    PALPATE_TRY(check_magnitude(volume));
    const Grid& grid = volume.grid();
    const double most = kLongest / kBilateralReach * smallest_spacing_mm(grid);
    if (!(o.sigma_mm > 0.0 && o.sigma_mm <= most))
        return fail(
            "sigma: expected more than 0 and at most {:g} mm, which reaches {} samples of "
            "the finest axis, found {:g}",
            most, kLongest, o.sigma_mm);
    if (!(o.range > 0.0) || !std::isfinite(o.range))
        return fail("range: expected a difference of values above 0, found {:g}", o.range);
    const glm::dmat3 axes(grid.world_from_index);
    const double reach_mm = kBilateralReach * o.sigma_mm;
    // Samples of the ball lie within these: rows of the inverse are normals of the grid's planes.
    const glm::dmat3 rows = glm::transpose(glm::inverse(axes));
    glm::ivec3 most_samples;
    for (int a = 0; a < 3; ++a)
        most_samples[a] = int(std::floor(reach_mm * glm::length(rows[a]) + 1e-9));
    if (glm::any(glm::greaterThan(most_samples, glm::ivec3(kLongest))))
        return fail(
            "sigma: expected a reach of at most {} samples, found {:g} mm on a sheared grid",
            kLongest, o.sigma_mm);
    auto filter = std::make_shared<Bilateral>(
        Bilateral{volume, {}, {}, glm::ivec3(0), float(std::sqrt(0.5 * M_LOG2E) / o.range)});
    const auto add = [&](glm::ivec3 reach) {
        std::vector<Tap> taps;
        for (int z = -reach.z; z <= reach.z; ++z)
            for (int y = -reach.y; y <= reach.y; ++y)
                for (int x = -reach.x; x <= reach.x; ++x) {
                    const glm::ivec3 at(x, y, z);
                    const double d = glm::length(axes * glm::dvec3(at)) / o.sigma_mm;
                    if (at != glm::ivec3(0) && d <= kBilateralReach + 1e-9)
                        taps.push_back({at, 0, float(std::exp(-0.5 * d * d))});
                }
        filter->passes.push_back(std::move(taps));
        filter->reach.push_back(reach);
        filter->halo += reach;
    };
    if (!o.separable) {
        add(most_samples);
    } else {
        for (int a = 0; a < 3; ++a) {
            glm::ivec3 reach(0);
            reach[a] = std::min(most_samples[a], int(reach_mm / spacing_mm(grid)[a] + 1e-9));
            add(reach);
        }
    }
    return BrickMaker{grid, ScalarType::f32, [filter](glm::uvec3 at) { return filter->brick(at); }};
}

Result<Volume> bilateral(const Volume& volume, const BilateralOptions& options, const Task& task) {
    PALPATE_TRY(const BrickMaker maker, bilateral_bricks(volume, options));
    return make_bricks(maker, task);
}

} // namespace palpate
