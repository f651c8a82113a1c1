#include "engine/mesh/topology.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <tuple>

#include "engine/base/assert.h"
#include "engine/base/forest.h"
#include "engine/mesh/near_proof.h"

namespace palpate {

namespace {

// Which vertices, or fans of one, hang together.
using VertexForest = Forest<std::vector<uint32_t>>;

// Counts of the edges and triangles whose lowest vertex is one given vertex.
struct EdgeCounts {
    uint64_t open = 0, non_manifold = 0, misoriented = 0, duplicates = 0, split_vertices = 0;

    EdgeCounts& operator+=(const EdgeCounts& other) {
        open += other.open;
        non_manifold += other.non_manifold;
        misoriented += other.misoriented;
        duplicates += other.duplicates;
        split_vertices += other.split_vertices;
        return *this;
    }
};

// A triangle turned so that vertex `v` comes first; the sense of rotation stays.
glm::uvec3 turned_to(glm::uvec3 t, uint32_t v) {
    if (t.y == v)
        return {t.y, t.z, t.x};
    return t.z == v ? glm::uvec3(t.z, t.x, t.y) : t;
}

struct Side {
    uint32_t other; // the far end of an edge from v
    uint32_t fan;   // which triangle of v
    bool outward;   // the triangle runs from v to it
};

// Looks at one vertex; `edges` counts the edges to higher vertices. The vectors are scratch.
EdgeCounts look_at_vertex(const Mesh& mesh, const TrianglesOfVertex& incident, uint32_t v,
                          std::vector<Side>& sides, std::vector<glm::uvec2>& opposite,
                          uint32_t& edges) {
    EdgeCounts counts;
    sides.clear();
    opposite.clear();
    for (uint32_t i = incident.first[v]; i < incident.first[v + 1]; ++i) {
        const glm::uvec3 t = turned_to(mesh.triangles[incident.triangles[i]], v);
        const auto fan = static_cast<uint32_t>(opposite.size());
        opposite.emplace_back(t.y, t.z);
        sides.push_back({t.y, fan, true});
        sides.push_back({t.z, fan, false});
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.other, a.fan, a.outward) < std::tie(b.other, b.fan, b.outward);
    });
    VertexForest fans{std::vector<uint32_t>(opposite.size())};
    size_t count = opposite.size(); // of fans
    for (size_t i = 0; i < sides.size();) {
        size_t end = i, outward = 0;
        for (; end < sides.size() && sides[end].other == sides[i].other; ++end) {
            outward += sides[end].outward;
            if (fans.root(sides[end].fan) != fans.root(sides[i].fan)) {
                fans.join(sides[end].fan, sides[i].fan);
                --count;
            }
        }
        const size_t uses = end - i;
        if (sides[i].other > v) {
            ++edges;
            counts.open += uses == 1;
            counts.non_manifold += uses > 2;
            counts.misoriented += uses >= 2 && 2 * outward != uses;
        }
        i = end;
    }
    counts.split_vertices = count > 1;
    for (glm::uvec2& pair : opposite)
        pair = {std::min(pair.x, pair.y), std::max(pair.x, pair.y)};
    std::sort(opposite.begin(), opposite.end(),
              [](glm::uvec2 a, glm::uvec2 b) { return std::tie(a.x, a.y) < std::tie(b.x, b.y); });
    for (size_t i = 1; i < opposite.size(); ++i)
        counts.duplicates += opposite[i].x > v && opposite[i] == opposite[i - 1];
    return counts;
}

// Area and volume in world millimetres. Differences of floats are taken from the middle of the
// positions' box, so that the whole is exact to double whatever the offset, and does not depend on
// which position comes first.
struct Measure {
    explicit Measure(const Mesh& mesh)
        : linear(mesh.world_from_mesh), scale(std::abs(glm::determinant(linear))) {
        if (mesh.positions.empty())
            return;
        glm::vec3 low = mesh.positions[0], high = low;
        for (const glm::vec3 position : mesh.positions) {
            low = glm::min(low, position);
            high = glm::max(high, position);
        }
        origin = 0.5 * (glm::dvec3(low) + glm::dvec3(high));
    }
    glm::dmat3 linear;
    double scale; // volume in the world of a unit volume of mesh space; mirrors do not turn it
    glm::dvec3 origin{0.0};

