#include "engine/mesh/triangle_tree.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <numeric>

namespace palpate {

namespace {

constexpr uint32_t kLeaf = 4; // triangles

double square(double x) {
    return x * x;
}

// a + t (b - a) with t within 0 .. 1; a where both are one point.
glm::dvec3 on_segment(glm::dvec3 a, glm::dvec3 b, double along, double length) {
    return length > 0.0 ? a + std::clamp(along / length, 0.0, 1.0) * (b - a) : a;
}

// The same for a triangle that is but a line, or a point.
glm::dvec3 nearest_on_sides(glm::dvec3 p, const std::array<glm::dvec3, 3>& triangle) {
    glm::dvec3 best(std::numeric_limits<double>::infinity());
    for (size_t i = 0; i < 3; ++i) {
        const glm::dvec3 a = triangle[i], b = triangle[(i + 1) % 3];
        const glm::dvec3 at = on_segment(a, b, glm::dot(p - a, b - a), glm::dot(b - a, b - a));
        if (glm::dot(at - p, at - p) < glm::dot(best - p, best - p))
            best = at;
    }
    return best;
}

} // namespace

glm::dvec3 nearest_point(glm::dvec3 p, const std::array<glm::dvec3, 3>& triangle) {
    const auto& [a, b, c] = triangle;
    const glm::dvec3 ab = b - a, ac = c - a, ap = p - a;
    const glm::dvec3 normal = glm::cross(ab, ac);
    if (glm::dot(normal, normal) <= 1e-28 * glm::dot(ab, ab) * glm::dot(ac, ac))
        return nearest_on_sides(p, triangle); // the regions below say nothing for flat ones
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0)
        return a;
    const glm::dvec3 bp = p - b;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3)
        return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0)
        return on_segment(a, b, d1, d1 - d3);
    const glm::dvec3 cp = p - c;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6)
        return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0)
        return on_segment(a, c, d2, d2 - d6);
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 >= d3 && d5 >= d6)
        return on_segment(b, c, d4 - d3, (d4 - d3) + (d5 - d6));
    const double sum = va + vb + vc;
    return a + (vb / sum) * ab + (vc / sum) * ac;
}

TriangleTree::TriangleTree(const Mesh& mesh)
    : triangles_(mesh.triangles),
      mirrored_(glm::determinant(glm::dmat3(mesh.world_from_mesh)) < 0.0) {
    positions_.reserve(mesh.positions.size());
    for (const glm::vec3 p : mesh.positions)
        positions_.emplace_back(mesh.world_from_mesh * glm::dvec4(glm::dvec3(p), 1.0));
    order_.resize(triangles_.size());
    std::iota(order_.begin(), order_.end(), 0u);
    for (size_t n = triangles_.size(); n > kLeaf; n = (n + 1) / 2)
        ++levels_;
    boxes_.resize((size_t{2} << levels_) - 1);
    std::vector<glm::dvec3> centers(triangles_.size());
    tbb::parallel_for(uint32_t{0}, triangle_count(), [&](uint32_t n) {
        const auto [a, b, c] = corners(n);
        centers[n] = a + b + c; // three times the centre
    });
    if (!triangles_.empty())
        build(0, 0, triangle_count(), 0, centers);
}

void TriangleTree::build(size_t node, uint32_t begin, uint32_t end, uint32_t level,
                         const std::vector<glm::dvec3>& centers) {
    Box& box = boxes_[node];
    if (level == levels_) {
        for (uint32_t i = begin; i < end; ++i)
            for (const glm::dvec3 corner : corners(order_[i])) {
                box.low = glm::min(box.low, corner);
                box.high = glm::max(box.high, corner);
            }
        return;
    }
    glm::dvec3 low = centers[order_[begin]], high = low;
    for (uint32_t i = begin; i < end; ++i) {
        low = glm::min(low, centers[order_[i]]);
        high = glm::max(high, centers[order_[i]]);
    }
    const glm::dvec3 extent = high - low;
    int axis = extent.x >= extent.y ? 0 : 1;
    axis = extent[axis] >= extent.z ? axis : 2;
    const uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](uint32_t a, uint32_t b) {
                         return centers[a][axis] != centers[b][axis]
                                    ? centers[a][axis] < centers[b][axis]
                                    : a < b;
                     });
    const auto first = [&] { build(2 * node + 1, begin, middle, level + 1, centers); };
    const auto second = [&] { build(2 * node + 2, middle, end, level + 1, centers); };
    if (end - begin > 4096) {
        tbb::parallel_invoke(first, second);
    } else {
        first();
        second();
    }
    box.low = glm::min(boxes_[2 * node + 1].low, boxes_[2 * node + 2].low);
    box.high = glm::max(boxes_[2 * node + 1].high, boxes_[2 * node + 2].high);
}

void TriangleTree::search(size_t node, uint32_t begin, uint32_t end, uint32_t level,
                          glm::dvec3 point, Nearest& best) const {
    if (level == levels_) {
        for (uint32_t i = begin; i < end; ++i) {
            const glm::dvec3 at = nearest_point(point, corners(order_[i]));
            if (const double distance = glm::length(at - point); distance < best.distance_mm)
                best = {distance, at, order_[i]};
        }
        return;
    }
    const auto away = [&](size_t child) { // squared distance to its box
        const glm::dvec3 gap = glm::max(
            glm::max(boxes_[child].low - point, point - boxes_[child].high), glm::dvec3(0.0));
        return glm::dot(gap, gap);
    };
    const uint32_t middle = begin + (end - begin) / 2;
    const double first = away(2 * node + 1), second = away(2 * node + 2);
    const auto enter = [&](bool is_second, double gap) {
        if (gap < square(best.distance_mm))
            is_second ? search(2 * node + 2, middle, end, level + 1, point, best)
                      : search(2 * node + 1, begin, middle, level + 1, point, best);
    };
    enter(second < first, std::min(first, second));
    enter(!(second < first), std::max(first, second));
}

TriangleTree::Nearest TriangleTree::nearest(glm::dvec3 point_mm, double within_mm) const {
    Nearest best{.distance_mm = within_mm};
    if (!triangles_.empty())
        search(0, 0, triangle_count(), 0, point_mm, best);
    if (best.triangle == ~0u)
        best.distance_mm = std::numeric_limits<double>::infinity();
    return best;
}

glm::dvec3 TriangleTree::normal(uint32_t n) const {
    const auto [a, b, c] = corners(n);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double length = glm::length(normal);
    return length > 0.0 ? (mirrored_ ? -normal : normal) / length : glm::dvec3(0.0);
}

} // namespace palpate
