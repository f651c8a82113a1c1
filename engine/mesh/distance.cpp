#include "engine/mesh/distance.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "engine/base/assert.h"

namespace palpate {

namespace {

using Corners = std::array<glm::dvec3, 3>;
using Nearest = TriangleTree::Nearest;

double angle_deg(glm::dvec3 a, glm::dvec3 b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180.0 / std::numbers::pi;
}

// Sums in an order that the number of threads does not change.
struct Sums {
    double area = 0.0, distance = 0.0, square = 0.0, largest = 0.0;
    double angle_area = 0.0, angle_square = 0.0, largest_angle = 0.0;
    uint64_t samples = 0, lost = 0;

    void add(double weight, double mm, std::optional<double> angle) {
        area += weight;
        distance += weight * mm;
        square += weight * mm * mm;
        largest = std::max(largest, mm);
        ++samples;
        if (!angle)
            return;
        angle_area += weight;
        angle_square += weight * *angle * *angle;
        largest_angle = std::max(largest_angle, *angle);
    }
    Sums operator+(const Sums& b) const {
        return {area + b.area,
                distance + b.distance,
                square + b.square,
                std::max(largest, b.largest),
                angle_area + b.angle_area,
                angle_square + b.angle_square,
                std::max(largest_angle, b.largest_angle),
                samples + b.samples,
                lost + b.lost};
    }
    SurfaceDistance result() const {
        SurfaceDistance found{
            .largest_mm = largest, .normal_max_deg = largest_angle, .samples = samples};
        if (area > 0.0) {
            found.mean_mm = distance / area;
            found.rms_mm = std::sqrt(square / area);
        }
        if (angle_area > 0.0)
            found.normal_rms_deg = std::sqrt(angle_square / angle_area);
        return found;
    }
};

double area_of(const Corners& c) {
    return 0.5 * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
}

// Calls visit(sums, triangle, centre, area) for the equal parts of every triangle.
template <class Visit>
Sums over_samples(const TriangleTree& tree, uint32_t samples, const Visit& visit) {
    double total = 0.0;
    for (uint32_t n = 0; n < tree.triangle_count(); ++n)
        total += area_of(tree.corners(n));
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<uint32_t>(0, tree.triangle_count(), 512), Sums{},
        [&](const tbb::blocked_range<uint32_t>& range, Sums sums) {
            for (uint32_t n = range.begin(); n < range.end(); ++n) {
                const Corners c = tree.corners(n);
                const double area = area_of(c);
                if (!(area > 0.0))
                    continue;
                const auto cuts = static_cast<uint32_t>(
                    std::max(1.0, std::ceil(std::sqrt(area / total * samples))));
                const glm::dvec3 u = (c[1] - c[0]) / double(cuts), v = (c[2] - c[0]) / double(cuts);
                for (uint32_t j = 0; j < cuts; ++j)
                    for (uint32_t i = 0; i + j < cuts; ++i) {
                        const glm::dvec3 at = c[0] + double(i) * u + double(j) * v;
                        visit(sums, n, at + (u + v) / 3.0, area / cuts / cuts);
                        if (i + j + 1 < cuts)
                            visit(sums, n, at + (u + v) * (2.0 / 3.0), area / cuts / cuts);
                    }
            }
            return sums;
        },
        [](const Sums& a, const Sums& b) { return a + b; });
}

// A part of a triangle, and triangles of the other mesh: nearest to each corner, and to a point
// of the part that this one was cut from.
struct Piece {
    Corners corners;
    glm::uvec3 nearest;
    uint32_t below;
};

// No point of the piece is farther: the distance to one triangle is largest at a corner.
double bound_of(const Piece& piece, const TriangleTree& to) {
    double bound = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 4; ++i) {
        const Corners target = to.corners(i < 3 ? piece.nearest[i] : piece.below);
        double farthest = 0.0;
        for (const glm::dvec3 p : piece.corners)
            farthest = std::max(farthest, glm::length(p - nearest_point(p, target)));
        bound = std::min(bound, farthest);
    }
    return bound;
}

