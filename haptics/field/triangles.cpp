#include "haptics/field/triangles.h"

#include <algorithm>
#include <cmath>

#include "haptics/field/coupling.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

// Squares of distances that differ by less are the same, but for rounding.
constexpr double kSameDistance = 1e-9;
// A place may be found so far off by the floats of a mesh: then it is looked for next door, too.
constexpr double kRounding_mm = 1e-3;

struct Corners {
    dvec3 a, b, c;
};

Corners corners_of(const TriangleSpan& s, uint32_t t) {
    const glm::uvec3 v = s.triangles[t];
    return {dvec3(s.positions[v.x]), dvec3(s.positions[v.y]), dvec3(s.positions[v.z])};
}

// Barycentric weights of the point of a triangle nearest to p.
dvec3 nearest_weights(const Corners& k, dvec3 p) {
    const dvec3 ab = k.b - k.a, ac = k.c - k.a, ap = p - k.a;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0)
        return {1, 0, 0};
    const dvec3 bp = p - k.b;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3)
        return {0, 1, 0};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
        const double v = d1 > d3 ? d1 / (d1 - d3) : 0.0;
        return {1.0 - v, v, 0};
    }
    const dvec3 cp = p - k.c;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6)
        return {0, 0, 1};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
        const double w = d2 > d6 ? d2 / (d2 - d6) : 0.0;
        return {1.0 - w, 0, w};
    }
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
        const double sum = (d4 - d3) + (d5 - d6);
        const double w = sum > 0.0 ? (d4 - d3) / sum : 0.0;
        return {0, 1.0 - w, w};
    }
    const double all = va + vb + vc;
    return all > 0.0 ? dvec3(va, vb, vc) / all : dvec3(1, 0, 0);
}

SurfacePoint point_on(const TriangleSpan& s, uint32_t t, const Corners& k, dvec3 w) {
    SurfacePoint found{.point = w.x * k.a + w.y * k.b + w.z * k.c, .found = true};
    found.face_normal = unit_or_zero(glm::cross(k.b - k.a, k.c - k.a));
    found.curved = found.point;
    found.shaded_normal = found.face_normal;
    if (!s.normals.empty()) {
        const glm::uvec3 v = s.triangles[t];
        const dvec3 blended =
            unit_or_zero(w.x * dvec3(s.normals[v.x]) + w.y * dvec3(s.normals[v.y]) +
                         w.z * dvec3(s.normals[v.z]));
        if (glm::dot(blended, found.face_normal) > 0.0)
            found.shaded_normal = blended;
        if (s.bulge_mm > 0.0) {
            const auto above = [&](dvec3 corner, uint32_t vertex) {
                const dvec3 n(s.normals[vertex]);
                return glm::dot(corner - found.point, n) * n;
            };
            const dvec3 way =
                0.5 * (w.x * above(k.a, v.x) + w.y * above(k.b, v.y) + w.z * above(k.c, v.z));
            found.curved += std::min(1.0, s.bulge_mm / std::max(glm::length(way), 1e-12)) * way;
        }
    }
    return found;
}

void count_looks(const TriangleSpan& s, uint32_t begin, uint32_t end) {
    if (s.looks_left)
        *s.looks_left -= end - begin;
}

dvec3 cell_of(const TriangleCells& c, dvec3 p) {
    return c.cells_from_mm * p + c.offset;
}

// How far a place moves across the cells of each axis at most, moved by a millimetre.
dvec3 cells_per_mm(const TriangleCells& c) {
    const glm::dmat3 rows = glm::transpose(c.cells_from_mm);
    return {glm::length(rows[0]), glm::length(rows[1]), glm::length(rows[2])};
}

// Calls look(begin, end) for the triangles of a row of cells, both ends inclusive.
template <class Look>
void look_into(const TriangleCells& c, int x_from, int x_to, int y, int z, const Look& look) {
    const size_t row = size_t(c.count.x) * (size_t(y) + size_t(c.count.y) * size_t(z));
    look(c.first[row + size_t(x_from)], c.first[row + size_t(x_to) + 1]);
}

