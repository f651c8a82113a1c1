#include "haptics/device/rate_hand.h"

#include <algorithm>

namespace palpate::haptics {

void RateHand::reset() noexcept {
    position_m_ = glm::dvec3(0.0);
    rotation_ = {1.0, 0.0, 0.0, 0.0};
}

void RateHand::move(int64_t now_ns, glm::dvec3 push, glm::dvec3 turn,
                    DeviceSample& sample) noexcept {
    constexpr double kMost_s = 0.01;
    const double dt_s =
        moved_ns_ == 0 ? 0.0
                       : std::clamp(1e-9 * static_cast<double>(now_ns - moved_ns_), 0.0, kMost_s);
    moved_ns_ = now_ns;
    const glm::dvec3 before = position_m_;
    position_m_ =
        glm::clamp(position_m_ + dt_s * kSpeed_m_per_s * push, -workspace_m_, workspace_m_);
    const glm::dvec3 way = dt_s * kTurn_rad_per_s * turn;
    if (const double angle = glm::length(way); angle > 0.0)
        rotation_ = glm::normalize(glm::angleAxis(angle, way / angle) * rotation_);
    sample.position_m = position_m_;
    sample.rotation = rotation_;
    sample.velocity_m_per_s = dt_s > 0.0 ? (position_m_ - before) / dt_s : glm::dvec3(0.0);
}

} // namespace palpate::haptics