    // Adds triangle n. The volume of a wall between two labels belongs to the one and is missing
    // from the other, so the wall adds nothing to the sum.
    void add(const Mesh& mesh, size_t n, MeshComponent& component, uint64_t& flat) const {
        const glm::uvec3 t = mesh.triangles[n];
        const glm::dvec3 a = glm::dvec3(mesh.positions[t.x]) - origin;
        const glm::dvec3 b = glm::dvec3(mesh.positions[t.y]) - origin;
        const glm::dvec3 c = glm::dvec3(mesh.positions[t.z]) - origin;
        const glm::dvec3 u = linear * (b - a), v = linear * (c - a);
        const double twice_area = glm::length(glm::cross(u, v));
        component.area_mm2 += 0.5 * twice_area;
        const bool is_inner =
            !mesh.outer_labels.empty() && mesh.outer_labels[n] != 0 && mesh.labels[n] != 0;
        if (!is_inner)
            component.volume_mm3 += scale * glm::dot(a, glm::cross(b, c)) / 6.0;
        // The rounding of a cross product of vectors of these lengths is below 2^-50 of them.
        flat += twice_area <= 0x1p-50 * glm::length(u) * glm::length(v);
    }
};

} // namespace

TrianglesOfVertex triangles_of_vertices(const Mesh& mesh) {
    PALPATE_ASSERT_CMP(mesh.triangles.size(), <, size_t{1} << 32);
    TrianglesOfVertex incident;
    incident.first.assign(mesh.positions.size() + 1, 0);
    for (const glm::uvec3 t : mesh.triangles)
        if (!is_degenerate(t))
            for (int i = 0; i < 3; ++i)
                ++incident.first[t[i] + size_t{1}];
    std::partial_sum(incident.first.begin(), incident.first.end(), incident.first.begin());
    incident.triangles.resize(incident.first.back());
    std::vector<uint32_t> next(incident.first.begin(), incident.first.end() - 1);
    for (size_t n = 0; n < mesh.triangles.size(); ++n)
        if (const glm::uvec3 t = mesh.triangles[n]; !is_degenerate(t))
            for (int i = 0; i < 3; ++i)
                incident.triangles[next[t[i]]++] = static_cast<uint32_t>(n);
    return incident;
}

MeshTopology topology(const Mesh& mesh) {
    MeshTopology found;
    const TrianglesOfVertex incident = triangles_of_vertices(mesh);
    const auto vertex_count = static_cast<uint32_t>(mesh.positions.size());
    std::vector<uint32_t> edges(vertex_count, 0); // from each vertex to higher ones
    const EdgeCounts counts = tbb::parallel_reduce(
        tbb::blocked_range<uint32_t>(0, vertex_count, 4096), EdgeCounts{},
        [&](const tbb::blocked_range<uint32_t>& range, EdgeCounts sum) {
            std::vector<Side> sides;
            std::vector<glm::uvec2> opposite;
            for (uint32_t v = range.begin(); v < range.end(); ++v)
                sum += look_at_vertex(mesh, incident, v, sides, opposite, edges[v]);
            return sum;
        },
        [](EdgeCounts a, const EdgeCounts& b) { return a += b; });

    VertexForest forest{std::vector<uint32_t>(vertex_count)};
    for (const glm::uvec3 t : mesh.triangles)
        if (!is_degenerate(t)) {
            forest.join(t.x, t.y);
            forest.join(t.x, t.z);
        }
    constexpr uint32_t kNone = ~0u;
    std::vector<uint32_t> component_of_root(vertex_count, kNone);
    const Measure measure(mesh);
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        const glm::uvec3 t = mesh.triangles[n];
        if (is_degenerate(t)) {
            ++found.degenerate_triangles;
            continue;
        }
        uint32_t& at = component_of_root[forest.root(t.x)];
        if (at == kNone) {
            at = static_cast<uint32_t>(found.components.size());
            found.components.emplace_back();
        }
        MeshComponent& component = found.components[at];
        ++component.triangles;
        measure.add(mesh, n, component, found.zero_area_triangles);
    }
    for (uint32_t v = 0; v < vertex_count; ++v)
        if (incident.first[v] != incident.first[v + 1]) {
            MeshComponent& component = found.components[component_of_root[forest.root(v)]];
            ++component.vertices;
            component.euler_number += 1 - int64_t{edges[v]};
        }
    for (MeshComponent& component : found.components) {
        component.euler_number += static_cast<int64_t>(component.triangles);
        found.triangles += component.triangles;
        found.vertices += component.vertices;
        found.euler_number += component.euler_number;
        found.area_mm2 += component.area_mm2;
        found.volume_mm3 += component.volume_mm3;
    }
    found.open_edges = counts.open;
    found.non_manifold_edges = counts.non_manifold;
    found.misoriented_edges = counts.misoriented;
    found.non_manifold_vertices = counts.split_vertices;
    found.duplicate_triangles = counts.duplicates;
    found.closed = counts.open == 0;
    found.manifold =
        counts.non_manifold == 0 && counts.split_vertices == 0 && found.degenerate_triangles == 0;
    found.consistently_oriented = counts.misoriented == 0;
    return found;
}

