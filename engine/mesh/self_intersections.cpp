#include "engine/mesh/self_intersections.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/mesh/near_proof.h"

namespace palpate {

namespace {

// Signs of determinants; 0 where rounding could have made them. The bounds are those of Shewchuk
// ("Adaptive precision floating-point arithmetic and fast robust geometric predicates", 1997) for
// the products as they are written here, rounded up.
constexpr double kBound2 = 4e-16, kBound3 = 9e-16;

int sign_of(double value, double bound) {
    return value > bound ? 1 : value < -bound ? -1 : 0;
}

// On which side of the plane through a, b, c the point d lies.
int side(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, glm::dvec3 d) {
    const glm::dvec3 p = a - d, q = b - d, r = c - d;
    const double x1 = q.y * r.z, x2 = q.z * r.y, y1 = q.z * r.x, y2 = q.x * r.z;
    const double z1 = q.x * r.y, z2 = q.y * r.x;
    const double size = std::abs(p.x) * (std::abs(x1) + std::abs(x2)) +
                        std::abs(p.y) * (std::abs(y1) + std::abs(y2)) +
                        std::abs(p.z) * (std::abs(z1) + std::abs(z2));
    return sign_of(p.x * (x1 - x2) + p.y * (y1 - y2) + p.z * (z1 - z2), kBound3 * size);
}
int side(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
    const double left = (a.x - c.x) * (b.y - c.y), right = (a.y - c.y) * (b.x - c.x);
    return sign_of(left - right, kBound2 * (std::abs(left) + std::abs(right)));
}

bool boxes_overlap(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c, glm::dvec2 d) {
    return glm::all(glm::lessThanEqual(glm::min(a, b), glm::max(c, d))) &&
           glm::all(glm::lessThanEqual(glm::min(c, d), glm::max(a, b)));
}
bool segments_meet(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c, glm::dvec2 d) {
    return side(a, b, c) * side(a, b, d) <= 0 && side(c, d, a) * side(c, d, b) <= 0 &&
           boxes_overlap(a, b, c, d);
}

using Flat = std::array<glm::dvec2, 3>;

// Without the axis along which the triangle's normal is longest.
Flat flattened(const Corners& triangle, glm::dvec3 normal) {
    const glm::dvec3 n = glm::abs(normal);
    const int out = n.x >= n.y && n.x >= n.z ? 0 : n.y >= n.z ? 1 : 2;
    Flat flat;
    for (size_t i = 0; i < 3; ++i)
        flat[i] = {triangle[i][(out + 1) % 3], triangle[i][(out + 2) % 3]};
    return flat;
}

bool holds(const Flat& t, glm::dvec2 p) {
    const int a = side(t[0], t[1], p), b = side(t[1], t[2], p), c = side(t[2], t[0], p);
    return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

// Whether the segment p q meets a triangle.
bool meets(glm::dvec3 p, glm::dvec3 q, const Corners& t) {
    const int from = side(t[0], t[1], t[2], p), to = side(t[0], t[1], t[2], q);
    if (from * to > 0)
        return false;
    if (from == 0 && to == 0) { // in its plane
        const glm::dvec3 normal = twice_area_normal(t);
        const Flat flat = flattened(t, normal), ends = flattened({p, q, p}, normal);
        if (holds(flat, ends[0]))
            return true;
        for (size_t i = 0; i < 3; ++i)
            if (segments_meet(ends[0], ends[1], flat[i], flat[(i + 1) % 3]))
                return true;
        return false;
    }
    const int a = side(p, q, t[0], t[1]), b = side(p, q, t[1], t[2]), c = side(p, q, t[2], t[0]);
    return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
}

class Triangles {
 public:
    explicit Triangles(const Mesh& mesh) : mesh_(mesh) {
        for (const glm::uvec3 t : mesh.triangles) {
            Corners c;
            for (int i = 0; i < 3; ++i)
                c[size_t(i)] = glm::dvec3(mesh.positions[t[i]]);
            corners_.push_back(c);
            low_.push_back(glm::min(c[0], glm::min(c[1], c[2])));
            high_.push_back(glm::max(c[0], glm::max(c[1], c[2])));
        }
    }
    glm::dvec3 low(uint32_t n) const { return low_[n]; }
    glm::dvec3 high(uint32_t n) const { return high_[n]; }
    size_t count() const { return corners_.size(); }
    bool is_degenerate(uint32_t n) const { return palpate::is_degenerate(mesh_.triangles[n]); }

    bool boxes_meet(uint32_t a, uint32_t b) const {
        return glm::all(glm::lessThanEqual(low_[a], high_[b])) &&
               glm::all(glm::lessThanEqual(low_[b], high_[a]));
    }
    bool intersect(uint32_t a, uint32_t b) const {
        const glm::uvec3 s = mesh_.triangles[a], t = mesh_.triangles[b];
        std::array<size_t, 3> of_a{0, 1, 2}, of_b{0, 1, 2}; // shared vertices first
        size_t shared = 0;
        for (size_t i = 0; i < 3; ++i)
            for (size_t k = shared; k < 3; ++k)
                if (s[int(of_a[i])] == t[int(of_b[k])]) {
                    std::swap(of_a[shared], of_a[i]);
                    std::swap(of_b[shared], of_b[k]);
                    ++shared;
                    break;
                }
        const Corners &p = corners_[a], &q = corners_[b];
        const auto edge_meets = [](const Corners& c, size_t i, size_t k, const Corners& other) {
            return meets(c[i], c[k], other);
        };
        switch (shared) {
            case 0:
                for (size_t i = 0; i < 3; ++i)
                    if (edge_meets(p, i, (i + 1) % 3, q) || edge_meets(q, i, (i + 1) % 3, p))
                        return true;
                return false;
            case 1: // any other common points reach the edge across from the vertex of one of them
                return edge_meets(p, of_a[1], of_a[2], q) || edge_meets(q, of_b[1], of_b[2], p);
            case 2:
                return folded(p, of_a, q[of_b[2]]);
            default:
                return true;
        }
    }

 private:
    // Two triangles at an edge have more in common where they lie in one plane, on one side of it.
    static bool folded(const Corners& p, const std::array<size_t, 3>& order, glm::dvec3 other) {
        const Corners t{p[order[0]], p[order[1]], p[order[2]]};
        if (side(t[0], t[1], t[2], other) != 0)
            return false;
        const glm::dvec3 normal = twice_area_normal(t);
        const Flat flat = flattened(t, normal), point = flattened({other, other, other}, normal);
        return side(flat[0], flat[1], flat[2]) * side(flat[0], flat[1], point[0]) >= 0;
    }

    const Mesh& mesh_;
    std::vector<Corners> corners_;
    std::vector<glm::dvec3> low_, high_;
};

struct Entry {
    std::array<int32_t, 3> cell;
    uint32_t triangle;
    auto operator<=>(const Entry&) const = default;
};

} // namespace

std::vector<std::pair<uint32_t, uint32_t>> self_intersections(const Mesh& mesh) {
    const Triangles triangles(mesh);
    std::vector<std::pair<uint32_t, uint32_t>> found;
    double extent = 0.0;
    glm::dvec3 origin(INFINITY), far(-INFINITY);
    for (uint32_t n = 0; n < triangles.count(); ++n) {
        const glm::dvec3 size = triangles.high(n) - triangles.low(n);
        extent += std::max({size.x, size.y, size.z});
        origin = glm::min(origin, triangles.low(n));
        far = glm::max(far, triangles.high(n));
    }
    if (triangles.count() == 0)
        return found;
    // Cells twice as wide as triangles are on average, and at most 1024 on a side.
    const glm::dvec3 whole = far - origin;
    const double cell_mm = std::max({2.0 * extent / double(triangles.count()),
                                     std::max({whole.x, whole.y, whole.z}) / 1024.0, 1e-300});
    const auto cell_of = [&](glm::dvec3 p) { return glm::ivec3((p - origin) / cell_mm); };
    std::vector<Entry> entries;
    for (uint32_t n = 0; n < triangles.count(); ++n) {
        if (triangles.is_degenerate(n))
            continue;
        const glm::ivec3 low = cell_of(triangles.low(n)), high = cell_of(triangles.high(n));
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x)
                    entries.push_back({{z, y, x}, n});
    }
    std::sort(entries.begin(), entries.end());
    for (size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
        while (end < entries.size() && entries[end].cell == entries[begin].cell)
            ++end;
        for (size_t i = begin; i < end; ++i)
            for (size_t k = i + 1; k < end; ++k) {
                const uint32_t a = entries[i].triangle, b = entries[k].triangle;
                if (!triangles.boxes_meet(a, b))
                    continue;
                // Both may share several cells: only the first of these looks.
                const glm::ivec3 first = cell_of(glm::max(triangles.low(a), triangles.low(b)));
                if (first.z == entries[i].cell[0] && first.y == entries[i].cell[1] &&
                    first.x == entries[i].cell[2] && triangles.intersect(a, b))
                    found.emplace_back(a, b);
            }
    }
    std::sort(found.begin(), found.end());
    return found;
}

} // namespace palpate
