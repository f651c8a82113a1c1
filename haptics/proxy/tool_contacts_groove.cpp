// Contacts of a ball that fits a groove.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptics/field/coupling.h"
#include "haptics/proxy/tool_contacts.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

// In samples of the coarsest axis: places of a ball that lie within the first of the surface may be
// across a groove that it fits; by the second their clearances err, for a spline rounds off where a
// surface begins to bend.
constexpr double kNearGroove = 0.1, kError = 0.05;
// In how many directions about a contact others are looked for, how far from it, and how far apart
// places across a groove are: 15 and 12 degrees.
constexpr int kRound = 8;
constexpr double kBeside_rad = 0.2618, kAcross_rad = 0.2094;
// A groove of parallel walls has normals to 1.57 on either side.
constexpr double kWidest_rad = 1.7;
static_assert(kRound <= ToolContacts::kMostAcross);

} // namespace

// The contact of a ball's place that faces along -normal: its clearance along that, and the normal
// there. None where there is no slope.
std::optional<Hold> ToolContacts::look_along(dvec3 at, dvec3 normal) {
    ++glances_;
    const auto [sharp, smooth] = felt_at(at - reach_mm_ * normal);
    const double slope = glm::length(smooth.gradient), floor = least_slope();
    if (slope < floor || field_.is_buried(sharp.value))
        return {};
    return Hold{.touch = {0, -normal},
                .normal = -smooth.gradient / slope,
                .clearance_mm = clearance_of(sharp, slope, normal),
                .confidence = std::min(1.0, slope / (4.0 * floor))};
}

// A ball that fits the rounding of a groove touches it all across: between the contacts that are
// known, and beside one, where it is pushed to a side. Depth is judged by what that makes of
// clearances: what one flank errs by is no depth.
void ToolContacts::look_across_groove(dvec3 at, bool all) {
    const double near_mm = kNearGroove * field_.coarsest_mm();
    if (all || bends_with_ball_) // on most bodies it does not, and each look tells
        look_round_deepest(at, near_mm);
    bends_with_ball_ = across_ > 0;
    Groove groove = groove_of(holds(), near_mm);
    across_ = 0;
    if (groove.certainty == 0.0)
        return;
    widen(groove, at, near_mm);
    const double span_rad = groove.high_rad - groove.low_rad;
    const uint32_t steps =
        std::clamp(static_cast<uint32_t>(std::ceil(span_rad / kAcross_rad)), 1u, kMostAcross - 1);
    for (uint32_t k = 0; k <= steps; ++k) {
        const dvec3 normal = groove.normal_at(groove.low_rad + span_rad * k / steps);
        if (auto hold = look_along(at, normal)) {
            hold->normal = normal;
            holds_[count_ + across_++] = *hold;
        }
    }
    look_.fits =
        agree(groove, {holds_.data(), count_ + across_}, near_mm, kError * field_.coarsest_mm());
}

// For a while, those are kept as if across a groove which the ball may touch beside its deepest
// contact.
void ToolContacts::look_round_deepest(dvec3 at, double near_mm) {
    const Hold& deepest = *std::min_element(
        holds_.begin(), holds_.begin() + count_,
        [](const Hold& a, const Hold& b) { return a.clearance_mm < b.clearance_mm; });
    if (!(deepest.clearance_mm < near_mm))
        return;
    const dvec3 n = deepest.normal;
    const dvec3 a = unit_or_zero(
        glm::cross(n, std::abs(n.x) < 0.6 ? dvec3(1.0, 0.0, 0.0) : dvec3(0.0, 1.0, 0.0)));
    const dvec3 b = glm::cross(n, a);
    for (int k = 0; k < kRound; ++k) {
        const double turn_rad = 2.0 * std::numbers::pi * k / kRound;
        const dvec3 way = std::cos(kBeside_rad) * n +
                          std::sin(kBeside_rad) * (std::cos(turn_rad) * a + std::sin(turn_rad) * b);
        const auto hold = look_along(at, way);
        if (hold && hold->clearance_mm < near_mm && glm::dot(hold->normal, way) > kFacing)
            holds_[count_ + across_++] = *hold;
    }
}

// As far as the surface goes on bending with the ball.
void ToolContacts::widen(Groove& groove, dvec3 at, double near_mm) {
    for (const double side : {-1.0, 1.0}) {
        double& end_rad = side < 0.0 ? groove.low_rad : groove.high_rad;
        while (std::abs(end_rad) < kWidest_rad) {
            const auto next = look_along(at, groove.normal_at(end_rad + side * kBeside_rad));
            if (!next || !(next->clearance_mm < near_mm))
                break;
            const double turned_rad = side * (groove.angle_rad_of(next->normal) - end_rad);
            if (!(turned_rad > 0.5 * kBeside_rad))
                break;
            end_rad += side * std::min(turned_rad, kBeside_rad);
        }
    }
}

} // namespace palpate::haptics
