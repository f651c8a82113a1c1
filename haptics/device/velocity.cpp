#include "haptics/device/velocity.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

glm::dvec3 VelocityEstimator::add(glm::dvec3 position, double dt_s) noexcept {
    positions_[next_] = position;
    dts_[next_] = dt_s;
    next_ = (next_ + 1) % kWindow;
    count_ = std::min(count_ + 1, kWindow);
    return {along(0), along(1), along(2)};
}

double VelocityEstimator::along(int axis) const noexcept {
    const double newest = position(0)[axis];
    double best = 0.0, span_s = 0.0;
    for (uint32_t back = 1; back < count_; ++back) {
        span_s += dts_[(next_ + 2 * kWindow - back) % kWindow];
        const double slope = (newest - position(back)[axis]) / span_s;
        double at_s = 0.0;
        for (uint32_t k = 1; k < back; ++k) {
            at_s += dts_[(next_ + 2 * kWindow - k) % kWindow];
            if (std::abs(position(k)[axis] - (newest - slope * at_s)) > uncertainty_)
                return best;
        }
        best = slope;
    }
    return best;
}

} // namespace palpate::haptics
