#include "engine/segment/simplex_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "engine/base/assert.h"
#include "engine/mesh/topology.h"

namespace palpate {

namespace {

constexpr size_t kGrain = 512; // vertices

// What the neighbours of a vertex tell of its place.
struct Neighbourhood3 {
    glm::dvec3 normal{0.0}, middle{0.0}; // of their plane; the mean of the three
    double radius = 0.0, off = 0.0;      // of their circle; of `middle` from its centre
    double height = 0.0, aside = 0.0;    // of the vertex over the plane; from the circle's axis
    double edge = 0.0;                   // mean distance to them
    bool flat = false;                   // on a line: there is no plane
};

Neighbourhood3 look_round(const SimplexMesh& mesh, size_t vertex) {
    const glm::uvec3 n = mesh.neighbours[vertex];
    const glm::dvec3 p = mesh.positions[vertex], a = mesh.positions[n.x];
    const glm::dvec3 ab = mesh.positions[n.y] - a, ac = mesh.positions[n.z] - a;
    const glm::dvec3 across = glm::cross(ab, ac);
    const double squared = glm::dot(across, across);
    Neighbourhood3 out;
    out.middle = a + (ab + ac) / 3.0;
    out.edge = (glm::length(a - p) + glm::length(a + ab - p) + glm::length(a + ac - p)) / 3.0;
    out.flat = !(squared > 1e-24 * glm::dot(ab, ab) * glm::dot(ac, ac));
    if (out.flat)
        return out;
    out.normal = across / std::sqrt(squared);
    const glm::dvec3 to_center =
        (glm::dot(ac, ac) * glm::cross(across, ab) + glm::dot(ab, ab) * glm::cross(ac, across)) /
        (2.0 * squared);
    const glm::dvec3 center = a + to_center;
    out.radius = glm::length(to_center);
    out.off = glm::distance(out.middle, center);
    out.height = glm::dot(p - a, out.normal);
    out.aside = glm::length(p - out.height * out.normal - center);
    return out;
}

// Of the sphere through a circle of radius r and a point h over its plane, `aside` from its axis.
double curvature_of(const Neighbourhood3& n) {
    if (n.flat)
        return 0.0;
    const double h = n.height, r = n.radius;
    const double rest = n.aside * n.aside + h * h - r * r;
    const double below = std::sqrt(4.0 * h * h * r * r + rest * rest);
    return below > 0.0 ? 2.0 * h / below : 0.0;
}

double height_of(const Neighbourhood3& n, double curvature) {
    const double most = 1.0 / std::max(n.radius, n.off);
    const double h = std::clamp(curvature, -most, most);
    const auto root = [&](double length) {
        return std::sqrt(std::max(1.0 - length * length * h * h, 0.0));
    };
    const double below = root(n.off) + root(n.radius);
    return below > 0.0 ? h * (n.radius * n.radius - n.off * n.off) / below : n.radius;
}

glm::dvec3 cut(glm::dvec3 v, double most) {
    const double length = glm::length(v);
    return length > most ? v * (most / length) : v;
}

template <class Work>
void for_each_vertex(size_t count, const Work& work) {
    tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kGrain),
                      [&](const tbb::blocked_range<size_t>& range) {
                          for (size_t i = range.begin(); i < range.end(); ++i)
                              work(i);
                      });
}

} // namespace

