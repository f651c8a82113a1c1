#include "engine/segment/simplex_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "engine/base/assert.h"
#include "engine/mesh/topology.h"
#include "engine/segment/simplex_geometry.h"

namespace palpate {

namespace {

SimplexPlaces<double> places_at(const SimplexMesh& mesh, size_t vertex) {
    const glm::uvec3 n = mesh.neighbours[vertex];
    const glm::dvec3 p = mesh.positions[vertex], a = mesh.positions[n.x] - p,
                     b = mesh.positions[n.y] - p, c = mesh.positions[n.z] - p;
    return simplex_places(a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z);
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
    const SimplexPlaces<double> at = places_at(mesh, vertex);
    return at.flat > 0.0 ? glm::dvec3(0.0) : glm::dvec3(at.normal_x, at.normal_y, at.normal_z);
}

double curvature_at(const SimplexMesh& mesh, size_t vertex) {
    const SimplexPlaces<double> at = places_at(mesh, vertex);
    return simplex_curvature(at.height, at.radius, at.aside, at.flat) / at.edge;
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

} // namespace palpate
