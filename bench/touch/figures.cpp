#include "bench/touch/figures.h"

#include <algorithm>
#include <cmath>

namespace palpate::touch {

using glm::dvec3;

void Histogram::add(double value) {
    const double at = std::clamp(value / bin_, 0.0, static_cast<double>(bins_.size() - 1));
    ++bins_[static_cast<size_t>(at)];
    ++count_;
    max_ = std::max(max_, value);
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

namespace {

bool is_finite(dvec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

} // namespace

Judge::Judge(const Scene& scene, double stiffness, bool judge_jumps, bool judge_direction)
    : scene_(scene),
      stiffness_(stiffness),
      judge_jumps_(judge_jumps && scene.body.judge_jumps),
      judge_direction_(judge_direction) {}

void Judge::see(dvec3 tool, const haptics::TickOutput& output) {
    Figures& f = figures_;
    ++f.ticks;
    const dvec3 proxy = output.proxy.position_mm, force = output.force_n;
    if (!is_finite(proxy) || !is_finite(force) || !is_finite(output.normal)) {
        ++f.not_finite;
        has_last_ = false;
        return;
    }
    const Solid& solid = scene_.body.solid;
    const double voxel = voxel_mm(scene_.storage);
    const double sunk = depth_mm(scene_.body, proxy) / voxel;
    const double depth = depth_mm(scene_.body, tool);
    if (glm::any(glm::greaterThan(glm::abs(proxy), dvec3(kReach_mm - 1.0)))) {
        is_blind_ = true;
    } else if (is_blind_ && sunk < 0.0 && depth < 0.0) {
        is_blind_ = false;
        sunk_ = false;
        part_ = solid.part ? solid.part(proxy) : 0;
    }
    f.contact_ticks += output.contact != haptics::Contact::free;
    f.largest_force_n = std::max(f.largest_force_n, glm::length(force));
    if (is_blind_) {
        has_last_ = false;
        return;
    }
    f.penetration_voxels = std::max(f.penetration_voxels, sunk);
    if (solid.part) {
        const int part = solid.part(proxy);
        f.pop_throughs += part >= 0 && part != part_;
        part_ = part >= 0 ? part : part_;
    } else {
        f.pop_throughs += sunk > 1.5 && !sunk_;
        sunk_ = sunk > 1.5;
    }

    if (judge_direction_ && solid.nearest_free && depth > 0.2 && depth <= scene_.body.deepest_mm) {
        if (const auto nearest = solid.nearest_free(tool)) {
            const dvec3 truth = *nearest - tool;
            const double size = glm::length(truth), got = glm::length(force) / stiffness_ * 1000.0;
            if (depth > 1.0)
                f.magnitude_share.add(std::abs(got - size) / size);
            const double cosine =
                got > 0.0 ? glm::dot(truth, force) / (size * glm::length(force)) : -1.0;
            f.direction_deg.add(glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0))));
        }
    }
    if (has_last_) {
        const double moved = glm::distance(tool, last_tool_);
        const double expansion =
            depth > 0.0 && solid.expansion ? solid.expansion(std::max(depth, 0.0)) : 1.0;
        const double excess = glm::distance(force, last_force_) -
                              stiffness_ * 1e-3 * moved * std::max(1.0, expansion);
        if (judge_jumps_ && depth <= scene_.body.deepest_mm && excess > f.excess_jump_n) {
            f.excess_jump_n = excess;
            f.worst_tick = f.ticks;
        }
        // Force held from one tick to the next (zero-order hold) works along the way.
        f.energy_mj += glm::dot(last_force_, tool - last_tool_);
    }
    has_last_ = true;
    last_tool_ = tool;
    last_force_ = force;
}

} // namespace palpate::touch
