#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace palpate {

// A way to draw a moving picture from fewer rays, as CoarseSettings take it.
struct Level {
    double step_factor;
    double contrast_factor; // of the mode's contrast; for two pixels a ray
    uint32_t px_per_ray;
};

// Chooses the level of each moving frame from what the frames before took: the best one that holds
// the budget. It is told the times and looks at no clock, so the same frames give the same levels.
class LevelChoice {
 public:
    static constexpr size_t kCount = 10;

    struct Budget {
        double frame_ms;
        // While the error estimate of frames is above `aim`, they may take up to longest_ms.
        double aim = std::numeric_limits<double>::infinity();
        double longest_ms = 0;
    };
    struct Frame {
        double wall_ms;        // that it took
        double ray_ms;         // the part of that which changes with the number of rays
        double error_estimate; // CoarseStats
        double traced_share;   // CoarseStats
        bool has_steps;        // longer steps take fewer samples: not so with the exact integrator
    };

    const Level& level() const;              // of the next frame
    size_t number() const { return level_; } // 0, the best, to kCount - 1
    bool is_coarsest() const { return level_ + 1 == kCount; }
    // The time of the level's frames lately; 0 where none is known.
    double known_ms() const { return level_ms_[level_]; }

    // A frame of level() was drawn: chooses the next one's.
    void drawn(const Frame& frame, const Budget& budget);

 private:
    size_t level_ = 0;
    std::array<double, kCount> level_ms_{}; // what its frames took lately; 0: not known
    double listed_share_ = 1;               // traced_share of the last frame with px_per_ray of 2
};

} // namespace palpate
