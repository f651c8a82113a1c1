#include "bench/study/manual_outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "engine/segment/draw.h"
#include "engine/segment/signed_distance.h"
#include "engine/volume/builder.h"

namespace palpate::bench {

namespace {

constexpr double kTurn_rad = 0.8; // by which a wave's phase moves from slice to slice

struct OutlineWave {
    glm::dvec2 per_mm;
    double phase;
};

} // namespace

Result<Outlined> outline_by_hand(const Volume& truth, uint64_t seed, const OutlineHabits& habits,
                                 const Task& task) {
    const Grid& grid = truth.grid();
    const glm::uvec3 n = grid.size;
    const glm::dvec3 spacing = spacing_mm(grid);
    PALPATE_TRY(const Volume distance, signed_distance(truth, {}, task));
    Draw draw(seed);
    std::array<OutlineWave, 12> waves;
    for (OutlineWave& wave : waves) {
        const double angle = draw.between(0.0, 2.0 * std::numbers::pi);
        const double length_mm = draw.between(20.0, 60.0);
        wave = {2.0 * std::numbers::pi / length_mm * glm::dvec2(std::cos(angle), std::sin(angle)),
                draw.between(0.0, 2.0 * std::numbers::pi)};
    }
    // The sum of waves of amplitude 1 has variance 6.
    const double amplitude_mm = habits.off_sd_mm / std::sqrt(0.5 * waves.size());

    const double half_mm = 0.5 * std::min(spacing.x, spacing.y);
    const size_t row = n.x, plane = row * n.y;
    std::vector<uint8_t> inside(plane * n.z);
    Interaction interaction;
    for (uint32_t z = 0; z < n.z; ++z) {
        double edges_mm = 0.0;
        for (uint32_t y = 0; y < n.y; ++y)
            for (uint32_t x = 0; x < n.x; ++x) {
                const glm::dvec2 at = glm::dvec2(x, y) * glm::dvec2(spacing);
                double off_mm = 0.0;
                for (const OutlineWave& wave : waves)
                    off_mm += amplitude_mm * std::sin(glm::dot(wave.per_mm, at) + wave.phase);
                uint8_t& here = inside[x + row * y + plane * z];
                // Between samples that differ the surface lies half-way.
                const double apart_mm = distance.value({x, y, z});
                here = apart_mm - std::copysign(half_mm, apart_mm) < off_mm;
                if (x > 0 && here != *(&here - 1))
                    edges_mm += spacing.y;
                if (y > 0 && here != *(&here - row))
                    edges_mm += spacing.x;
            }
        for (OutlineWave& wave : waves)
            wave.phase += kTurn_rad * draw.normal();
        if (edges_mm == 0.0)
            continue;
        interaction.clicks += 2;
        // The edges of pixels are 4 / pi times as long as a line in all directions (Crofton).
        interaction.path_mm += std::numbers::pi / 4.0 * edges_mm;
    }
    return Outlined{make_volume(grid, std::span<const uint8_t>(inside)), interaction};
}

} // namespace palpate::bench
