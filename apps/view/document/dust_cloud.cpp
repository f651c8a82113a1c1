#include "apps/view/document/dust_cloud.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::view {

namespace {

// A number of 0 .. 1 for each grain: multiples of an irrational number, which leave no gap and
// repeat nothing.
double share(uint64_t number, double irrational) {
    const double at = static_cast<double>(number % (uint64_t{1} << 32)) * irrational;
    return at - std::floor(at);
}

// A grain's flight, as a vector in shares of the reach.
glm::dvec3 flight(uint64_t number) {
    const double z = 2.0 * share(number, std::numbers::phi) - 1.0;
    const double turn = 2.0 * std::numbers::pi * share(number, std::numbers::sqrt2);
    const double across = std::sqrt(1.0 - z * z);
    const double far = 0.3 + 0.7 * share(number, std::numbers::sqrt3);
    return far * glm::dvec3(across * std::cos(turn), across * std::sin(turn), z);
}

} // namespace

void DustCloud::frame(double removed_mm3, glm::dvec3 tool_mm, double time_s) {
    time_s_ = time_s;
    const uint64_t more = dust_.take(removed_mm3);
    const uint64_t shown = std::min<uint64_t>(more, kMostGrains);
    for (uint64_t i = more - shown; i < more; ++i)
        thrown_.push_back({made_ + i, tool_mm, time_s});
    made_ += more;
    while (thrown_.size() > kMostGrains ||
           (!thrown_.empty() && time_s - thrown_.front().at_s >= kLife_s))
        thrown_.pop_front();
}

std::vector<DustCloud::Grain> DustCloud::grains() const {
    std::vector<Grain> result;
    result.reserve(thrown_.size());
    for (const Thrown& grain : thrown_) {
        const double age = (time_s_ - grain.at_s) / kLife_s;
        const double left = 1.0 - age;
        const double way = kReach_mm * (1.0 - left * left * left); // it comes to rest as it goes
        result.push_back({grain.from_mm + way * flight(grain.number), age});
    }
    return result;
}

} // namespace palpate::view