// Adds the four quarters of a piece; returns the largest distance of the corners they bring.
double quarter(const Piece& piece, const TriangleTree& to, std::vector<Piece>& out) {
    Corners middle; // opposite to corner i
    glm::uvec3 near_middle;
    double largest = 0.0;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 a = piece.corners[(i + 1) % 3], b = piece.corners[(i + 2) % 3];
        middle[i] = 0.5 * (a + b);
        const Nearest nearest = to.nearest(middle[i]);
        near_middle[i] = nearest.triangle;
        largest = std::max(largest, nearest.distance_mm);
    }
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out.push_back({{piece.corners[i], middle[k], middle[j]},
                       {piece.nearest[i], near_middle[k], near_middle[j]},
                       piece.below});
    }
    out.push_back({middle, near_middle, piece.below});
    return largest;
}

// Cuts a piece in three along a side of the triangle below its centre, so that parts come to lie
// over one triangle each, which quarters do only near their smallest size. Where no side crosses
// the piece it is quartered. Returns the largest distance of the corners they bring.
double cut(const Piece& piece, const TriangleTree& to, std::vector<Piece>& out) {
    const glm::dvec3 centre = (piece.corners[0] + piece.corners[1] + piece.corners[2]) / 3.0;
    const Nearest nearest = to.nearest(centre);
    const Corners target = to.corners(nearest.triangle);
    const glm::dvec3 normal = glm::cross(target[1] - target[0], target[2] - target[0]);
    glm::dvec3 heights(0.0); // of the corners over the side's plane, no unit
    double deepest = 0.0;
    for (int k = 0; k < 3; ++k) {
        const glm::dvec3 inward = glm::cross(normal, target[(k + 1) % 3] - target[k]);
        glm::dvec3 found;
        for (int i = 0; i < 3; ++i)
            found[i] = glm::dot(inward, piece.corners[i] - target[k]);
        const double low = std::min({found.x, found.y, found.z}) / glm::length(inward);
        const double high = std::max({found.x, found.y, found.z}) / glm::length(inward);
        constexpr double kThin = 0.01; // what is cut off, of the piece; less is not worth it
        if (low < deepest && high > 0.0 && std::min(-low, high) > kThin * (high - low)) {
            deepest = low;
            heights = found;
        }
    }
    Piece whole = piece;
    whole.below = nearest.triangle;
    if (!(deepest < 0.0))
        return std::max(nearest.distance_mm, quarter(whole, to, out));
    int apex = 0; // the corner that is alone on its side
    for (int i = 0; i < 3; ++i)
        if ((heights[i] < 0.0) != (heights[(i + 1) % 3] < 0.0) &&
            (heights[i] < 0.0) != (heights[(i + 2) % 3] < 0.0))
            apex = i;
    const int j = (apex + 1) % 3, k = (apex + 2) % 3;
    const auto crossing = [&](int other) {
        return glm::mix(piece.corners[apex], piece.corners[other],
                        heights[apex] / (heights[apex] - heights[other]));
    };
    const glm::dvec3 at_j = crossing(j), at_k = crossing(k);
    const Nearest near_j = to.nearest(at_j), near_k = to.nearest(at_k);
    const uint32_t at = nearest.triangle;
    out.push_back({{piece.corners[apex], at_j, at_k},
                   {piece.nearest[apex], near_j.triangle, near_k.triangle},
                   at});
    out.push_back({{at_j, piece.corners[j], piece.corners[k]},
                   {near_j.triangle, piece.nearest[j], piece.nearest[k]},
                   at});
    out.push_back(
        {{at_j, piece.corners[k], at_k}, {near_j.triangle, piece.nearest[k], near_k.triangle}, at});
    return std::max({nearest.distance_mm, near_j.distance_mm, near_k.distance_mm});
}

