#include "engine/mesh/edge_collapse.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "engine/base/forest.h"
#include "engine/mesh/used_positions.h"

namespace palpate {

namespace {

constexpr double kFirstLevel = 1.0 / 64.0; // of the limit, and of an edge's length
constexpr double kLevelStep = 1.1;         // levels rise by at least this
constexpr double kPull = 1e-3;             // to the middle of the edge, beside the planes' pull
constexpr double kFold = 0.1;              // cosine between a triangle's normals before and after
constexpr double kSliver = 0.02;           // twice the area over the sum of the squared sides
constexpr double kWorthAnotherPass = 0.01; // of the triangles
constexpr int kMostPasses = 6;
constexpr size_t kMostPieces = 64;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

double distance(glm::dvec3 point, const std::array<glm::dvec3, 3>& triangle) {
    return glm::length(point - nearest_point(point, triangle));
}

glm::dvec3 twice_area_normal(const std::array<glm::dvec3, 3>& c) {
    return glm::cross(c[1] - c[0], c[2] - c[0]);
}

double roundness(const std::array<glm::dvec3, 3>& c) {
    const glm::dvec3 u = c[1] - c[0], v = c[2] - c[1], w = c[0] - c[2];
    const double sum = glm::dot(u, u) + glm::dot(v, v) + glm::dot(w, w);
    return sum > 0.0 ? glm::length(twice_area_normal(c)) / sum : 0.0;
}

bool is_degenerate(glm::uvec3 t) {
    return t.x == t.y || t.y == t.z || t.z == t.x;
}

bool has(glm::uvec3 t, uint32_t v) {
    return t.x == v || t.y == v || t.z == v;
}

} // namespace

CollapseSource::CollapseSource(const Mesh& whole)
    : mesh(whole), incident(triangles_of_vertices(whole)) {
    const glm::dmat3 linear(mesh.world_from_mesh);
    const glm::dvec3 centre(mesh.positions.empty() ? glm::vec3(0.0f) : mesh.positions[0]);
    local_from_mesh = glm::dmat4(linear);
    local_from_mesh[3] = glm::dvec4(-(linear * centre), 1.0);
    points.reserve(mesh.positions.size());
    for (const glm::vec3 p : mesh.positions)
        points.emplace_back(local_from_mesh * glm::dvec4(glm::dvec3(p), 1.0));
    std::map<std::pair<uint16_t, uint16_t>, uint32_t> numbers;
    double sum = 0.0;
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        const std::pair<uint16_t, uint16_t> key{
            mesh.labels.empty() ? 0 : mesh.labels[n],
            mesh.outer_labels.empty() ? 0 : mesh.outer_labels[n]};
        const auto [at, is_new] = numbers.try_emplace(key, static_cast<uint32_t>(numbers.size()));
        if (is_new)
            triangles_of_patch.emplace_back();
        patch.push_back(at->second);
        const glm::uvec3 t = mesh.triangles[n];
        if (!is_degenerate(t)) // which is a line, and no part of the surface
            triangles_of_patch[at->second].push_back(static_cast<uint32_t>(n));
        sum += glm::length(points[t.x] - points[t.y]) + glm::length(points[t.y] - points[t.z]) +
               glm::length(points[t.z] - points[t.x]);
    }
    edge_mm = mesh.triangles.empty() ? 0.0 : sum / (3.0 * double(mesh.triangles.size()));
    std::vector<uint32_t> renamed;
    for (const std::vector<uint32_t>& chosen : triangles_of_patch) {
        Mesh part{.world_from_mesh = local_from_mesh};
        for (const uint32_t n : chosen)
            part.triangles.push_back(mesh.triangles[n]);
        take_used_positions(mesh, part, renamed);
        trees.emplace_back(part);
    }
}

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
    level_ = kFirstLevel * std::min(options_.limit_mm, source.edge_mm);
}

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

bool EdgeCollapse::is_line_edge(uint32_t a, uint32_t b) const {
    return (kind_[a] == Kind::line && (line_[a][0] == b || line_[a][1] == b)) ||
           (kind_[b] == Kind::line && (line_[b][0] == a || line_[b][1] == a));
}

