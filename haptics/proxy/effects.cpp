#include "haptics/proxy/effects.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptics/field/coupling.h"

namespace palpate::haptics {

double slewed(double current, double target, double dt_s) {
    const double most = 0.05 * std::max(std::abs(current), std::abs(target)) * dt_s * 1e3;
    return current + std::clamp(target - current, -most, most);
}

double BandNoise::next(double dt_s) {
    if (dt_s != dt_s_) {
        dt_s_ = dt_s;
        const auto tangent = [&](double hertz) {
            return std::tan(std::numbers::pi * std::min(hertz, 0.4 / dt_s) * dt_s);
        };
        const double root2 = std::numbers::sqrt2;
        const double h = tangent(20.0), l = tangent(400.0);
        const double hn = 1.0 / (1.0 + root2 * h + h * h), ln = 1.0 / (1.0 + root2 * l + l * l);
        high_ = {hn, -2.0 * hn, hn, 2.0 * (h * h - 1.0) * hn, (1.0 - root2 * h + h * h) * hn};
        low_ = {l * l * ln, 2.0 * l * l * ln, l * l * ln, 2.0 * (l * l - 1.0) * ln,
                (1.0 - root2 * l + l * l) * ln};
    }
    return std::clamp(low_.step(high_.step(next_signed(random_))), -1.0, 1.0);
}

void Bleed::take_up(glm::dvec3 before, glm::dvec3 now, double natural) {
    const glm::dvec3 jump = before - now;
    const double length = glm::length(jump);
    left_mm_ = length > natural ? jump * ((length - natural) / length) : glm::dvec3(0.0);
}

glm::dvec3 Bleed::next(double speed, double dt_s) {
    const double length = glm::length(left_mm_), less = speed * dt_s;
    left_mm_ = length > less ? left_mm_ * ((length - less) / length) : glm::dvec3(0.0);
    return left_mm_;
}

} // namespace palpate::haptics
