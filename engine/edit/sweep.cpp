#include "engine/edit/sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/volume/extent.h"

namespace palpate {

namespace {

// From the nearest point of a segment to p.
glm::dvec3 from_segment(glm::dvec3 p, glm::dvec3 a, glm::dvec3 b) {
    const glm::dvec3 d = b - a;
    const double dd = glm::dot(d, d);
    const double t = dd > 0.0 ? std::clamp(glm::dot(p - a, d) / dd, 0.0, 1.0) : 0.0;
    return p - a - t * d;
}

double to_segment(glm::dvec3 p, glm::dvec3 a, glm::dvec3 b) {
    return glm::length(from_segment(p, a, b));
}

glm::dquat in_hemisphere_of(glm::dquat q, glm::dquat of) {
    return glm::dot(q, of) < 0.0 ? -q : q;
}

glm::dquat turn_between(glm::dquat a, glm::dquat b, double t) {
    const glm::dquat q = (1.0 - t) * a + t * b;
    return q / std::sqrt(glm::dot(q, q));
}

// For a and b in one hemisphere, the angle that the tool would turn from t = 0 to 1 if it had its
// largest rate all the way. The chord passes the centre of the unit sphere at distance m; where it
// is nearest, its point moves by chord / m of an angle, and a turn is twice the angle of its
// quaternion.
double largest_angle(glm::dquat a, glm::dquat b) {
    const glm::dquat d = b - a;
    const double chord2 = glm::dot(d, d);
    return 2.0 * std::sqrt(chord2 / (1.0 - 0.25 * chord2));
}

} // namespace

Result<glm::dquat> unit_turn(glm::dquat turn) {
    const double square = glm::dot(turn, turn);
    if (!(std::abs(square - 1.0) <= 1e-3))
        return fail("expected a unit quaternion [w, x, y, z], found length {:.6g}",
                    std::sqrt(square));
    return std::abs(square - 1.0) < 1e-14 ? turn : turn / std::sqrt(square);
}

Result<StrokePose> checked_pose(const StrokePose& pose) {
    const glm::dvec3 at = glm::abs(pose.tool.position_mm);
    if (!(at.x <= kFarthest_mm && at.y <= kFarthest_mm && at.z <= kFarthest_mm)) // or not a number
        return fail("expected a tip within {:g} mm, found ({}, {}, {})", kFarthest_mm,
                    pose.tool.position_mm.x, pose.tool.position_mm.y, pose.tool.position_mm.z);
    if (!(std::abs(pose.time_s) <= kLongest_s))
        return fail("expected a time within {:g} s, found {}", kLongest_s, pose.time_s);
    PALPATE_TRY(const glm::dquat turn, unit_turn(pose.tool.rotation));
    return StrokePose{pose.time_s, {pose.tool.position_mm, turn}};
}

StrokePose pose_between(const StrokePose& from, const StrokePose& to, double t) {
    return {from.time_s + t * (to.time_s - from.time_s),
            {from.tool.position_mm + t * (to.tool.position_mm - from.tool.position_mm),
             turn_between(from.tool.rotation,
                          in_hemisphere_of(to.tool.rotation, from.tool.rotation), t)}};
}

double travel_mm(const StrokePose& from, const StrokePose& to, double reach_mm) {
    return glm::length(to.tool.position_mm - from.tool.position_mm) +
           reach_mm * largest_angle(from.tool.rotation,
                                    in_hemisphere_of(to.tool.rotation, from.tool.rotation));
}

double Sweep::tolerance_for(const Grid& grid) {
    return smallest_spacing_mm(grid) / 16.0;
}

Sweep::Sweep(const Tool& tool, const Grid& grid, const StrokePose& from, const StrokePose& to,
             double wider)
    : shape_(tool.shape.get()), marks_(tool.marks_origin), axes_(grid.world_from_index) {
    const glm::dvec3 origin(grid.world_from_index[3]);
    const glm::dmat3 to_index = glm::inverse(axes_);
    longest_mm_ = std::max({glm::length(axes_[0]), glm::length(axes_[1]), glm::length(axes_[2])});
    from_ = from.tool.position_mm - origin;
    to_ = to.tool.position_mm - origin;
    from_index_ = to_index * from_;
    to_index_ = to_index * to_;
    low_ = glm::dvec3(std::numeric_limits<double>::infinity());
    high_ = -low_;
    if (shape_) {
        box_ = shape_->bounds();
        reach_ = box_.reach_mm();
        ball_ = shape_->ball_radius_mm().value_or(-1.0);
        from_turn_ = from.tool.rotation;
        to_turn_ = in_hemisphere_of(to.tool.rotation, from.tool.rotation);
        turn_ = glm::mat3_cast(from_turn_);
        speed_ = travel_mm(from, to, reach_);
        tolerance_ = ball_ < 0.0 && speed_ > 0.0 ? tolerance_for(grid) : 0.0;
        // The corners of the bounds at both ends, and between them as far from the chord as a
        // point at `reach` swings: reach * (1 - cos(half the turn)), which the quaternions' dot is.
        const double swing = reach_ * (1.0 - std::min(1.0, glm::dot(from_turn_, to_turn_)));
        glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
        for (const glm::dquat& turn : {from_turn_, to_turn_})
            for (uint32_t corner = 0; corner < 8; ++corner) {
                const glm::dvec3 c(corner & 1 ? box_.high.x : box_.low.x,
                                   corner & 2 ? box_.high.y : box_.low.y,
                                   corner & 4 ? box_.high.z : box_.low.z);
                const glm::dvec3 index = to_index * (glm::mat3_cast(turn) * c);
                low = glm::min(low, index);
                high = glm::max(high, index);
            }
        const glm::dmat3 rows = glm::transpose(to_index);
        const glm::dvec3 row_length(glm::length(rows[0]), glm::length(rows[1]),
                                    glm::length(rows[2]));
        if (ball_ >= 0.0) { // tighter than its box where axes are oblique
            low = -ball_ * row_length;
            high = ball_ * row_length;
        }
        const glm::dvec3 more = (swing + tolerance_ + wider * longest_mm_ +
                                 1e-9 * (1.0 + reach_)) * // what rounding takes
                                row_length;
        low_ = glm::min(from_index_, to_index_) + low - more;
        high_ = glm::max(from_index_, to_index_) + high + more;
    }
    if (marks_) {
        low_ = glm::min(low_, glm::min(from_index_, to_index_) - 0.5);
        high_ = glm::max(high_, glm::max(from_index_, to_index_) + 0.5);
    }
}

double Sweep::value(double t, glm::dvec3 p_mm) const {
    const glm::dvec3 from_tip = p_mm - (from_ + t * (to_ - from_));
    const glm::dvec3 q = from_turn_ == to_turn_
                             ? from_tip * turn_ // a row vector: by the inverse
                             : from_tip * glm::mat3_cast(turn_between(from_turn_, to_turn_, t));
    return std::max(shape_->signed_mm(q), box_.signed_mm(q));
}

Sweep::Verdict Sweep::at(glm::dvec3 p_mm) const {
    if (!shape_)
        return {false, std::numeric_limits<double>::infinity()};
    if (ball_ >= 0.0) {
        const double d = to_segment(p_mm, from_, to_) - ball_;
        return {d <= 0.0, std::abs(d)};
    }
    // No point of the tool is farther than `reach` from the tip's path.
    const double away = to_segment(p_mm, from_, to_) - reach_;
    if (away > tolerance_)
        return {false, away - tolerance_};
    double lowest = std::numeric_limits<double>::infinity();
    for (double t = 0.0;;) {
        const double v = value(t, p_mm);
        if (v <= tolerance_)
            return {true, std::max(0.0, -v)};
        lowest = std::min(lowest, v);
        if (t >= 1.0 || speed_ == 0.0)
            break;
        // Nothing between here and there is below zero: no point of the tool is faster.
        t = std::min(1.0, t + v / speed_);
    }
    // Between two poses looked at, the function is at least half of what it is at the later.
    const double bound = speed_ == 0.0 ? lowest : 0.5 * lowest - tolerance_;
    return {false, std::max(0.0, bound)};
}

Sweep::Near Sweep::near(glm::dvec3 p_mm) const {
    const auto far_away = [&](double mm) { return Near{mm, longest_mm_}; };
    if (!shape_)
        return far_away(std::numeric_limits<double>::infinity());
    if (ball_ >= 0.0) {
        const glm::dvec3 away = from_segment(p_mm, from_, to_);
        const double length = glm::length(away), mm = length - ball_;
        if (std::abs(mm) >= far_mm() || length == 0.0)
            return far_away(mm);
        const glm::dvec3 along = glm::abs(away * axes_) / length;
        return {mm, std::max({along.x, along.y, along.z})};
    }
    // No point of the tool is farther than `reach` from the tip's path.
    if (const double mm = to_segment(p_mm, from_, to_) - reach_; mm >= far_mm())
        return far_away(mm);
    double lowest = std::numeric_limits<double>::infinity(), lowest_t = 0.0;
    for (double t = 0.0;;) {
        const double here = value(t, p_mm);
        if (here < lowest) {
            lowest = here;
            lowest_t = t;
        }
        if (lowest <= -far_mm() || t >= 1.0 || speed_ == 0.0)
            break;
        // Until then the function stays above the lowest by now, or far from the surface, but for
        // the tolerance: no point of the tool is faster.
        t = std::min(1.0, t + (here - std::min(lowest, far_mm()) + tolerance_) / speed_);
    }
    if (std::abs(lowest) >= far_mm())
        return far_away(lowest);
    // The whole sweep changes with p as the tool does at the moment at which it is nearest.
    double most = 0.0;
    for (int axis = 0; axis < 3; ++axis)
        for (const double half : {-0.5, 0.5})
            most =
                std::max(most, 2.0 * std::abs(value(lowest_t, p_mm + half * axes_[axis]) - lowest));
    if (most > 0.0)
        return {lowest, most};
    return {lowest, lowest != 0.0 ? std::abs(lowest) / kWallReach : longest_mm_}; // flat: all there
}

std::pair<double, double> Sweep::marked_in_row(double y, double z) const {
    if (!marks_)
        return {1.0, 0.0};
    double first = 0.0, last = 1.0;
    const glm::dvec3 d = to_index_ - from_index_;
    for (const auto& [axis, center] : {std::pair(1, y), std::pair(2, z)}) {
        const double a = center - 0.5 - from_index_[axis], b = center + 0.5 - from_index_[axis];
        if (d[axis] == 0.0) {
            if (a > 0.0 || b < 0.0)
                return {1.0, 0.0};
            continue;
        }
        first = std::max(first, std::min(a / d[axis], b / d[axis]));
        last = std::min(last, std::max(a / d[axis], b / d[axis]));
    }
    if (first > last)
        return {1.0, 0.0};
    const double x0 = from_index_.x + first * d.x, x1 = from_index_.x + last * d.x;
    return {std::ceil(std::min(x0, x1) - 0.5), std::floor(std::max(x0, x1) + 0.5)};
}

} // namespace palpate
