#pragma once

#include <vector>

#include "engine/segment/level_set.h"
#include "engine/segment/level_set_band.h"

namespace palpate {

// How fast the distances of a level set's active samples change (level_set.h), by brick.
class LevelSetRates {
 public:
    LevelSetRates(const Grid& grid, const LevelSetForces& forces, const LevelSetOptions& options);

    struct OfBrick {
        std::vector<float> rates; // mm per time, in the order of the bits
        double steps = 0.0;       // stability asks for a time step of at most 1 / steps
        double fastest = 0.0;     // largest |rate|
    };
    OfBrick of(const LevelSetBand& band, size_t brick) const;

 private:
    struct Sample {
        float speed = 1.0f, edge = 1.0f;
        glm::vec3 wind{0.0f}; // v + w by the index
    };
    float rate(const LevelSetTile& tile, uint32_t row, int x, const Sample& sample,
               double& steps) const;

    LevelSetForces forces_;
    float propagation_, curvature_, advection_, flow_;
    glm::vec3 spacing_;
    glm::mat3 index_from_world_, metric_; // metric: of gradients by the index, 1 / mm^2
    glm::vec3 per_mm_;                    // roots of its diagonal
    float metric_sum_;                    // of the absolute values of its entries
    float most_curvature_;
};

} // namespace palpate
