#include "haptics/field/touch_plates.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

namespace {

// A ball's lowest point, in the plate's own axes.
glm::dvec3 tip_of(const TouchPlate& plate, glm::dvec3 tool_mm, double radius_mm) {
    glm::dvec3 tip = glm::conjugate(plate.top.rotation) * (tool_mm - plate.top.position_mm);
    tip.z -= radius_mm;
    return tip;
}

bool within(const TouchPlate& plate, glm::dvec3 tip, double more_mm) {
    return std::abs(tip.x) <= plate.half_mm.x + more_mm &&
           std::abs(tip.y) <= plate.half_mm.y + more_mm;
}

} // namespace

glm::dvec3 PlatePress::tick(const TouchPlates* plates, glm::dvec3 tool_mm,
                            double radius_mm) noexcept {
    const int32_t held = touch_.plate;
    const glm::dvec3 last_mm = last_mm_;
    const bool had_last = has_last_;
    touch_ = {};
    last_mm_ = tool_mm;
    has_last_ = true;
    if (!plates)
        return glm::dvec3(0.0);
    const auto count = static_cast<int32_t>(plates->plates.size());
    for (int32_t i = 0; i < count; ++i) {
        const TouchPlate& plate = plates->plates[static_cast<size_t>(i)];
        const glm::dvec3 tip = tip_of(plate, tool_mm, radius_mm);
        if (!(tip.z < 0.0))
            continue;
        const bool goes_on = i == held && within(plate, tip, kSlip_mm);
        const bool begins =
            had_last && within(plate, tip, 0.0) && tip_of(plate, last_mm, radius_mm).z >= 0.0;
        if (!goes_on && !begins)
            continue;
        const double depth_mm = -tip.z, beyond_mm = std::max(0.0, depth_mm - plate.travel_mm);
        const double k = plate.stiffness_n_per_m;
        touch_ = {i, depth_mm, glm::dvec2(tip.x, tip.y),
                  beyond_mm > 0.0 ? TouchPlate::kStop * k : k};
        const double force_n = 1e-3 * k * (depth_mm + (TouchPlate::kStop - 1.0) * beyond_mm);
        return plate.top.rotation * glm::dvec3(0.0, 0.0, force_n);
    }
    return glm::dvec3(0.0);
}

} // namespace palpate::haptics
