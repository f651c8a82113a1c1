#include "engine/mesh/edge_collapse.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

constexpr double kFirstLevel = 1.0 / 64.0; // of the limit, and of an edge's length
constexpr double kWorthAnotherPass = 0.01; // of the triangles
constexpr int kMostPasses = 6;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

} // namespace

EdgeCollapse::EdgeCollapse(const CollapseSource& source, Options options)
    : source_(source),
      options_(std::move(options)),
      linear_(source.local_from_mesh),
      inverse_(glm::inverse(linear_)),
      offset_(source.local_from_mesh[3]),
      points_(source.points),
      positions_(source.mesh.positions),
      triangles_(source.mesh.triangles) {
    const size_t vertices = points_.size();
    moved_.resize(vertices, 0);
    stamp_.resize(vertices, 0);
    mark_.resize(vertices, 0);
    first_corner_.resize(vertices, kNone);
    next_corner_.resize(3 * triangles_.size(), kNone);
    for (uint32_t n = static_cast<uint32_t>(triangles_.size()); n-- > 0;) {
        if (is_degenerate(triangles_[n])) {
            triangles_[n].x = kNone;
            continue;
        }
        ++alive_;
        for (uint32_t i = 0; i < 3; ++i) {
            uint32_t& first = first_corner_[triangles_[n][int(i)]];
            next_corner_[3 * n + i] = first;
            first = 3 * n + i;
        }
    }
    classify_vertices();
    add_quadrics();
    attach_vertices();
    // Levels that rise keep the distance small where a count is asked for. Where the distance alone
    // decides, they would only have edges looked at again and again.
    const bool is_counted = options_.least_triangles > 0 || std::isinf(options_.limit_mm);
    level_ =
        is_counted ? kFirstLevel * std::min(options_.limit_mm, source.edge_mm) : options_.limit_mm;
}

// Those of the triangles; and for lines, planes through their edges at right angles to them.
void EdgeCollapse::add_quadrics() {
    quadrics_.resize(points_.size());
    for (uint32_t n = 0; n < triangles_.size(); ++n) {
        const glm::uvec3 t = triangles_[n];
        if (t.x == kNone)
            continue;
        const glm::dvec3 normal = twice_area_normal({points_[t.x], points_[t.y], points_[t.z]});
        const double twice_area = glm::length(normal);
        if (!(twice_area > 0.0))
            continue;
        const glm::dvec3 unit = normal / twice_area;
        for (int i = 0; i < 3; ++i) {
            quadrics_[t[i]].add_plane(unit, points_[t.x], twice_area / 6.0);
            const uint32_t a = t[i], b = t[(i + 1) % 3];
            if (!is_line_edge(a, b))
                continue;
            const glm::dvec3 along = points_[b] - points_[a];
            const glm::dvec3 side = glm::cross(unit, along);
            const double length = glm::length(side);
            if (!(length > 0.0))
                continue;
            for (const uint32_t v : {a, b})
                quadrics_[v].add_plane(side / length, points_[a], glm::dot(along, along) / 2.0);
        }
    }
}

// The triangles at a vertex. Corners of those that are gone leave its list.
void EdgeCollapse::corners_of(uint32_t v, std::vector<uint32_t>& triangles) {
    triangles.clear();
    uint32_t* link = &first_corner_[v];
    while (*link != kNone) {
        const uint32_t corner = *link;
        if (triangles_[corner / 3].x == kNone) {
            *link = next_corner_[corner];
            continue;
        }
        triangles.push_back(corner / 3);
        link = &next_corner_[corner];
    }
}

EdgeCollapse::Verdict EdgeCollapse::judge(uint32_t a, uint32_t b) {
    for (const Changed& changed : changed_)
        slot_[changed.triangle] = kNone;
    for (const auto& [w, taker] : attached_to_)
        taker_[w] = kNone;
    attached_to_.clear();
    changed_.clear();
    if (!place(a, b) || !keeps_topology())
        return {Refusal::topology};
    if (!keeps_shape() && !keeps_shape_at_an_end())
        return {Refusal::shape};
    for (uint32_t i = 0; i < changed_.size(); ++i)
        slot_[changed_[i].triangle] = i;
    double error = error_of_attached();
    if (error == kInfinite)
        return {Refusal::topology}; // nothing of a patch would be left here
    if (error <= level_) {
        gather_originals();
        error = error_of_new();
    }
    if (error <= level_)
        error = error_of_original();
    return {error <= level_ ? Refusal::none : Refusal::distance, error};
}