// The largest distance of all points, to the tolerance, given that of some. All pieces of one round
// are looked at before any of the next, so that the answer does not depend on their order. Pieces
// are cut along the other surface's sides; every third round quarters, so that rounds end.
double largest_distance(const TriangleTree& from, const TriangleTree& to, double known,
                        double tolerance, const std::stop_token& stop) {
    std::vector<Nearest> nearest(from.positions_mm().size());
    std::vector<char> used(nearest.size(), 0);
    for (uint32_t n = 0; n < from.triangle_count(); ++n)
        for (int i = 0; i < 3; ++i)
            used[from.triangle(n)[i]] = 1;
    tbb::parallel_for(size_t{0}, nearest.size(), [&](size_t v) {
        if (used[v] && !stop.stop_requested())
            nearest[v] = to.nearest(from.positions_mm()[v]);
    });
    if (stop.stop_requested())
        return known;
    for (size_t v = 0; v < nearest.size(); ++v)
        if (used[v])
            known = std::max(known, nearest[v].distance_mm);
    if (to.triangle_count() == 0)
        return known;
    // Parts of those of `count` pieces that may reach beyond what is known.
    struct Parts {
        std::vector<Piece> pieces;
        double largest = 0.0;
    };
    uint32_t round = 0;
    const auto parts_of = [&](uint32_t count, const auto& piece_at) {
        const auto divide = ++round % 3 == 0 ? quarter : cut;
        tbb::enumerable_thread_specific<Parts> found;
        tbb::parallel_for(
            tbb::blocked_range<uint32_t>(0, count, 256),
            [&](const tbb::blocked_range<uint32_t>& range) {
                Parts& mine = found.local();
                for (uint32_t n = range.begin(); n < range.end() && !stop.stop_requested(); ++n)
                    if (const Piece piece = piece_at(n); bound_of(piece, to) > known + tolerance)
                        mine.largest = std::max(mine.largest, divide(piece, to, mine.pieces));
            });
        std::vector<Piece> all;
        for (const Parts& part : found) {
            all.insert(all.end(), part.pieces.begin(), part.pieces.end());
            known = std::max(known, part.largest);
        }
        return all;
    };
    std::vector<Piece> pieces = parts_of(from.triangle_count(), [&](uint32_t n) {
        const glm::uvec3 t = from.triangle(n);
        return Piece{from.corners(n),
                     {nearest[t.x].triangle, nearest[t.y].triangle, nearest[t.z].triangle},
                     nearest[t.x].triangle};
    });
    while (!pieces.empty() && !stop.stop_requested())
        pieces =
            parts_of(static_cast<uint32_t>(pieces.size()), [&](uint32_t n) { return pieces[n]; });
    return known;
}

// The point of the surface field = iso nearest to `start`; absent where steps do not end on one.
std::optional<glm::dvec3> foot_on(const synthetic::Field& field, double iso, glm::dvec3 start) {
    const auto is_short = [](glm::dvec3 step, glm::dvec3 at) {
        return glm::length(step) <= 1e-12 * (1.0 + glm::length(at));
    };
    const auto descend = [&](glm::dvec3 at) -> std::optional<glm::dvec3> {
        double off = field.value(at) - iso;
        for (int i = 0; i < 60; ++i) {
            const glm::dvec3 g = field.gradient(at);
            const double square = glm::dot(g, g);
            if (!(square > 0.0))
                return {};
            glm::dvec3 step = off / square * g;
            if (is_short(step, at))
                return at;
            // A part of the step is enough if the gradient says little about the values ahead.
            double next = field.value(at - step) - iso;
            for (; !(std::abs(next) < std::abs(off)); next = field.value(at - step) - iso) {
                step *= 0.5;
                if (is_short(step, at))
                    return {};
            }
            at -= step;
            off = next;
        }
        return {};
    };
    std::optional<glm::dvec3> foot = descend(start);
    for (int i = 0; foot && i < 30; ++i) { // slide along the surface towards start
        const glm::dvec3 normal = glm::normalize(field.gradient(*foot));
        const glm::dvec3 away = start - *foot;
        const glm::dvec3 along = away - glm::dot(away, normal) * normal;
        const std::optional<glm::dvec3> next = descend(*foot + along);
        if (!next || !(glm::length(*next - start) < glm::length(away)))
            break;
        foot = next;
        if (is_short(along, *foot))
            break;
    }
    return foot;
}

} // namespace

