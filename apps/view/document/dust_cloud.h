#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include <glm/glm.hpp>

#include "haptics/sound/milling.h"

namespace palpate::view {

// Dust that flies from a tool while it removes material: a grain for each Dust::kGrain_mm3. How it
// flies is our choice, and no physics: from the tool in any direction, slower and slower, until it
// has faded. The same removals at the same times give the same grains.
class DustCloud {
 public:
    static constexpr double kLife_s = 0.8;
    static constexpr double kReach_mm = 15.0;   // of the fastest grain
    static constexpr size_t kMostGrains = 2000; // in the air; the oldest go first

    // Each frame: grains of what was removed since the last one leave the tool. removed_mm3:
    // Milling's, in all. time_s never falls.
    void frame(double removed_mm3, glm::dvec3 tool_mm, double time_s);

    struct Grain {
        glm::dvec3 place_mm{0.0};
        double age = 0.0; // 0 .. 1: new to gone
    };
    std::vector<Grain> grains() const;      // oldest first, of the last frame's time
    uint64_t made() const { return made_; } // since the beginning

 private:
    struct Thrown {
        uint64_t number;
        glm::dvec3 from_mm;
        double at_s;
    };
    haptics::Dust dust_;
    std::deque<Thrown> thrown_;
    uint64_t made_ = 0;
    double time_s_ = 0.0;
};

} // namespace palpate::view
