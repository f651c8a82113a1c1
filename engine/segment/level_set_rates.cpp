#include "engine/segment/level_set_rates.h"

#include <algorithm>
#include <cmath>

#include "engine/volume/box.h"

namespace palpate {

namespace {

constexpr int kSide = int(kBrickSide), kWide = kSide + 2;

// One-sided differences, and the central ones, along an axis.
struct Differences {
    float back, forth, central, second;
};

Differences differences(const float* at, int stride, float h) {
    const float here = *at;
    // A wall has the sample's own distance: the surface meets it at a right angle.
    const bool has_low = !std::isnan(at[-stride]), has_high = !std::isnan(at[stride]);
    const float low = has_low ? at[-stride] : here, high = has_high ? at[stride] : here;
    const float bend = high - 2.0f * here + low;
    const auto side_bend = [&](bool has, float beside, float beyond) {
        return has ? upwind_bend(bend, beyond - 2.0f * beside + here, h) : 0.0f;
    };
    return {here - low + 0.5f * side_bend(has_low, low, at[-2 * stride]),
            high - here - 0.5f * side_bend(has_high, high, at[2 * stride]), 0.5f * (high - low),
            bend};
}

// Second derivative along two axes; a wall beside takes what lies beside the other.
float mixed(const float* at, int a, int b) {
    const float here = *at;
    const auto corner = [&](int along_a, int along_b) {
        const float beside_a = at[along_a], beside_b = at[along_b], found = at[along_a + along_b];
        if (!std::isnan(found))
            return found;
        const float fa = std::isnan(beside_a) ? here : beside_a;
        const float fb = std::isnan(beside_b) ? here : beside_b;
        return fa + fb - here;
    };
    return 0.25f * (corner(a, b) - corner(a, -b) - corner(-a, b) + corner(-a, -b));
}

} // namespace

LevelSetRates::LevelSetRates(const Grid& grid, const LevelSetForces& forces,
                             const LevelSetOptions& options)
    : forces_(forces),
      propagation_(float(options.propagation)),
      curvature_(float(options.curvature_mm)),
      advection_(forces.edge ? float(options.advection_mm) : 0.0f),
      flow_(float(options.flow)) {
    spacing_ = glm::vec3(spacing_mm(grid));
    const glm::dmat3 axes(grid.world_from_index);
    const glm::dmat3 inverse = glm::inverse(axes), metric = inverse * glm::transpose(inverse);
    index_from_world_ = glm::mat3(inverse);
    metric_ = glm::mat3(metric);
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
        per_mm_[i] = float(std::sqrt(metric[i][i]));
        for (int j = 0; j < 3; ++j)
            sum += std::abs(metric[i][j]);
    }
    metric_sum_ = float(sum);
    // A ball of one sample has no greater one on the grid.
    most_curvature_ = 2.0f * std::max({per_mm_.x, per_mm_.y, per_mm_.z});
}

