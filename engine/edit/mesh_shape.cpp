#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

#include "engine/edit/shape.h"
#include "engine/mesh/mesh_check.h"
#include "engine/mesh/triangle_tree.h"

namespace palpate {

namespace {

constexpr uint64_t kMostCells = uint64_t{1} << 24;
constexpr double kBandCells = 3.0; // distances are told up to here, and then stay the same

struct MeshShape : Shape {
    double signed_mm(glm::dvec3 p) const override {
        // Outside the samples: the distance to their box bounds the rest, for the outermost layer
        // is outside the mesh.
        const double beyond = samples_box.signed_mm(p);
        const glm::dvec3 at =
            glm::clamp((p - samples_box.low) / cell_mm, glm::dvec3(0.0), glm::dvec3(count - 1u));
        const glm::uvec3 i = glm::min(glm::uvec3(at), count - 2u);
        const glm::dvec3 f = at - glm::dvec3(i);
        double sum = 0.0;
        for (uint32_t corner = 0; corner < 8; ++corner) {
            const glm::uvec3 c(corner & 1, corner >> 1 & 1, corner >> 2);
            const glm::dvec3 w = glm::mix(1.0 - f, f, glm::dvec3(c));
            const glm::uvec3 s = i + c;
            sum += w.x * w.y * w.z * values[s.x + count.x * (s.y + size_t{count.y} * s.z)];
        }
        return std::max(sum / 1.7320508075688774, beyond);
    }
    BoxMm bounds() const override { return samples_box; }

