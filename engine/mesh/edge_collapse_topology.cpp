// Keeps the topology and the shape during collapses: the kinds of vertices, the place of a new one,
// and the reasons that forbid it.

#include <algorithm>
#include <tuple>

#include "engine/base/forest.h"
#include "engine/mesh/edge_collapse.h"

namespace palpate {

namespace {

constexpr double kPull = 1e-3;   // to the middle of the edge, beside the planes' pull
constexpr double kFold = 0.1;    // cosine between a triangle's normals before and after
constexpr double kSliver = 0.02; // twice the area over the sum of the squared sides
constexpr double kNeverCollapsed = std::numeric_limits<double>::infinity();

double roundness(const Corners& c) {
    const glm::dvec3 u = c[1] - c[0], v = c[2] - c[1], w = c[0] - c[2];
    const double sum = glm::dot(u, u) + glm::dot(v, v) + glm::dot(w, w);
    return sum > 0.0 ? glm::length(twice_area_normal(c)) / sum : 0.0;
}

bool has(glm::uvec3 t, uint32_t v) {
    return t.x == v || t.y == v || t.z == v;
}

} // namespace

// A vertex is inside where its triangles form one closed fan of one patch; on a line where two of
// its edges are a line's and each of its fans runs from one to the other; and fixed elsewhere.
void EdgeCollapse::classify_vertices() {
    struct Side {
        uint32_t other, fan, patch;
        bool outward;
    };
    kind_.resize(points_.size(), Kind::fixed);
    line_.resize(points_.size(), {kNone, kNone});
    std::vector<Side> sides;
    std::vector<uint32_t> ends;
    for (uint32_t v = 0; v < points_.size(); ++v) {
        corners_of(v, around_keep_);
        sides.clear();
        for (uint32_t i = 0; i < around_keep_.size(); ++i) {
            const glm::uvec3 t = triangles_[around_keep_[i]];
            const uint32_t patch = source_.patch[around_keep_[i]];
            const int at = t.x == v ? 0 : t.y == v ? 1 : 2;
            sides.push_back({t[(at + 1) % 3], i, patch, true});
            sides.push_back({t[(at + 2) % 3], i, patch, false});
        }
        std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
            return std::tie(a.other, a.fan) < std::tie(b.other, b.fan);
        });
        Forest<std::vector<uint32_t>> fans{std::vector<uint32_t>(around_keep_.size())};
        size_t fan_count = around_keep_.size(), lines = 0;
        std::array<uint32_t, 2> line{kNone, kNone};
        ends.assign(around_keep_.size() * 2, 0); // of each fan, at the first and the second line
        for (size_t i = 0, end = 0; i < sides.size(); i = end) {
            for (end = i; end < sides.size() && sides[end].other == sides[i].other;)
                ++end;
            if (end - i == 2 && sides[i].patch == sides[i + 1].patch &&
                sides[i].outward != sides[i + 1].outward) {
                if (fans.root(sides[i].fan) != fans.root(sides[i + 1].fan)) {
                    fans.join(sides[i].fan, sides[i + 1].fan);
                    --fan_count;
                }
                continue;
            }
            if (lines < 2) {
                line[lines] = sides[i].other;
                for (size_t k = i; k < end; ++k)
                    ++ends[2 * sides[k].fan + lines];
            }
            ++lines;
        }
        if (lines == 0 && fan_count == 1) {
            kind_[v] = Kind::inside;
        } else if (lines == 2) {
            std::vector<std::array<uint32_t, 2>> of_fan(around_keep_.size(), {0, 0});
            for (uint32_t i = 0; i < around_keep_.size(); ++i)
                for (size_t k = 0; k < 2; ++k)
                    of_fan[fans.root(i)][k] += ends[2 * i + k];
            bool is_line = true;
            for (uint32_t i = 0; i < around_keep_.size(); ++i)
                is_line = is_line && of_fan[fans.root(i)] == std::array<uint32_t, 2>{1, 1};
            if (is_line) {
                kind_[v] = Kind::line;
                line_[v] = line;
            }
        }
    }
}

bool EdgeCollapse::is_line_edge(uint32_t a, uint32_t b) const {
    return (kind_[a] == Kind::line && (line_[a][0] == b || line_[a][1] == b)) ||
           (kind_[b] == Kind::line && (line_[b][0] == a || line_[b][1] == a));
}

uint32_t EdgeCollapse::other_end(uint32_t v, uint32_t neighbour) const {
    return line_[v][0] == neighbour ? line_[v][1] : line_[v][0];
}