float LevelSetRates::rate(const LevelSetTile& tile, uint32_t row, int x, const Sample& sample,
                          double& steps) const {
    const float* at = tile.sample(row, x);
    std::array<Differences, 3> d;
    for (size_t i = 0; i < 3; ++i)
        d[i] = differences(at, LevelSetTile::kStrides[i], spacing_[int(i)]);
    float rate = 0.0f, asked = 0.0f;
    const float speed = propagation_ * sample.speed;
    if (speed != 0.0f) {
        // Of each axis the difference that information comes from, the larger where both do
        // (Godunov).
        const float sign = speed > 0.0f ? 1.0f : -1.0f;
        glm::vec3 g;
        for (int i = 0; i < 3; ++i) {
            const float back = std::max(sign * d[size_t(i)].back, 0.0f);
            const float forth = std::min(sign * d[size_t(i)].forth, 0.0f);
            g[i] = sign * (back > -forth ? back : forth);
        }
        rate -= speed * std::sqrt(std::max(glm::dot(g, metric_ * g), 0.0f));
        asked += 2.0f * std::abs(speed) * (per_mm_.x + per_mm_.y + per_mm_.z);
    }
    for (int i = 0; i < 3; ++i) {
        const float wind = sample.wind[i];
        rate -= wind * (wind > 0.0f ? d[size_t(i)].back : d[size_t(i)].forth);
        asked += 2.0f * std::abs(wind);
    }
    const float bending = curvature_ * sample.edge;
    if (bending != 0.0f) {
        const glm::vec3 g(d[0].central, d[1].central, d[2].central), m = metric_ * g;
        const float length = glm::dot(g, m);
        const float xy = mixed(at, LevelSetTile::kStrides[0], LevelSetTile::kStrides[1]);
        const float xz = mixed(at, LevelSetTile::kStrides[0], LevelSetTile::kStrides[2]);
        const float yz = mixed(at, LevelSetTile::kStrides[1], LevelSetTile::kStrides[2]);
        const float trace = metric_[0][0] * d[0].second + metric_[1][1] * d[1].second +
                            metric_[2][2] * d[2].second +
                            2.0f * (metric_[0][1] * xy + metric_[0][2] * xz + metric_[1][2] * yz);
        const float along = m.x * m.x * d[0].second + m.y * m.y * d[1].second +
                            m.z * m.z * d[2].second +
                            2.0f * (m.x * m.y * xy + m.x * m.z * xz + m.y * m.z * yz);
        const float bent = length > 1e-12f ? trace - along / length : trace;
        rate += bending * std::clamp(bent, -most_curvature_, most_curvature_);
        asked += 2.0f * std::abs(bending) * metric_sum_;
    }
    steps = std::max(steps, double(asked));
    return rate;
}

LevelSetRates::OfBrick LevelSetRates::of(const LevelSetBand& band, size_t brick) const {
    OfBrick made;
    const LevelSetBand::Bits& active = band.active(brick);
    if (std::ranges::none_of(active, [](uint32_t row) { return row != 0; }))
        return made;
    const glm::uvec3 position = band.position_of(brick);
    thread_local LevelSetTile tile;
    tile.load(band, brick, active, LevelSetBand::kLayers);
    thread_local std::vector<float> speeds(kBrickSamples), edges(size_t{kWide} * kWide * kWide);
    thread_local std::array<std::vector<float>, 3> flow;
    if (forces_.speed)
        forces_.speed->brick(position).read(std::span<float>(speeds));
    if (forces_.edge)
        read_box(*forces_.edge, glm::ivec3(position) * kSide - 1, glm::ivec3(kWide),
                 packed(glm::uvec3(kWide)), edges.data());
    for (size_t k = 0; forces_.flow && k < 3; ++k) {
        flow[k].resize(kBrickSamples);
        (*forces_.flow)[k].brick(position).read(std::span<float>(flow[k]));
    }
    for_each_bit(active, [&](uint32_t row, int x) {
        const size_t offset = row * kBrickSide + size_t(x);
        Sample sample;
        if (forces_.speed)
            sample.speed = speeds[offset];
        if (forces_.edge) {
            const int y = int(row) % kSide, z = int(row) / kSide;
            const float* at = &edges[size_t(x + 1 + kWide * (y + 1 + kWide * (z + 1)))];
            sample.edge = *at;
            if (advection_ != 0.0f) {
                const int strides[] = {1, kWide, kWide * kWide};
                glm::vec3 slope;
                for (int i = 0; i < 3; ++i) {
                    const float low = at[-strides[i]], high = at[strides[i]];
                    slope[i] = std::isnan(low) || std::isnan(high) ? 0.0f : 0.5f * (high - low);
                }
                sample.wind = -advection_ * (metric_ * slope);
            }
        }
        if (forces_.flow)
            sample.wind += flow_ * (index_from_world_ *
                                    glm::vec3(flow[0][offset], flow[1][offset], flow[2][offset]));
        made.rates.push_back(rate(tile, row, x, sample, made.steps));
        made.fastest = std::max(made.fastest, std::abs(double(made.rates.back())));
    });
    return made;
}

} // namespace palpate