// The cells that a segment passes, piece by piece from its start on, or from a cell before it,
// until a share of it has been looked along that is `enough`.
template <class Look>
void look_along(const TriangleCells& c, dvec3 from, dvec3 to, bool starts_before,
                const double& enough, const Look& look) {
    const dvec3 start = cell_of(c, from), way = cell_of(c, to) - start, size = glm::abs(way);
    const dvec3 margin = kRounding_mm * cells_per_mm(c);
    const glm::ivec3 range = c.to - c.from + 1;
    const double most = std::max({1, range.x, range.y, range.z});
    const double length = std::max({size.x, size.y, size.z, 1e-12});
    const double pieces = std::clamp(std::ceil(length), 1.0, most);
    for (double i = 0.0; i < pieces && i / pieces < enough; ++i) {
        const double first = i == 0.0 && starts_before ? -1.0 / length : i / pieces;
        const dvec3 a = start + first * way, b = start + (i + 1.0) / pieces * way;
        const dvec3 low = glm::max(glm::floor(glm::min(a, b) - margin), dvec3(c.from));
        const dvec3 high = glm::min(glm::floor(glm::max(a, b) + margin), dvec3(c.to));
        if (glm::all(glm::lessThanEqual(low, high))) {
            const glm::ivec3 l(low), h(high);
            for (int z = l.z; z <= h.z; ++z)
                for (int y = l.y; y <= h.y; ++y)
                    look_into(c, l.x, h.x, y, z, look);
        }
    }
}

// Cells in shells about a place, while they are within reach_mm, which may become less.
template <class Look>
void look_around(const TriangleCells& c, dvec3 p, const double& reach_mm, const Look& look) {
    const dvec3 place = cell_of(c, p), per_mm = cells_per_mm(c);
    const dvec3 middle = glm::clamp(glm::floor(place), dvec3(c.from), dvec3(c.to));
    const glm::ivec3 m(middle);
    const glm::ivec3 farthest = glm::max(m - c.from, c.to - m);
    const int last = std::max({farthest.x, farthest.y, farthest.z});
    // Cells between p and another one along an axis.
    const auto is_near = [&](int axis, int at) {
        const double off = std::max(double(at) - place[axis], place[axis] - double(at) - 1.0);
        return off <= (reach_mm + kRounding_mm) * per_mm[axis];
    };
    for (int r = 0; r <= last; ++r) {
        const glm::ivec3 low = glm::max(m - r, c.from), high = glm::min(m + r, c.to);
        bool any = false;
        for (int z = low.z; z <= high.z; ++z) {
            if (!is_near(2, z))
                continue;
            for (int y = low.y; y <= high.y; ++y) {
                if (!is_near(1, y))
                    continue;
                const bool is_side = std::abs(z - m.z) == r || std::abs(y - m.y) == r;
                for (int x = is_side ? low.x : m.x - r; x <= high.x; x += is_side ? 1 : 2 * r)
                    if (x >= low.x && is_near(0, x)) {
                        any = true;
                        look_into(c, x, x, y, z, look);
                    }
            }
        }
        if (!any)
            return;
    }
}

} // namespace

