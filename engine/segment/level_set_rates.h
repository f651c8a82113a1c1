#pragma once

#include <vector>

#include "engine/segment/level_set.h"
#include "engine/segment/level_set_band.h"

namespace palpate {

// How fast the distances of a level set's active samples change (level_set.h), by brick.
class LevelSetRates {
 public:
    LevelSetRates(const Grid& grid, const LevelSetForces& forces, const LevelSetOptions& options);

    struct Bounds {
        float steps = 0.0f;   // stability asks for a time step of at most 1 / steps
        float fastest = 0.0f; // largest |rate|
    };
    // In mm per time, in the order of the bits.
    Bounds of(const LevelSetBand& band, size_t brick, std::vector<float>& rates) const;

    // The part of the options and the grid that the equation needs.
    struct Factors {
        float propagation, curvature, advection, flow;
        glm::vec3 spacing;
        glm::mat3 index_from_world, metric; // metric: of gradients by the index, 1 / mm^2
        glm::vec3 per_mm;                   // roots of its diagonal
        float metric_sum;                   // of the absolute values of its entries
        float most_curvature;
    };

 private:
    LevelSetForces forces_;
    Factors factors_;
};

} // namespace palpate
