#include "engine/surface/shell.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>
#include <vector>

#include "engine/mesh/topology.h"
#include "engine/mesh/triangle_tree.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"

namespace palpate {

namespace {

constexpr double kCells = 3.0;       // of the grid in a wall
constexpr double kFewestCells = 1.5; // where the grid would be too large
constexpr uint32_t kBlock = 4;       // samples on a side of what is looked at together

double excess_of(double cell_mm, double wall_mm) {
    return cell_mm * cell_mm / (2.0 * wall_mm);
}

// A place at which a line of samples along x enters (+1) or leaves (-1) the mesh.
struct Crossing {
    double x;
    int turn;
};

// Whether a point of the plane lies left of the line from the lesser end of an edge to the other.
// Both triangles of an edge ask this in the same words, so that a line passes one of them, and
// never both or none.
bool is_left(glm::dvec2 a, glm::dvec2 b, glm::dvec2 point) {
    const bool turned = b.x < a.x || (b.x == a.x && b.y < a.y);
    if (turned)
        std::swap(a, b);
    const glm::dvec2 along = b - a, to = point - a;
    return (along.x * to.y - along.y * to.x >= 0.0) != turned;
}

// The crossings of all lines of a grid whose axes are the world's, by y + size.y * z.
std::vector<std::vector<Crossing>> crossings_of(const TriangleTree& tree, glm::uvec3 size,
                                                glm::dvec3 origin, double cell, double sign) {
    std::vector<std::vector<Crossing>> lines(size_t{size.y} * size.z);
    for (uint32_t n = 0; n < tree.triangle_count(); ++n) {
        const auto c = tree.corners(n);
        const glm::dvec3 normal = glm::cross(c[1] - c[0], c[2] - c[0]);
        if (normal.x == 0.0)
            continue;
        const auto flat = [&](size_t i) { return glm::dvec2(c[i].y, c[i].z); };
        const glm::dvec2 low = glm::min(flat(0), glm::min(flat(1), flat(2))),
                         high = glm::max(flat(0), glm::max(flat(1), flat(2)));
        const glm::dvec2 start(origin.y, origin.z);
        const glm::dvec2 first = glm::max(glm::ceil((low - start) / cell), glm::dvec2(0.0)),
                         last = glm::min(glm::floor((high - start) / cell),
                                         glm::dvec2(size.y - 1.0, size.z - 1.0));
        for (double z = first.y; z <= last.y; ++z)
            for (double y = first.x; y <= last.x; ++y) {
                const glm::dvec2 at = start + cell * glm::dvec2(y, z);
                const bool left = is_left(flat(0), flat(1), at);
                if (is_left(flat(1), flat(2), at) != left || is_left(flat(2), flat(0), at) != left)
                    continue;
                const double x =
                    c[0].x - (normal.y * (at.x - c[0].y) + normal.z * (at.y - c[0].z)) / normal.x;
                lines[static_cast<size_t>(y) + size_t{size.y} * static_cast<size_t>(z)].push_back(
                    {x, normal.x * sign < 0.0 ? 1 : -1});
            }
    }
    for (std::vector<Crossing>& line : lines)
        std::sort(line.begin(), line.end(),
                  [](const Crossing& a, const Crossing& b) { return a.x < b.x; });
    return lines;
}

} // namespace

Result<Shell> hollowed(const Mesh& mesh, const ShellOptions& options) {
    if (!(options.wall_mm > 0.0))
        return fail("a wall: expected a thickness above 0 mm, found {:g}", options.wall_mm);
    if (const MeshTopology found = topology(mesh); !found.closed || !found.consistently_oriented)
        return fail(
            "hollowing: expected a closed surface, found one with {} open and {} misoriented edges",
            found.open_edges, found.misoriented_edges);
    if (mesh.triangles.empty())
        return Shell{mesh};
    const double wall = options.wall_mm;
    const TriangleTree tree(mesh);
    glm::dvec3 low(INFINITY), high(-INFINITY);
    for (const glm::dvec3 p : tree.positions_mm()) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    double cell = wall / kCells;
    const auto size_at = [&](double h) { return glm::floor((high - low) / h) + 2.0; };
    const auto samples_at = [&](double h) {
        const glm::dvec3 size = size_at(h);
        return size.x * size.y * size.z;
    };
    while (samples_at(cell) > static_cast<double>(options.max_samples))
        cell *= 1.02;
    if (cell > wall / kFewestCells)
        return fail(
            "a wall of {:g} mm is too thin for a body of {:.0f} x {:.0f} x {:.0f} mm: expected at "
            "least {:.2g} mm",
            wall, high.x - low.x, high.y - low.y, high.z - low.z, kFewestCells * cell);
    const glm::uvec3 size(size_at(cell));
    // Not on the planes that the positions of a mesh of samples lie in.
    const glm::dvec3 origin = low - cell * glm::dvec3(0.3819, 0.4142, 0.2360);
    const double level = wall + excess_of(cell, wall), beyond = level + 2.0 * cell;
    const double sign = glm::determinant(glm::dmat3(mesh.world_from_mesh)) < 0.0 ? -1.0 : 1.0;
    const auto lines = crossings_of(tree, size, origin, cell, sign);

    std::vector<float> depth(size_t{size.x} * size.y * size.z, 0.0f); // 0: outside
    const glm::uvec3 blocks = (size + kBlock - 1u) / kBlock;
    std::atomic<uint32_t> done{0};
    tbb::parallel_for(uint32_t{0}, blocks.z, [&](uint32_t bz) {
        if (options.stop.stop_requested())
            return;
        std::vector<char> inside(size_t{size.x} * kBlock * kBlock);
        for (uint32_t by = 0; by < blocks.y; ++by) {
            const glm::uvec2 from(by * kBlock, bz * kBlock),
                to = glm::min(from + kBlock, glm::uvec2(size.y, size.z));
            for (uint32_t z = from.y; z < to.y; ++z)
                for (uint32_t y = from.x; y < to.x; ++y) {
                    const std::vector<Crossing>& line = lines[y + size_t{size.y} * z];
                    size_t next = 0;
                    int turns = 0;
                    char* row = &inside[size_t{size.x} * (y - from.x + kBlock * (z - from.y))];
                    for (uint32_t x = 0; x < size.x; ++x) {
                        for (; next < line.size() && line[next].x <= origin.x + cell * x; ++next)
                            turns += line[next].turn;
                        row[x] = turns > 0;
                    }
                }
            for (uint32_t bx = 0; bx < blocks.x; ++bx) {
                const uint32_t begin = bx * kBlock, end = std::min(begin + kBlock, size.x);
                bool any = false;
                for (size_t row = 0; row < size_t{kBlock} * kBlock; ++row)
                    for (uint32_t x = begin; x < end; ++x)
                        any = any || inside[size_t{size.x} * row + x];
                if (!any)
                    continue;
                const double half = 0.5 * (kBlock - 1) * cell, reach = std::sqrt(3.0) * half;
                const glm::dvec3 middle = origin + cell * glm::dvec3(begin, from.x, from.y) + half;
                const bool is_deep =
                    tree.nearest(middle, beyond + reach).triangle == ~0u; // all of the block
                for (uint32_t z = from.y; z < to.y; ++z)
                    for (uint32_t y = from.x; y < to.x; ++y) {
                        double within = beyond; // of a neighbour's, and a cell more
                        for (uint32_t x = begin; x < end; ++x) {
                            if (!inside[size_t{size.x} * (y - from.x + kBlock * (z - from.y)) + x])
                                continue;
                            double found = beyond;
                            if (!is_deep) {
                                const glm::dvec3 at = origin + cell * glm::dvec3(x, y, z);
                                const double d = tree.nearest(at, within).distance_mm;
                                found = std::min(d, beyond);
                                within = std::min(beyond, found + 1.001 * cell);
                            }
                            depth[x + size.x * (y + size_t{size.y} * z)] =
                                static_cast<float>(found);
                        }
                    }
            }
        }
        if (options.progress && (++done & 7) == 0)
            options.progress(double(done) / blocks.z);
    });
    if (options.stop.stop_requested())
        return fail("hollowing was stopped");
    const Volume depths =
        make_volume(make_grid(size, glm::dvec3(cell), origin), std::span<const float>(depth));
    depth = {};
    const Mesh inner = marching_cubes(depths, static_cast<float>(level),
                                      {.topology = SurfaceTopology::correct,
                                       .normals = SurfaceNormals::none,
                                       .closed_at_border = true,
                                       .stop = options.stop});
    if (options.stop.stop_requested())
        return fail("hollowing was stopped");
    Shell shell{mesh, cell, level - wall, !inner.triangles.empty()};
    // The hollow's surface faces into it. In a mesh that is mirrored, triangles are turned over.
    const glm::dmat4 to_mesh = glm::inverse(mesh.world_from_mesh) * inner.world_from_mesh;
    const auto offset = static_cast<uint32_t>(shell.mesh.positions.size());
    for (const glm::vec3 p : inner.positions)
        shell.mesh.positions.emplace_back(to_mesh * glm::dvec4(glm::dvec3(p), 1.0));
    for (const glm::uvec3 t : inner.triangles)
        shell.mesh.triangles.push_back(offset + (sign < 0.0 ? t : glm::uvec3(t.x, t.z, t.y)));
    if (!mesh.labels.empty())
        shell.mesh.labels.resize(shell.mesh.triangles.size(), mesh.labels.front());
    if (!mesh.outer_labels.empty())
        shell.mesh.outer_labels.resize(shell.mesh.triangles.size(), mesh.outer_labels.front());
    if (!mesh.normals.empty()) {
        const std::vector<glm::vec3> normals = vertex_normals(shell.mesh);
        shell.mesh.normals.insert(shell.mesh.normals.end(), normals.begin() + offset,
                                  normals.end());
    }
    return shell;
}

} // namespace palpate
