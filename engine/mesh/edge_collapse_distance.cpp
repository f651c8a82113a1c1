// Keeps the distance during collapses: attached vertices, new triangles, and the original's.

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/mesh/edge_collapse.h"

namespace palpate {

namespace {

constexpr double kNotReached = std::numeric_limits<double>::infinity();

} // namespace

void EdgeCollapse::attach_vertices() {
    first_witness_.resize(triangles_.size(), kNone);
    witness_of_corner_.resize(3 * triangles_.size(), kNone);
    near_.resize(3 * triangles_.size());
    slot_.resize(triangles_.size(), kNone);
    looked_at_.resize(triangles_.size(), 0);
    seen_.resize(triangles_.size(), 0);
    hint_.resize(triangles_.size());
    std::iota(hint_.begin(), hint_.end(), 0u);
    std::vector<std::array<uint32_t, 2>> of_patch; // witness
    for (uint32_t v = 0; v < points_.size(); ++v) {
        of_patch.clear();
        for (uint32_t corner = first_corner_[v]; corner != kNone; corner = next_corner_[corner]) {
            const uint32_t n = corner / 3, patch = source_.patch[n];
            near_[corner] = n;
            auto at = std::find_if(of_patch.begin(), of_patch.end(),
                                   [&](const auto& pair) { return pair[0] == patch; });
            if (at == of_patch.end()) {
                const auto w = static_cast<uint32_t>(witnesses_.size());
                witnesses_.push_back({v, first_witness_[n], n});
                first_witness_[n] = w;
                at = of_patch.insert(at, {patch, w});
            }
            witness_of_corner_[corner] = (*at)[1];
        }
    }
    taker_.resize(witnesses_.size(), kNone);
}

double EdgeCollapse::error_of_attached() {
    double largest = 0.0;
    const auto attach = [&](uint32_t n) {
        for (uint32_t w = first_witness_[n]; w != kNone; w = witnesses_[w].next) {
            const glm::dvec3 point = source_.points[witnesses_[w].vertex];
            double best = kNotReached;
            uint32_t taker = kNone;
            for (const Changed& changed : changed_) {
                if (source_.patch[changed.triangle] != source_.patch[n])
                    continue;
                const double d = distance_to(changed.points, point);
                if (d < best) {
                    best = d;
                    taker = changed.triangle;
                }
            }
            largest = std::max(largest, best);
            if (taker == kNone || largest > options_.limit_mm)
                return;
            attached_to_.push_back({w, taker});
            taker_[w] = taker;
        }
    };
    for (const uint32_t n : dying_)
        attach(n);
    for (const Changed& changed : changed_)
        attach(changed.triangle);
    return largest;
}

bool EdgeCollapse::is_dying(uint32_t n) const {
    return std::find(dying_.begin(), dying_.end(), n) != dying_.end();
}

Corners EdgeCollapse::original(uint32_t n) const {
    const glm::uvec3 t = source_.mesh.triangles[n];
    return {source_.points[t.x], source_.points[t.y], source_.points[t.z]};
}

Corners EdgeCollapse::current(uint32_t n) const {
    if (slot_[n] != kNone)
        return changed_[slot_[n]].points;
    const glm::uvec3 t = triangles_[n];
    return {points_[t.x], points_[t.y], points_[t.z]};
}

// The nearest of some triangles, or what was found before where that is nearer.
EdgeCollapse::Found EdgeCollapse::nearest_of(const std::vector<Candidate>& candidates,
                                             glm::dvec3 point, uint32_t patch, Found found) {
    for (const Candidate& candidate : candidates)
        if (candidate.patch == patch && candidate.may_be_within(found.distance_mm, point))
            if (const double d = distance_to(candidate.points, point); d < found.distance_mm)
                found = {candidate.triangle, d};
    return found;
}

// Looks among the originals near the edge, and among all if none of these is near enough.
EdgeCollapse::Found EdgeCollapse::nearest_original(glm::dvec3 point, uint32_t patch,
                                                   std::span<const uint32_t> hints) const {
    Found found{kNone, kNotReached};
    for (size_t k = 0; k < hints.size(); ++k)
        if (const uint32_t n = hints[k]; n != kNone && (k == 0 || n != hints[k - 1]))
            if (const double d = distance_to(original(n), point); d < found.distance_mm)
                found = {n, d};
    found = nearest_of(originals_, point, patch, found);
    if (found.distance_mm <= level_)
        return found;
    const TriangleTree::Nearest nearest = source_.trees[patch].nearest(point, found.distance_mm);
    if (nearest.triangle != kNone)
        found = {source_.triangles_of_patch[patch][nearest.triangle], nearest.distance_mm};
    return found;
}

double EdgeCollapse::error_of_new() {
    for (Changed& changed : changed_) { // the vertex first, which is in all of them
        const uint32_t patch = source_.patch[changed.triangle];
        const auto same = std::find_if(changed_.begin(), changed_.end(), [&](const Changed& c) {
            return source_.patch[c.triangle] == patch;
        });
        if (&*same != &changed) {
            changed.near = same->near;
            continue;
        }
        const Found found = nearest_original(
            point_, patch,
            std::span(&near_[3 * size_t{changed.triangle} + changed.moved_corner], 1));
        if (found.distance_mm > level_)
            return found.distance_mm;
        changed.near = found.triangle;
    }
    for (const Changed& changed : changed_) {
        Piece whole;
        whole.count = 3;
        for (size_t i = 0; i < 3; ++i) {
            whole.corners[i] = changed.points[i];
            whole.near[i] =
                i == changed.moved_corner ? changed.near : near_[3 * size_t{changed.triangle} + i];
        }
        const uint32_t patch = source_.patch[changed.triangle];
        const double error = proof_.prove(
            whole, level_, [&](uint32_t n) { return original(n); },
            [&](glm::dvec3 point, const std::array<uint32_t, 3>& near) {
                return nearest_original(point, patch, near);
            });
        if (error > level_)
            return error;
    }
    return level_;
}

EdgeCollapse::Candidate::Candidate(uint32_t n, uint32_t of_patch, const Corners& corners)
    : triangle(n), patch(of_patch), points(corners) {
    centre = (points[0] + points[1] + points[2]) / 3.0;
    double square = 0.0;
    for (const glm::dvec3 p : points)
        square = std::max(square, glm::dot(p - centre, p - centre));
    radius = std::sqrt(square);
}

// Those at the attached vertices.
void EdgeCollapse::gather_originals() {
    originals_.clear();
    ++judgement_;
    for (const auto& [w, taker] : attached_to_) {
        const uint32_t v = witnesses_[w].vertex;
        for (uint32_t i = source_.incident.first[v]; i < source_.incident.first[v + 1]; ++i) {
            const uint32_t n = source_.incident.triangles[i];
            if (looked_at_[n] == judgement_ || source_.patch[n] != source_.patch[taker])
                continue;
            looked_at_[n] = judgement_;
            originals_.emplace_back(n, source_.patch[n], original(n));
        }
    }
}

// The triangles about the edge and those that share a vertex with them, as they are after it.
void EdgeCollapse::gather_candidates() {
    candidates_.clear();
    mark_now_ += 2;
    for (const Changed& changed : changed_) {
        candidates_.emplace_back(changed.triangle, source_.patch[changed.triangle], changed.points);
        seen_[changed.triangle] = judgement_;
    }
    for (const uint32_t n : dying_)
        seen_[n] = judgement_;
    for (const Changed& changed : changed_)
        for (int i = 0; i < 3; ++i) {
            const uint32_t v = changed.corners[i];
            if (v == keep_ || mark_[v] == mark_now_)
                continue;
            mark_[v] = mark_now_;
            for (uint32_t corner = first_corner_[v]; corner != kNone; corner = next_corner_[corner])
                if (const uint32_t n = corner / 3;
                    triangles_[n].x != kNone && seen_[n] != judgement_) {
                    seen_[n] = judgement_;
                    candidates_.emplace_back(n, source_.patch[n], current(n));
                }
        }
}

double EdgeCollapse::error_of_original() {
    gather_candidates();
    const auto prove_triangle = [&](uint32_t n) {
        const uint32_t patch = source_.patch[n];
        const Corners corners = original(n);
        Piece whole;
        whole.count = 3;
        for (size_t i = 0; i < 3; ++i) {
            whole.corners[i] = corners[i];
            const uint32_t w = witness_of_corner_[3 * size_t{n} + i];
            whole.near[i] = taker_[w] != kNone ? taker_[w] : witnesses_[w].holder;
        }
        // Often it still lies where it did before.
        if (const uint32_t t = hint_[n]; triangles_[t].x != kNone && seen_[t] == judgement_ &&
                                         (slot_[t] != kNone || !is_dying(t)))
            whole.near[2] = t;
        const double error = proof_.prove(
            whole, level_, [&](uint32_t t) { return current(t); },
            [&](glm::dvec3 point, const std::array<uint32_t, 3>& near) {
                Found found{kNone, kNotReached};
                for (const uint32_t t : near)
                    if (t != kNone)
                        if (const double d = distance_to(current(t), point); d < found.distance_mm)
                            found = {t, d};
                found = nearest_of(candidates_, point, patch, found);
                if (near[1] != kNone) // of the whole
                    hint_[n] = found.triangle;
                return found;
            });
        return error;
    };
    for (const Candidate& candidate : originals_)
        if (const double error = prove_triangle(candidate.triangle); error > level_)
            return error;
    return level_;
}

} // namespace palpate
