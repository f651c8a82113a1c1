#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/tool_pose.h"

namespace palpate::haptics {

// A plate on a spring that a tool presses from above: a button, or the track of a slider.
struct TouchPlate {
    ToolPose top;                      // the middle of its upper face at rest; +z points out of it
    glm::dvec2 half_mm{10.0, 5.0};     // half its width (x) and height (y)
    double travel_mm = 4.0;            // after which it meets its stop
    double stiffness_n_per_m = 300.0;  // of the spring
    static constexpr double kStop = 4; // times as stiff beyond the travel

    friend bool operator==(const TouchPlate&, const TouchPlate&) = default;
};

// The plates that can be pressed at a time.
struct TouchPlates {
    std::vector<TouchPlate> plates;

    friend bool operator==(const TouchPlates&, const TouchPlates&) = default;
};

// The press of a tool on a plate.
struct PlateTouch {
    int32_t plate = -1;             // the number of the plate; -1: none
    double depth_mm = 0.0;          // from its face at rest
    glm::dvec2 at_mm{0.0};          // where, in its plane, from the middle
    double stiffness_n_per_m = 0.0; // of the spring, there
};

// Presses plates by a ball. A plate is met by a tip that passes its face from above within its
// outline, and then holds it until the tip is above the face again or has left the outline by
// kSlip_mm: from the side or from behind a plate is not felt. Neither allocates nor throws; a
// function of the state and the arguments.
class PlatePress {
 public:
    static constexpr double kSlip_mm = 2.0;

    // The force on the tool, in newtons. `plates` may be null.
    glm::dvec3 tick(const TouchPlates* plates, glm::dvec3 tool_mm, double radius_mm) noexcept;
    const PlateTouch& touch() const noexcept { return touch_; }
    void reset() noexcept { *this = {}; }

 private:
    PlateTouch touch_;
    bool has_last_ = false;
    glm::dvec3 last_mm_{0.0};
};

} // namespace palpate::haptics