    glm::uvec3 count{2};
    double cell_mm = 1.0;
    BoxMm samples_box;
    std::vector<float> values;
};

// On which side of the line from a to b, in the plane of y and z, p lies: +1 left, -1 right.
// Exactly opposite for b and a, so that the two triangles at an edge agree; on the line it is one
// of them.
int side_yz(glm::dvec3 a, glm::dvec3 b, glm::dvec2 p) {
    const bool swap = a.y > b.y || (a.y == b.y && a.z > b.z);
    if (swap)
        std::swap(a, b);
    const double area = (b.y - a.y) * (p.y - a.z) - (b.z - a.z) * (p.x - a.y);
    return (area >= 0.0) != swap ? 1 : -1;
}

// How an edge from a to b counts in the winding about p: +1 upwards and to the right of p, -1
// downwards, 0 elsewhere. Ends count by a half-open rule, so that a chain of edges counts once.
int crosses(glm::dvec3 a, glm::dvec3 b, glm::dvec2 p) {
    const bool a_below = a.z <= p.y, b_below = b.z <= p.y;
    if (a_below == b_below)
        return 0;
    const int side = side_yz(a, b, p);
    return a_below ? (side > 0 ? 1 : 0) : (side < 0 ? -1 : 0);
}

// The line (y, z) = p meets the triangle at x; returns the sense of the crossing, 0 without one.
int crossing(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, glm::dvec2 p, double& x) {
    const int winding = crosses(a, b, p) + crosses(b, c, p) + crosses(c, a, p);
    if (winding == 0)
        return 0;
    const glm::dvec3 n = glm::cross(b - a, c - a);
    x = n.x == 0.0 ? a.x : a.x - (n.y * (p.x - a.y) + n.z * (p.y - a.z)) / n.x;
    return winding;
}

} // namespace

int winding_number(const Mesh& mesh, glm::dvec3 p) {
    int winding = 0;
    for (const glm::uvec3 t : mesh.triangles) {
        double x = 0.0;
        const int crossed =
            crossing(glm::dvec3(mesh.positions[t.x]), glm::dvec3(mesh.positions[t.y]),
                     glm::dvec3(mesh.positions[t.z]), {p.y, p.z}, x);
        if (crossed != 0 && x > p.x)
            winding += crossed;
    }
    return winding;
}

double triangle_distance(glm::dvec3 p, glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
    return glm::length(p - nearest_point(p, {a, b, c}));
}

bool is_closed(const Mesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, int> balance;
    for (const glm::uvec3 t : mesh.triangles)
        for (int i = 0; i < 3; ++i) {
            const uint32_t a = t[i], b = t[(i + 1) % 3];
            balance[std::minmax(a, b)] += a < b ? 1 : -1;
        }
    return std::all_of(balance.begin(), balance.end(), [](const auto& e) { return e.second == 0; });
}

Result<ShapePtr> make_mesh_shape(const Mesh& mesh, double cell_mm) {
    if (mesh.triangles.empty())
        return fail("expected a mesh with triangles, found none");
    PALPATE_TRY(check_mesh(mesh));
    if (!is_closed(mesh))
        return fail("expected a closed mesh, found edges with a triangle on one side only");
    BoxMm box{glm::dvec3(mesh.positions[0]), glm::dvec3(mesh.positions[0])};
    for (const glm::vec3 p : mesh.positions) {
        box.low = glm::min(box.low, glm::dvec3(p));
        box.high = glm::max(box.high, glm::dvec3(p));
    }
    const glm::dvec3 cells = glm::ceil((box.high - box.low) / cell_mm) + 2.0;
    if (!(cells.x * cells.y * cells.z <= static_cast<double>(kMostCells)))
        return fail("expected a mesh of at most {} cells of {} mm, found {:.3g} x {:.3g} x {:.3g}",
                    kMostCells, cell_mm, cells.x, cells.y, cells.z);

    const auto shape = std::make_shared<MeshShape>();
    shape->count = glm::uvec3(cells) + 1u;
    shape->cell_mm = cell_mm;
    shape->samples_box.low = box.low - cell_mm;
    shape->samples_box.high = shape->samples_box.low + cells * cell_mm;
    const double band = kBandCells * cell_mm;
    const glm::uvec3 n = shape->count;
    shape->values.assign(size_t{n.x} * n.y * n.z, static_cast<float>(band));
    // A layer in z belongs to one thread, which looks at the triangles near it in their order.
    tbb::parallel_for(uint32_t{0}, n.z, [&](uint32_t z) {
        float* layer = shape->values.data() + size_t{n.x} * n.y * z;
        const auto place = [&](uint32_t x, uint32_t y) {
            return shape->samples_box.low + cell_mm * glm::dvec3(x, y, z);
        };
        struct Crossed {
            uint32_t y;
            double x;
            int winding;
        };
        std::vector<Crossed> crossed;
        for (const glm::uvec3 t : mesh.triangles) {
            const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
            const glm::dvec3 low = glm::min(a, glm::min(b, c)) - band;
            const glm::dvec3 high = glm::max(a, glm::max(b, c)) + band;
            if (place(0, 0).z < low.z || place(0, 0).z > high.z)
                continue;
            const auto first = glm::max((low - shape->samples_box.low) / cell_mm, glm::dvec3(0.0));
            const auto last =
                glm::min((high - shape->samples_box.low) / cell_mm, glm::dvec3(n) - 1.0);
            for (auto y = static_cast<uint32_t>(first.y); y <= last.y; ++y) {
                const glm::dvec3 row = place(0, y);
                double at = 0.0;
                if (const int winding = crossing(a, b, c, {row.y, row.z}, at))
                    crossed.push_back({y, at, winding});
                for (auto x = static_cast<uint32_t>(first.x); x <= last.x; ++x) {
                    float& value = layer[x + size_t{n.x} * y];
                    value = std::min(value,
                                     static_cast<float>(triangle_distance(place(x, y), a, b, c)));
                }
            }
        }
        std::stable_sort(crossed.begin(), crossed.end(), [](const Crossed& l, const Crossed& r) {
            return l.y < r.y || (l.y == r.y && l.x > r.x);
        });
        size_t next = 0;
        for (uint32_t y = 0; y < n.y; ++y) {
            int winding = 0;
            for (uint32_t x = n.x; x-- > 0;) {
                while (next < crossed.size() && crossed[next].y == y &&
                       crossed[next].x > place(x, y).x)
                    winding += crossed[next++].winding;
                if (winding != 0)
                    layer[x + size_t{n.x} * y] = -layer[x + size_t{n.x} * y];
            }
            while (next < crossed.size() && crossed[next].y == y)
                ++next;
        }
    });
    return shape;
}

} // namespace palpate