void EdgeCollapse::collapse() {
    for (const uint32_t n : dying_)
        first_witness_[n] = kNone;
    for (const Changed& changed : changed_) {
        first_witness_[changed.triangle] = kNone;
        near_[3 * size_t{changed.triangle} + changed.moved_corner] = changed.near;
    }
    for (const auto& [w, taker] : attached_to_) {
        witnesses_[w].holder = taker;
        witnesses_[w].next = first_witness_[taker];
        first_witness_[taker] = w;
    }
    for (const uint32_t n : dying_)
        triangles_[n].x = kNone;
    alive_ -= dying_.size();
    first_corner_[keep_] = first_corner_[gone_] = kNone;
    for (const Changed& changed : changed_) {
        triangles_[changed.triangle] = changed.corners;
        const uint32_t corner = 3 * changed.triangle + changed.moved_corner;
        next_corner_[corner] = first_corner_[keep_];
        first_corner_[keep_] = corner;
    }
    if (kind_[gone_] == Kind::line) {
        const uint32_t beyond = other_end(gone_, keep_);
        if (kind_[beyond] == Kind::line)
            line_[beyond][line_[beyond][0] == gone_ ? 0 : 1] = keep_;
        if (kind_[keep_] == Kind::line)
            line_[keep_][line_[keep_][0] == gone_ ? 0 : 1] = beyond;
    }
    moved_[keep_] = moved_[keep_] || position_ != positions_[keep_];
    points_[keep_] = point_;
    positions_[keep_] = position_;
    quadrics_[keep_] = quadrics_[keep_] + quadrics_[gone_];
    stamp_[gone_] = kNone;
    ++stamp_[keep_];
}

bool EdgeCollapse::push(uint32_t a, uint32_t b) {
    if (!place(a, b))
        return false;
    const double key = std::sqrt((quadrics_[a] + quadrics_[b]).mean_square(point_));
    queue_.push({static_cast<float>(key), a, b, stamp_[a] + stamp_[b]});
    return true;
}

void EdgeCollapse::push_edges_of(uint32_t v) {
    corners_of(v, dying_);
    mark_now_ += 2;
    mark_[v] = mark_now_;
    for (const uint32_t n : dying_)
        for (int i = 0; i < 3; ++i)
            if (const uint32_t other = triangles_[n][i]; mark_[other] != mark_now_) {
                mark_[other] = mark_now_;
                push(v, other);
            }
}

void EdgeCollapse::push_all() {
    queue_ = {};
    kept_ = {};
    std::vector<uint32_t> around;
    for (uint32_t v = 0; v < points_.size(); ++v) {
        if (stamp_[v] == kNone)
            continue;
        corners_of(v, around);
        mark_now_ += 2;
        for (const uint32_t n : around)
            for (int i = 0; i < 3; ++i)
                if (const uint32_t other = triangles_[n][i];
                    other > v && mark_[other] != mark_now_) {
                    mark_[other] = mark_now_;
                    if (!push(v, other))
                        ++kept_.by_topology;
                }
    }
}

// Returns whether it came to the queue's end.
bool EdgeCollapse::run_queue() {
    uint64_t looks = 0;
    while (!queue_.empty()) {
        if (++looks % 1024 == 0) {
            if (options_.stop.stop_requested())
                return false;
            if (options_.progress)
                options_.progress(1.0 - double(alive_) / double(source_.mesh.triangles.size()));
        }
        if (alive_ <= options_.least_triangles)
            return false;
        const Entry top = queue_.top();
        queue_.pop();
        if (stamp_[top.a] == kNone || stamp_[top.b] == kNone ||
            top.stamp != stamp_[top.a] + stamp_[top.b])
            continue;
        if (double(top.key) > options_.limit_mm) {
            ++kept_.by_distance;
            continue;
        }
        if (double(top.key) > level_)
            level_ =
                std::min(std::max(NearProof::kStep * level_, double(top.key)), options_.limit_mm);
        const Verdict verdict = judge(top.a, top.b);
        switch (verdict.refusal) {
            case Refusal::none:
                collapse();
                push_edges_of(keep_);
                break;
            case Refusal::distance:
                // Rounded up, so that at its next turn the level reaches it.
                if (verdict.error_mm <= options_.limit_mm)
                    queue_.push({std::nextafter(static_cast<float>(verdict.error_mm), HUGE_VALF),
                                 top.a, top.b, top.stamp});
                else
                    ++kept_.by_distance;
                break;
            case Refusal::topology:
                ++kept_.by_topology;
                break;
            case Refusal::shape:
                ++kept_.by_shape;
                break;
        }
    }
    return true;
}

// Refused collapses may be possible once their neighbours have changed: another pass looks.
void EdgeCollapse::run() {
    for (int pass = 0; pass < kMostPasses; ++pass) {
        const uint64_t before = alive_;
        push_all();
        if (!run_queue() || double(before - alive_) < kWorthAnotherPass * double(before))
            return;
    }
}

std::vector<uint32_t> EdgeCollapse::survivors() const {
    std::vector<uint32_t> list;
    for (uint32_t n = 0; n < triangles_.size(); ++n)
        if (triangles_[n].x != kNone)
            list.push_back(n);
    return list;
}

} // namespace palpate