uint32_t EdgeCollapse::other_end(uint32_t v, uint32_t neighbour) const {
    return line_[v][0] == neighbour ? line_[v][1] : line_[v][0];
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
    double worst_before = kInfinite;
    const auto points_of = [&](uint32_t n) {
        const glm::uvec3 t = triangles_[n];
        return std::array<glm::dvec3, 3>{points_[t.x], points_[t.y], points_[t.z]};
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

// Where the best point would make a sliver or turn a triangle over, an end of the edge may do.
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

double EdgeCollapse::error_of_attached() {
    double largest = 0.0;
    const auto attach = [&](uint32_t n) {
        for (uint32_t w = first_witness_[n]; w != kNone; w = witnesses_[w].next) {
            const glm::dvec3 point = source_.points[witnesses_[w].vertex];
            double best = kInfinite;
            uint32_t taker = kNone;
            for (const Changed& changed : changed_) {
                if (source_.patch[changed.triangle] != source_.patch[n])
                    continue;
                const double d = distance(point, changed.points);
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

std::array<glm::dvec3, 3> EdgeCollapse::original(uint32_t n) const {
    const glm::uvec3 t = source_.mesh.triangles[n];
    return {source_.points[t.x], source_.points[t.y], source_.points[t.z]};
}

std::array<glm::dvec3, 3> EdgeCollapse::current(uint32_t n) const {
    if (slot_[n] != kNone)
        return changed_[slot_[n]].points;
    const glm::uvec3 t = triangles_[n];
    return {points_[t.x], points_[t.y], points_[t.z]};
}

EdgeCollapse::Found EdgeCollapse::nearest_original(glm::dvec3 point, uint32_t patch,
                                                   std::span<const uint32_t> hints) const {
    Found found{kNone, kInfinite};
    for (size_t k = 0; k < hints.size(); ++k)
        if (const uint32_t n = hints[k]; n != kNone && (k == 0 || n != hints[k - 1]))
            if (const double d = distance(point, original(n)); d < found.distance_mm)
                found = {n, d};
    const TriangleTree::Nearest nearest = source_.trees[patch].nearest(point, found.distance_mm);
    if (nearest.triangle != kNone)
        found = {source_.triangles_of_patch[patch][nearest.triangle], nearest.distance_mm};
    return found;
}

// The parts of a piece on either side of a plane.
void EdgeCollapse::split(const Piece& piece, glm::dvec3 normal, glm::dvec3 point, Piece& front,
                         Piece& back) {
    front.count = back.count = 0;
    const auto add = [](Piece& to, glm::dvec3 corner) {
        if (to.count < Piece::kMost)
            to.corners[to.count++] = corner;
    };
    double height = glm::dot(normal, piece.corners[piece.count - 1] - point);
    for (size_t i = 0; i < piece.count; ++i) {
        const glm::dvec3 before = piece.corners[(i + piece.count - 1) % piece.count];
        const double next = glm::dot(normal, piece.corners[i] - point);
        if ((height < 0.0) != (next < 0.0)) {
            const glm::dvec3 cut = glm::mix(before, piece.corners[i], height / (height - next));
            add(front, cut);
            add(back, cut);
        }
        add(next < 0.0 ? back : front, piece.corners[i]);
        height = next;
    }
}

glm::dvec3 EdgeCollapse::centre(const Piece& piece) {
    glm::dvec3 sum(0.0);
    for (size_t i = 0; i < piece.count; ++i)
        sum += piece.corners[i];
    return sum / double(piece.count);
}

// Cuts a piece across, between its centre's two sides of its longest side.
void EdgeCollapse::bisect(const Piece& piece, glm::dvec3 at) {
    glm::dvec3 longest(0.0);
    for (size_t i = 0; i < piece.count; ++i)
        if (const glm::dvec3 side = piece.corners[(i + 1) % piece.count] - piece.corners[i];
            glm::dot(side, side) > glm::dot(longest, longest))
            longest = side;
    Piece front{.near = piece.near}, back{.near = piece.near};
    split(piece, longest, at, front, back);
    for (const Piece& part : {front, back})
        if (part.count >= 3)
            pieces_.push_back(part);
}

// Whether all points of a triangle are within kProof levels of the other surface: then at most the
// level. Else the distance of a point that is too far, or where none was found in time, the next
// level.
template <class CornersOf, class NearestTo>
double EdgeCollapse::prove(const Piece& whole, const CornersOf& corners_of,
                           const NearestTo& nearest_to) {
    const double enough = kProof * level_;
    const auto is_near = [&](const Piece& piece, const std::array<glm::dvec3, 3>& other) {
        for (size_t i = 0; i < piece.count; ++i)
            if (!(distance(piece.corners[i], other) <= enough))
                return false;
        return true;
    };
    const auto is_near_hint = [&](const Piece& piece) {
        for (size_t k = 0; k < 3; ++k)
            if (const uint32_t n = piece.near[k]; n != kNone && (k == 0 || n != piece.near[0]) &&
                                                  (k < 2 || n != piece.near[1]) &&
                                                  is_near(piece, corners_of(n)))
                return true;
        return false;
    };
    pieces_.assign(1, whole);
    for (size_t looks = 0; !pieces_.empty(); ++looks) {
        const Piece piece = pieces_.back();
        pieces_.pop_back();
        if (is_near_hint(piece))
            continue;
        const glm::dvec3 middle = centre(piece);
        const Found found = nearest_to(middle, piece.near);
        if (found.distance_mm > level_)
            return found.distance_mm;
        if (looks > kMostPieces || piece.count >= Piece::kMost - 3)
            return kLevelStep * level_;
        // What lies over the triangle nearest to the middle, and the rest.
        const std::array<glm::dvec3, 3> other = corners_of(found.triangle);
        const glm::dvec3 normal = twice_area_normal(other);
        const size_t others = pieces_.size();
        Piece over = piece, inside, outside;
        over.near = {found.triangle, kNone, kNone};
        for (size_t k = 0; k < 3 && over.count >= 3; ++k) {
            split(over, glm::cross(normal, other[(k + 1) % 3] - other[k]), other[k], inside,
                  outside);
            inside.near = outside.near = over.near;
            over = inside;
            if (outside.count >= 3)
                pieces_.push_back(outside);
        }
        if (over.count < 3) {
            pieces_.resize(others);
            over = piece;
        } else if (is_near(over, other)) {
            continue;
        }
        for (size_t i = 0; i < over.count; ++i)
            if (distance(over.corners[i], other) > enough)
                if (const double d = nearest_to(over.corners[i], over.near).distance_mm; d > enough)
                    return d;
        bisect(over, centre(over));
    }
    return level_;
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
        const double error = prove(
            whole, [&](uint32_t n) { return original(n); },
            [&](glm::dvec3 point, const std::array<uint32_t, 3>& near) {
                return nearest_original(point, patch, near);
            });
        if (error > level_)
            return error;
    }
    return level_;
}

EdgeCollapse::Candidate::Candidate(uint32_t n, uint32_t of_patch,
                                   const std::array<glm::dvec3, 3>& corners)
    : triangle(n), patch(of_patch), points(corners) {
    centre = (points[0] + points[1] + points[2]) / 3.0;
    radius = std::max({glm::length(points[0] - centre), glm::length(points[1] - centre),
                       glm::length(points[2] - centre)});
}

// The triangles about the edge and those that share a vertex with them, as they are after it.
void EdgeCollapse::gather_candidates() {
    candidates_.clear();
    mark_now_ += 2;
    ++judgement_;
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
        const std::array<glm::dvec3, 3> corners = original(n);
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
        const double error = prove(
            whole, [&](uint32_t t) { return current(t); },
            [&](glm::dvec3 point, const std::array<uint32_t, 3>& near) {
                Found found{kNone, kInfinite};
                for (const uint32_t t : near)
                    if (t != kNone)
                        if (const double d = distance(point, current(t)); d < found.distance_mm)
                            found = {t, d};
                for (const Candidate& candidate : candidates_)
                    if (candidate.patch == patch &&
                        candidate.may_be_within(found.distance_mm, point))
                        if (const double d = distance(point, candidate.points);
                            d < found.distance_mm)
                            found = {candidate.triangle, d};
                if (near[1] != kNone) // of the whole
                    hint_[n] = found.triangle;
                return found;
            });
        return error;
    };
    for (const auto& [w, taker] : attached_to_) {
        const uint32_t v = witnesses_[w].vertex;
        for (uint32_t i = source_.incident.first[v]; i < source_.incident.first[v + 1]; ++i) {
            const uint32_t n = source_.incident.triangles[i];
            if (looked_at_[n] == judgement_ || source_.patch[n] != source_.patch[taker])
                continue;
            looked_at_[n] = judgement_;
            if (const double error = prove_triangle(n); error > level_)
                return error;
        }
    }
    return level_;
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
    if (error <= level_)
        error = error_of_new();
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
            level_ = std::min(std::max(kLevelStep * level_, double(top.key)), options_.limit_mm);
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

// What was refused may be possible once its neighbours have changed: another pass looks.
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