// By sorting, and not by hashing: no choice of positions makes it slow.
Mesh weld(const Mesh& mesh) {
    struct Place {
        std::array<uint32_t, 3> bits;
        uint32_t vertex;
    };
    std::vector<Place> places(mesh.positions.size());
    for (uint32_t v = 0; v < places.size(); ++v) {
        const glm::vec3 p = mesh.positions[v] + 0.0f; // -0 becomes 0
        places[v] = {{std::bit_cast<uint32_t>(p.x), std::bit_cast<uint32_t>(p.y),
                      std::bit_cast<uint32_t>(p.z)},
                     v};
    }
    tbb::parallel_sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
        return std::tie(a.bits, a.vertex) < std::tie(b.bits, b.vertex);
    });
    // Vertices in one place become the first of them; then they are numbered without the others.
    std::vector<uint32_t> renamed(places.size());
    for (size_t i = 0; i < places.size(); ++i)
        renamed[places[i].vertex] = i > 0 && places[i].bits == places[i - 1].bits
                                        ? renamed[places[i - 1].vertex]
                                        : places[i].vertex;
    places = {};
    const auto is_first = [&](uint32_t v) { return renamed[v] == v; };
    Mesh welded{.labels = mesh.labels,
                .outer_labels = mesh.outer_labels,
                .world_from_mesh = mesh.world_from_mesh};
    size_t count = 0;
    for (uint32_t v = 0; v < renamed.size(); ++v)
        count += is_first(v);
    welded.positions.reserve(count);
    welded.normals.reserve(mesh.normals.empty() ? 0 : count);
    for (uint32_t v = 0; v < renamed.size(); ++v) {
        if (!is_first(v)) {
            renamed[v] = renamed[renamed[v]]; // which comes before, and has its number
            continue;
        }
        renamed[v] = static_cast<uint32_t>(welded.positions.size());
        welded.positions.push_back(mesh.positions[v] + 0.0f);
        if (!mesh.normals.empty())
            welded.normals.push_back(mesh.normals[v]);
    }
    welded.triangles.reserve(mesh.triangles.size());
    for (const glm::uvec3 t : mesh.triangles)
        welded.triangles.emplace_back(renamed[t.x], renamed[t.y], renamed[t.z]);
    return welded;
}

std::vector<glm::vec3> vertex_normals(const Mesh& mesh) {
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0.0));
    for (const glm::uvec3 t : mesh.triangles) {
        const glm::dvec3 a(mesh.positions[t.x]);
        const glm::dvec3 normal =
            glm::cross(glm::dvec3(mesh.positions[t.y]) - a, glm::dvec3(mesh.positions[t.z]) - a);
        for (int i = 0; i < 3; ++i)
            sums[t[i]] += normal;
    }
    std::vector<glm::vec3> normals(sums.size(), glm::vec3(0.0f));
    for (size_t v = 0; v < sums.size(); ++v)
        if (const double length = glm::length(sums[v]); length > 0.0)
            normals[v] = glm::vec3(sums[v] / length);
    return normals;
}

} // namespace palpate