// The place of the vertex that an edge becomes. Vertices of lines stay on their lines.
bool EdgeCollapse::place(uint32_t a, uint32_t b) {
    if (kind_[a] < kind_[b] || (kind_[a] == kind_[b] && b < a))
        std::swap(a, b);
    keep_ = a;
    gone_ = b;
    point_ = points_[a];
    position_ = positions_[a];
    if (kind_[b] == Kind::fixed)
        return false;
    if (kind_[b] == Kind::line) {
        if (!is_line_edge(a, b))
            return false;
        const uint32_t beyond = other_end(b, a);
        if (beyond == a || (kind_[a] == Kind::line && other_end(a, b) == beyond))
            return false; // of three edges in a ring none can go
        if (kind_[a] == Kind::fixed) {
            // Were the far end tied to the fixed one already, two lines would become one.
            corners_of(a, around_keep_);
            for (const uint32_t n : around_keep_)
                if (has(triangles_[n], beyond) &&
                    (kind_[beyond] == Kind::fixed || is_line_edge(a, beyond)))
                    return false;
            return true;
        }
    } else if (kind_[a] != Kind::inside) {
        return true;
    }
    const Quadric sum = quadrics_[a] + quadrics_[b];
    const glm::dvec3 middle = 0.5 * (points_[a] + points_[b]);
    glm::dvec3 at = sum.lowest(middle, kPull);
    if (kind_[a] == Kind::line) { // on the segment: a straight line stays straight
        const glm::dvec3 along = points_[b] - points_[a];
        const double square = glm::dot(along, along);
        const double share =
            square > 0.0 ? std::clamp(glm::dot(at - points_[a], along) / square, 0.0, 1.0) : 0.0;
        position_ = glm::mix(positions_[a], positions_[b], static_cast<float>(share));
    } else {
        position_ = glm::vec3(inverse_ * (at - offset_));
    }
    point_ = linear_ * glm::dvec3(position_) + offset_;
    return true;
}

// Fills the lists about the edge. The common neighbours of both ends must be the far corners of
// the triangles along the edge, each of one, and no triangle may become the same as another.
bool EdgeCollapse::keeps_topology() {
    corners_of(keep_, around_keep_);
    corners_of(gone_, around_gone_);
    changed_.clear();
    dying_.clear();
    mark_now_ += 2;
    const uint32_t near_keep = mark_now_, common = mark_now_ + 1;
    for (const uint32_t n : around_keep_)
        for (int i = 0; i < 3; ++i)
            mark_[triangles_[n][i]] = near_keep;
    size_t commons = 0;
    for (const uint32_t n : around_gone_)
        for (int i = 0; i < 3; ++i) {
            const uint32_t v = triangles_[n][i];
            if (v != keep_ && v != gone_ && mark_[v] == near_keep) {
                mark_[v] = common;
                ++commons;
            }
        }
    const auto add = [&](uint32_t n, uint32_t from) {
        Changed changed{n, triangles_[n], {}, 0, kNone};
        for (uint32_t i = 0; i < 3; ++i) {
            uint32_t& v = changed.corners[int(i)];
            if (v == from) {
                v = keep_;
                changed.moved_corner = i;
                changed.points[i] = point_;
            } else {
                changed.points[i] = points_[v];
            }
        }
        changed_.push_back(changed);
    };
    for (const uint32_t n : around_keep_)
        has(triangles_[n], gone_) ? dying_.push_back(n) : add(n, keep_);
    if (commons != dying_.size())
        return false;
    const size_t of_keep = changed_.size();
    for (const uint32_t n : around_gone_)
        if (!has(triangles_[n], keep_))
            add(n, gone_);
    for (size_t g = of_keep; g < changed_.size(); ++g) {
        const glm::uvec3 t = changed_[g].corners;
        bool may_be_double = true;
        for (int i = 0; i < 3; ++i)
            may_be_double = may_be_double && (t[i] == keep_ || mark_[t[i]] == common);
        for (size_t k = 0; may_be_double && k < of_keep; ++k) {
            const glm::uvec3 other = changed_[k].corners;
            if (has(other, t.x) && has(other, t.y) && has(other, t.z))
                return false;
        }
    }
    return true;
}

bool EdgeCollapse::keeps_shape() {
    double worst_before = kNeverCollapsed;
    const auto points_of = [&](uint32_t n) {
        const glm::uvec3 t = triangles_[n];
        return Corners{points_[t.x], points_[t.y], points_[t.z]};
    };
    for (const uint32_t n : dying_)
        worst_before = std::min(worst_before, roundness(points_of(n)));
    for (const Changed& changed : changed_)
        worst_before = std::min(worst_before, roundness(points_of(changed.triangle)));
    for (const Changed& changed : changed_) {
        const glm::dvec3 before = twice_area_normal(points_of(changed.triangle));
        const glm::dvec3 after = twice_area_normal(changed.points);
        if (!(glm::dot(before, after) >= kFold * glm::length(before) * glm::length(after)))
            return false;
        if (!(roundness(changed.points) >= std::min(kSliver, worst_before)))
            return false;
    }
    return true;
}

// If the best point would make a sliver or turn a triangle over, an end of the edge may do.
bool EdgeCollapse::keeps_shape_at_an_end() {
    if (kind_[keep_] != Kind::inside)
        return false;
    const Quadric sum = quadrics_[keep_] + quadrics_[gone_];
    std::array<uint32_t, 2> ends{keep_, gone_};
    if (sum.mean_square(points_[gone_]) < sum.mean_square(points_[keep_]))
        std::swap(ends[0], ends[1]);
    for (const uint32_t v : ends) {
        point_ = points_[v];
        position_ = positions_[v];
        for (Changed& changed : changed_)
            changed.points[changed.moved_corner] = point_;
        if (keeps_shape())
            return true;
    }
    return false;
}

} // namespace palpate