SurfaceDistance distance_to_mesh(const TriangleTree& from, const TriangleTree& to,
                                 const DistanceOptions& options) {
    PALPATE_ASSERT_CMP(options.tolerance_mm, >, 0.0);
    const Sums sums = over_samples(
        from, options.samples, [&](Sums& s, uint32_t n, glm::dvec3 point, double area) {
            const Nearest nearest = to.nearest(point);
            std::optional<double> angle;
            if (nearest.triangle != ~0u)
                if (const glm::dvec3 other = to.normal(nearest.triangle); glm::length(other) > 0.0)
                    angle = angle_deg(from.normal(n), other);
            s.add(area, nearest.distance_mm, angle);
        });
    SurfaceDistance found = sums.result();
    found.largest_mm =
        largest_distance(from, to, found.largest_mm, options.tolerance_mm, options.stop);
    return found;
}

double MeshDistance::hausdorff_mm() const {
    return std::max(forward.largest_mm, backward.largest_mm);
}

double MeshDistance::rms_mm() const {
    return std::sqrt(0.5 * (forward.rms_mm * forward.rms_mm + backward.rms_mm * backward.rms_mm));
}

MeshDistance compare_meshes(const Mesh& first, const Mesh& second, const DistanceOptions& options) {
    const TriangleTree a(first), b(second);
    return {distance_to_mesh(a, b, options), distance_to_mesh(b, a, options)};
}

FieldDistance distance_to_field(const Mesh& mesh, const synthetic::Field& field, double iso,
                                const DistanceOptions& options) {
    const TriangleTree tree(mesh);
    std::vector<char> used(mesh.positions.size(), 0);
    for (const glm::uvec3 t : mesh.triangles)
        for (int i = 0; i < 3; ++i)
            used[t[i]] = 1;
    const auto outward = [&](glm::dvec3 foot) { return -field.gradient(foot); };
    const Sums at_samples = over_samples(
        tree, options.samples, [&](Sums& s, uint32_t n, glm::dvec3 point, double area) {
            const std::optional<glm::dvec3> foot = foot_on(field, iso, point);
            if (!foot)
                ++s.lost;
            else
                s.add(area, glm::length(*foot - point), angle_deg(tree.normal(n), outward(*foot)));
        });
    // Normals are covectors; the sign of the determinant keeps them outward in mirrored worlds.
    const glm::dmat3 linear(mesh.world_from_mesh);
    const glm::dmat3 world_normal = glm::transpose(glm::inverse(linear));
    const Sums at_vertices = tbb::parallel_deterministic_reduce(
        tbb::blocked_range<size_t>(0, used.size(), 1024), Sums{},
        [&](const tbb::blocked_range<size_t>& range, Sums s) {
            for (size_t v = range.begin(); v < range.end(); ++v) {
                if (!used[v])
                    continue;
                const glm::dvec3 point = tree.positions_mm()[v];
                const std::optional<glm::dvec3> foot = foot_on(field, iso, point);
                if (!foot) {
                    ++s.lost;
                    continue;
                }
                std::optional<double> angle;
                if (!mesh.normals.empty())
                    angle = angle_deg(world_normal * glm::dvec3(mesh.normals[v]), outward(*foot));
                s.add(1.0, glm::length(*foot - point), angle);
            }
            return s;
        },
        [](const Sums& a, const Sums& b) { return a + b; });
    const SurfaceDistance vertices = at_vertices.result();
    return {.surface = at_samples.result(),
            .vertex_largest_mm = vertices.largest_mm,
            .vertex_rms_mm = vertices.rms_mm,
            .vertex_normal_max_deg = vertices.normal_max_deg,
            .lost = at_samples.lost + at_vertices.lost};
}

} // namespace palpate
