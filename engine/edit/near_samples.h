#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <stop_token>

#include "engine/edit/sample_mask.h"

namespace palpate {

// Calls visit(place in the brick, Sweep::Near) for the samples of a brick that are nearer than
// kWallReach samples to a sweep, or inside it; the sweep was made that much wider. `valid` as for
// add_samples(). Samples more than deep_mm inside (at least sweep.far_mm()) and those that the
// tool's origin marks are infinitely deep. Ends early, at a row, where `stop` is requested.
template <class Visit>
void for_each_near(const Sweep& sweep, const Grid& grid, glm::uvec3 brick, glm::uvec3 valid,
                   double deep_mm, const std::stop_token& stop, Visit&& visit) {
    constexpr Sweep::Near kDeep{-std::numeric_limits<double>::infinity(), 1.0};
    const double safety_mm = 1e-6 + sweep.tolerance_mm(); // 1e-6 for rounding
    const glm::dvec3 first(brick * kBrickSide);
    const glm::dmat3 mm_from_index(grid.world_from_index);
    const double dx_mm = glm::length(mm_from_index[0]);
    const auto [low, high] = samples_of(sweep, brick, valid);
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y && !stop.stop_requested(); ++y) {
            const auto [mark0, mark1] = sweep.marked_in_row(first.y + y, first.z + z);
            Sweep::Near near = kDeep;
            int same = 0; // so many more samples of the row are as deep, or as far, as `near`
            for (int x = low.x; x <= high.x; ++x) {
                const glm::uvec3 place(x, y, z);
                if (same > 0) {
                    --same;
                } else {
                    near = sweep.near(mm_from_index * (first + glm::dvec3(place)));
                    const double beyond_mm =
                        near.mm < 0.0 ? -near.mm - deep_mm : near.mm - sweep.far_mm();
                    if (beyond_mm > safety_mm) {
                        same = static_cast<int>(
                            std::min((beyond_mm - safety_mm) / dx_mm, double{kBrickSide}));
                        near = near.mm < 0.0 ? kDeep : Sweep::Near{near.mm, 0.0};
                    }
                }
                const double index_x = first.x + x;
                if (mark0 <= index_x && index_x <= mark1)
                    visit(place, kDeep);
                else if (near.samples() < kWallReach)
                    visit(place, near);
            }
        }
}

} // namespace palpate