Result<SimplexMesh> simplex_mesh(const Mesh& triangles) {
    const MeshTopology found = topology(triangles);
    if (triangles.triangles.empty() || !found.closed || !found.manifold ||
        !found.consistently_oriented)
        return fail(
            "simplex mesh: expected a closed, manifold, consistently oriented mesh, found "
            "{} triangles, {} open, {} non-manifold and {} misoriented edges",
            triangles.triangles.size(), found.open_edges, found.non_manifold_edges,
            found.misoriented_edges);
    SimplexMesh out;
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> triangle_of; // by an edge as it runs along it
    std::vector<uint32_t> one_of(triangles.positions.size(), UINT32_MAX);
    for (uint32_t t = 0; t < triangles.triangles.size(); ++t) {
        const glm::uvec3 v = triangles.triangles[t];
        glm::dvec3 sum(0.0);
        for (int k = 0; k < 3; ++k) {
            triangle_of[{v[k], v[(k + 1) % 3]}] = t;
            one_of[v[k]] = std::min(one_of[v[k]], t);
            sum += glm::dvec3(triangles.positions[v[k]]);
        }
        out.positions.emplace_back(triangles.world_from_mesh * glm::dvec4(sum / 3.0, 1.0));
    }
    const bool mirrored = glm::determinant(glm::dmat3(triangles.world_from_mesh)) < 0.0;
    for (const glm::uvec3 v : triangles.triangles) {
        const uint32_t a = triangle_of.at({v.y, v.x}), b = triangle_of.at({v.z, v.y});
        const uint32_t c = triangle_of.at({v.x, v.z});
        out.neighbours.emplace_back(a, mirrored ? c : b, mirrored ? b : c);
    }
    out.face_first.push_back(0);
    for (uint32_t p = 0; p < one_of.size(); ++p) {
        if (one_of[p] == UINT32_MAX)
            continue; // of no triangle
        const size_t begin = out.face_vertices.size();
        uint32_t t = one_of[p];
        do { // counter-clockwise: across the edge that runs to p
            out.face_vertices.push_back(t);
            const glm::uvec3 v = triangles.triangles[t];
            const uint32_t last = v.x == p ? v.z : v.y == p ? v.x : v.y;
            t = triangle_of.at({p, last});
        } while (t != one_of[p]);
        if (mirrored)
            std::reverse(out.face_vertices.begin() + ptrdiff_t(begin), out.face_vertices.end());
        out.face_first.push_back(uint32_t(out.face_vertices.size()));
    }
    out.before = out.positions;
    return out;
}