SurfacePoint nearest_point(const TriangleSpan& s, dvec3 p, double within_mm) {
    double best = INFINITY, best_square_on = 0.0, reach_mm = within_mm;
    uint32_t which = 0;
    dvec3 weights{};
    // On an edge or a vertex triangles are equally near: the one that is seen most squarely tells
    // on which side of the surface p is.
    const auto square_on = [&](const Corners& k, dvec3 away) {
        return std::abs(glm::dot(unit_or_zero(glm::cross(k.b - k.a, k.c - k.a)), away));
    };
    const auto look = [&](uint32_t begin, uint32_t end) {
        count_looks(s, begin, end);
        for (uint32_t t = begin; t < end; ++t) {
            const Corners k = corners_of(s, t);
            const dvec3 w = nearest_weights(k, p);
            const dvec3 away = w.x * k.a + w.y * k.b + w.z * k.c - p;
            const double square = glm::dot(away, away);
            if (square > (1.0 + kSameDistance) * best)
                continue;
            const double seen = square_on(k, away);
            if (square >= (1.0 - kSameDistance) * best && seen <= best_square_on)
                continue;
            best = square;
            best_square_on = seen;
            reach_mm = std::min(within_mm, std::sqrt(best));
            which = t;
            weights = w;
        }
    };
    if (s.cells.count.x == 0)
        look(0, static_cast<uint32_t>(s.triangles.size()));
    else
        look_around(s.cells, p, reach_mm, look);
    if (!(best < INFINITY && std::sqrt(best) <= within_mm))
        return {};
    SurfacePoint found = point_on(s, which, corners_of(s, which), weights);
    found.distance = std::sqrt(best);
    return found;
}

SurfacePoint first_crossing(const TriangleSpan& s, dvec3 from, dvec3 to, double behind) {
    const dvec3 d = to - from;
    const double length_square = glm::dot(d, d);
    if (!(length_square > 0.0))
        return {};
    // Corners are seen along the line, in a plane across one axis (Woop, Benthin & Wald 2013): the
    // same corner lies at the same place for every triangle. The sign of a difference of two
    // products is right for any rounding, or it is 0, so that edges and corners have no gaps.
    const dvec3 size = glm::abs(d);
    const int z = size.x > size.y ? (size.x > size.z ? 0 : 2) : size.y > size.z ? 1 : 2;
    const int x = d[z] > 0.0 ? (z + 1) % 3 : (z + 2) % 3, y = 3 - x - z;
    const glm::dvec2 lean(d[x] / d[z], d[y] / d[z]);
    const auto seen = [&](dvec3 p) {
        return glm::dvec2(p[x] - lean.x * p[z], p[y] - lean.y * p[z]);
    };
    const auto side = [](glm::dvec2 p, glm::dvec2 q) { return p.x * q.y - p.y * q.x; };
    double best = 1.0;
    bool found = false;
    uint32_t which = 0;
    dvec3 weights{};
    const auto look = [&](uint32_t begin, uint32_t end) {
        count_looks(s, begin, end);
        for (uint32_t t = begin; t < end; ++t) {
            const glm::uvec3 v = s.triangles[t];
            const dvec3 a = dvec3(s.positions[v.x]) - from, b = dvec3(s.positions[v.y]) - from;
            const glm::dvec2 at_a = seen(a), at_b = seen(b);
            const double wc = side(at_a, at_b);
            if (wc > 0.0) // from inside, or past
                continue;
            const dvec3 c = dvec3(s.positions[v.z]) - from;
            const glm::dvec2 at_c = seen(c);
            const double wa = side(at_b, at_c), wb = side(at_c, at_a);
            const double sum = wa + wb + wc;
            if (wa > 0.0 || wb > 0.0 || !(sum < 0.0))
                continue;
            // A mean of the corners, which no rounding takes out of the triangle.
            const dvec3 at = (wa * a + wb * b + wc * c) / sum;
            const double share = glm::dot(at, d) / length_square;
            if (share > best)
                continue;
            if (share < 0.0 && glm::dot(unit_or_zero(glm::cross(b - a, c - a)), at) > behind)
                continue;
            best = share;
            which = t;
            weights = dvec3(wa, wb, wc) / sum;
            found = true;
        }
    };
    if (s.cells.count.x == 0)
        look(0, static_cast<uint32_t>(s.triangles.size()));
    else
        look_along(s.cells, from, to, behind > 0.0, best, look);
    if (!found)
        return {};
    SurfacePoint hit = point_on(s, which, corners_of(s, which), weights);
    if (hit.face_normal == dvec3(0.0)) // a triangle without area
        hit.face_normal = hit.shaded_normal = -d / std::sqrt(length_square);
    hit.distance = best * std::sqrt(length_square);
    return hit;
}

} // namespace palpate::haptics
