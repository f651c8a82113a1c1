#include "bench/touch/figures.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/base/assert.h"

namespace palpate::touch {

using glm::dvec3;

void Histogram::add(double value) {
    const double at = std::clamp(value / bin_, 0.0, static_cast<double>(bins_.size() - 1));
    ++bins_[static_cast<size_t>(at)];
    ++count_;
    max_ = std::max(max_, value);
}

void Histogram::add(const Histogram& other) {
    PALPATE_ASSERT(other.bin_ == bin_);
    for (size_t i = 0; i < bins_.size(); ++i)
        bins_[i] += other.bins_[i];
    count_ += other.count_;
    max_ = std::max(max_, other.max_);
}

double Histogram::percentile(double share) const {
    uint64_t below = 0;
    for (size_t i = 0; i < bins_.size(); ++i) {
        below += bins_[i];
        if (count_ && static_cast<double>(below) >= share * static_cast<double>(count_))
            return i + 1 == bins_.size() ? max_ : std::min(max_, bin_ * static_cast<double>(i + 1));
    }
    return 0.0;
}

uint64_t Histogram::above(double edge) const {
    uint64_t found = 0;
    for (auto i = static_cast<size_t>(std::lround(edge / bin_)); i < bins_.size(); ++i)
        found += bins_[i];
    return found;
}

namespace {

bool is_finite(dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Ticks after an edit, and newtons a tick at which what it moved is bled off: 9 N in that time. A
// hand that an edit finds deeper waits longer.
constexpr uint64_t kSettled = 100;
constexpr double kBled_n = 0.09;

uint64_t hashed(uint64_t hash, dvec3 v) { // FNV-1a, a word at a time
    for (int axis = 0; axis < 3; ++axis)
        hash = (hash ^ std::bit_cast<uint64_t>(v[axis])) * 0x100000001b3u;
    return hash;
}

} // namespace

Judge::Judge(const Scene& scene, double stiffness, bool judge_jumps, bool judge_direction,
             double tool_radius_mm)
    : scene_(scene),
      solid_(grown(scene.body.solid, tool_radius_mm)),
      stiffness_(stiffness),
      tool_radius_mm_(tool_radius_mm),
      judge_jumps_(judge_jumps && scene.body.judge_jumps),
      judge_direction_(judge_direction) {}

void Judge::exchange(const Solid& solid) {
    solid_ = grown(solid, tool_radius_mm_);
    since_exchange_ = 0;
}

void Judge::see(dvec3 tool, const haptics::TickOutput& output) {
    Figures& f = figures_;
    ++f.ticks;
    const dvec3 proxy = output.proxy.position_mm, force = output.force_n;
    f.force_bits = hashed(f.force_bits, force);
    if (!is_finite(proxy) || !is_finite(force) || !is_finite(output.normal)) {
        ++f.not_finite;
        has_last_ = false;
        return;
    }
    const double sunk = -solid_.distance_mm(proxy) / voxel_mm(scene_.storage);
    const double depth = -solid_.distance_mm(tool);
    const bool is_behind = output.contact == haptics::Contact::behind;
    f.behind_ticks += is_behind;
    f.contact_ticks += output.contact != haptics::Contact::free;
    f.largest_force_n = std::max(f.largest_force_n, glm::length(force));
    f.beyond_spring_n = std::max(
        f.beyond_spring_n, glm::length(force) - 1e-3 * stiffness_ * glm::distance(proxy, tool));
    if (scene_.body.force_n)
        if (const auto truth = scene_.body.force_n(tool, has_proxy_ ? last_proxy_ : tool))
            f.closed_form_n = std::max(f.closed_form_n, glm::distance(force, *truth));
    last_proxy_ = proxy;
    has_proxy_ = true;

    if (glm::any(glm::greaterThan(glm::abs(proxy), dvec3(scene_.body.reach_mm - 1.0)))) {
        is_blind_ = true;
    } else if (is_blind_ && sunk < 0.0 && depth < 0.0) {
        is_blind_ = false;
        sunk_ = false;
        part_ = solid_.part ? solid_.part(proxy) : 0;
    }
    if (is_blind_) {
        has_last_ = false;
        return;
    }
    if (since_exchange_ == 0) {
        const double moved_n = glm::length(last_force_) + 1e-3 * stiffness_ * std::max(0.0, depth);
        settled_after_ = std::max(kSettled, static_cast<uint64_t>(moved_n / kBled_n) + 1);
    }
    if (since_exchange_ >= settled_after_) {
        see_place(proxy, sunk);
        if (!is_behind)
            see_direction(tool, force, depth);
        if (judge_direction_ && solid_.free_is_convex && -depth > voxel_mm(scene_.storage))
            f.free_force_n = std::max(f.free_force_n, glm::length(force));
    }
    if (has_last_)
        see_change(tool, force, depth);
    ++since_exchange_;
    has_last_ = true;
    last_tool_ = tool;
    last_force_ = force;
}

void Judge::see_place(dvec3 proxy, double sunk) {
    figures_.penetration_voxels = std::max(figures_.penetration_voxels, sunk);
    if (solid_.part) {
        const int part = solid_.part(proxy);
        figures_.pop_throughs += part >= 0 && part != part_;
        part_ = part >= 0 ? part : part_;
    } else {
        figures_.pop_throughs += sunk > 1.5 && !sunk_;
        sunk_ = sunk > 1.5;
    }
}

void Judge::see_direction(dvec3 tool, dvec3 force, double depth) {
    if (!judge_direction_ || !solid_.nearest_free || depth <= 0.2 || depth > scene_.body.deepest_mm)
        return;
    const auto nearest = solid_.nearest_free(tool);
    if (!nearest)
        return;
    const dvec3 truth = *nearest - tool;
    const double size = glm::length(truth), got = glm::length(force) / stiffness_ * 1000.0;
    if (depth > 1.0)
        figures_.magnitude_share.add(std::abs(got - size) / size);
    const double cosine = got > 0.0 ? glm::dot(truth, force) / (size * glm::length(force)) : -1.0;
    figures_.direction_deg.add(glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0))));
}

void Judge::see_change(dvec3 tool, dvec3 force, double depth) {
    const double moved = glm::distance(tool, last_tool_);
    const double excess =
        glm::distance(force, last_force_) - stiffness_ * 1e-3 * moved * expansion(solid_, depth);
    if (judge_jumps_ && depth <= scene_.body.deepest_mm) {
        if (excess > figures_.excess_jump_n) {
            figures_.excess_jump_n = excess;
            figures_.worst_tick = figures_.ticks;
        }
        if (since_exchange_ == 0)
            figures_.edit_jump_n = std::max(figures_.edit_jump_n, excess);
    }
    // Force held from one tick to the next (zero-order hold) works along the way.
    figures_.energy_mj += glm::dot(last_force_, tool - last_tool_);
}

} // namespace palpate::touch