SimplexMesh simplex_ellipsoid(glm::dvec3 center_mm, glm::dvec3 semi_axes_mm, int subdivisions) {
    PALPATE_ASSERT(subdivisions >= 0 && subdivisions <= 8);
    const double g = (1.0 + std::sqrt(5.0)) / 2.0;
    std::vector<glm::dvec3> points{{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                   {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                   {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    Mesh mesh;
    mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (glm::dvec3& p : points)
        p = glm::normalize(p);
    for (int level = 0; level < subdivisions; ++level) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        const auto middle = [&](uint32_t a, uint32_t b) {
            const auto [at, is_new] =
                middles.try_emplace(std::minmax(a, b), uint32_t(points.size()));
            if (is_new)
                points.push_back(glm::normalize(points[a] + points[b]));
            return at->second;
        };
        std::vector<glm::uvec3> finer;
        for (const glm::uvec3 t : mesh.triangles) {
            const uint32_t a = middle(t.x, t.y), b = middle(t.y, t.z), c = middle(t.z, t.x);
            finer.insert(finer.end(), {{t.x, a, c}, {t.y, b, a}, {t.z, c, b}, {a, b, c}});
        }
        mesh.triangles = std::move(finer);
    }
    for (const glm::dvec3 p : points)
        mesh.positions.emplace_back(p);
    SimplexMesh out = simplex_mesh(mesh).value();
    for (glm::dvec3& p : out.positions)
        p = center_mm + semi_axes_mm * glm::normalize(p);
    out.before = out.positions;
    return out;
}

Mesh triangles_of(const SimplexMesh& mesh) {
    Mesh out;
    const glm::dvec3 origin = mesh.positions.empty() ? glm::dvec3(0.0) : mesh.positions[0];
    out.world_from_mesh[3] = glm::dvec4(origin, 1.0);
    for (const glm::dvec3 p : mesh.positions)
        out.positions.emplace_back(p - origin);
    for (size_t f = 0; f < mesh.faces(); ++f) {
        const uint32_t begin = mesh.face_first[f], end = mesh.face_first[f + 1];
        const auto center = uint32_t(out.positions.size());
        glm::dvec3 sum(0.0);
        for (uint32_t i = begin; i < end; ++i) {
            const uint32_t next = i + 1 < end ? i + 1 : begin;
            sum += mesh.positions[mesh.face_vertices[i]] - origin;
            out.triangles.emplace_back(center, mesh.face_vertices[i], mesh.face_vertices[next]);
        }
        out.positions.emplace_back(sum / double(end - begin));
    }
    return out;
}

int64_t euler_number(const SimplexMesh& mesh) {
    const auto vertices = int64_t(mesh.positions.size());
    return vertices - vertices * 3 / 2 + int64_t(mesh.faces());
}

glm::dvec3 normal_at(const SimplexMesh& mesh, size_t vertex) {
    return look_round(mesh, vertex).normal;
}

double curvature_at(const SimplexMesh& mesh, size_t vertex) {
    return curvature_of(look_round(mesh, vertex));
}

std::vector<uint32_t> patch_of_faces(const SimplexMesh& mesh, uint32_t face, uint32_t depth) {
    PALPATE_ASSERT_CMP(face, <, mesh.faces());
    std::vector<std::vector<uint32_t>> faces_of(mesh.positions.size());
    for (uint32_t f = 0; f < mesh.faces(); ++f)
        for (uint32_t i = mesh.face_first[f]; i < mesh.face_first[f + 1]; ++i)
            faces_of[mesh.face_vertices[i]].push_back(f);
    std::set<uint32_t> patch{face};
    for (uint32_t d = 0; d < depth; ++d) {
        std::set<uint32_t> wider = patch;
        for (const uint32_t f : patch)
            for (uint32_t i = mesh.face_first[f]; i < mesh.face_first[f + 1]; ++i)
                wider.insert(faces_of[mesh.face_vertices[i]].begin(),
                             faces_of[mesh.face_vertices[i]].end());
        patch = std::move(wider);
    }
    return {patch.begin(), patch.end()};
}

double simplex_step(SimplexMesh& mesh, const SimplexForce& force,
                    std::span<const SimplexPull> pulls, const SimplexOptions& options) {
    const size_t count = mesh.positions.size();
    std::vector<Neighbourhood3> round(count);
    std::vector<double> curvature(count), evened(count);
    for_each_vertex(count, [&](size_t i) {
        round[i] = look_round(mesh, i);
        curvature[i] = curvature_of(round[i]);
    });
    for (uint32_t pass = 0; pass < options.rigidity; ++pass) {
        for_each_vertex(count, [&](size_t i) {
            const glm::uvec3 n = mesh.neighbours[i];
            evened[i] = 0.25 * (curvature[i] + curvature[n.x] + curvature[n.y] + curvature[n.z]);
        });
        curvature.swap(evened);
    }
    std::vector<glm::dvec3> pulled(pulls.empty() ? 0 : count, glm::dvec3(0.0));
    for (const SimplexPull& pull : pulls) {
        std::set<uint32_t> vertices;
        for (const uint32_t f : pull.faces)
            vertices.insert(mesh.face_vertices.begin() + mesh.face_first[f],
                            mesh.face_vertices.begin() + mesh.face_first[f + 1]);
        for (const uint32_t v : vertices)
            pulled[v] += pull.by_mm;
    }
    std::vector<glm::dvec3> moved(count);
    for_each_vertex(count, [&](size_t i) {
        const Neighbourhood3& n = round[i];
        const glm::dvec3 p = mesh.positions[i];
        const double most = options.largest_step * n.edge;
        glm::dvec3 sum(0.0);
        if (!n.flat) {
            sum += options.internal * (n.middle + height_of(n, curvature[i]) * n.normal - p);
            if (force)
                sum += options.external * cut(force(p, n.normal), most);
        } else {
            sum += options.internal * (n.middle - p);
        }
        if (!pulled.empty())
            sum += pulled[i];
        const glm::dvec3 velocity = (1.0 - options.damping) * (p - mesh.before[i]);
        moved[i] = p + cut(velocity + sum / options.mass, most);
    });
    mesh.before.swap(mesh.positions);
    mesh.positions.swap(moved);
    double largest = 0.0;
    for (size_t i = 0; i < count; ++i)
        largest = std::max(largest, glm::distance(mesh.positions[i], mesh.before[i]));
    return largest;
}

} // namespace palpate
