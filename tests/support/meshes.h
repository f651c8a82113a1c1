#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "engine/mesh/mesh.h"

// Meshes with a known answer, for tests.
namespace palpate::meshes {

inline Mesh tetrahedron(glm::vec3 corner = {}) {
    return {.positions = {corner, corner + glm::vec3(1, 0, 0), corner + glm::vec3(0, 1, 0),
                          corner + glm::vec3(0, 0, 1)},
            .triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

// An octahedron of which each triangle is cut in four, `levels` times, corners put on the sphere:
// 8 * 4^levels triangles.
inline Mesh ball(double radius_mm, int levels, glm::dvec3 center = {}) {
    std::vector<glm::dvec3> points{{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                   {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    Mesh mesh{.triangles = {{0, 2, 4},
                            {2, 1, 4},
                            {1, 3, 4},
                            {3, 0, 4},
                            {2, 0, 5},
                            {1, 2, 5},
                            {3, 1, 5},
                            {0, 3, 5}}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        const auto middle = [&](uint32_t a, uint32_t b) {
            const auto [at, is_new] =
                middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(points.size()));
            if (is_new)
                points.push_back(glm::normalize(points[a] + points[b]));
            return at->second;
        };
        std::vector<glm::uvec3> finer;
        for (const glm::uvec3 t : mesh.triangles) {
            const uint32_t a = middle(t.x, t.y), b = middle(t.y, t.z), c = middle(t.z, t.x);
            for (const glm::uvec3 part : {glm::uvec3(t.x, a, c), glm::uvec3(a, t.y, b),
                                          glm::uvec3(c, b, t.z), glm::uvec3(a, b, c)})
                finer.push_back(part);
        }
        mesh.triangles = std::move(finer);
    }
    for (const glm::dvec3 p : points)
        mesh.positions.emplace_back(center + radius_mm * p);
    return mesh;
}

// A grid of m x n quads that closes both ways: vertex (i, j) is number i + m j.
inline Mesh torus(uint32_t m, uint32_t n, double ring_mm, double tube_mm) {
    Mesh mesh;
    const double turn = 2.0 * std::numbers::pi;
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < m; ++i) {
            const double u = turn * i / m, v = turn * j / n;
            const double r = ring_mm + tube_mm * std::cos(v);
            mesh.positions.emplace_back(r * std::cos(u), r * std::sin(u), tube_mm * std::sin(v));
        }
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < m; ++i) {
            const uint32_t a = i + m * j, b = (i + 1) % m + m * j;
            const uint32_t c = i + m * ((j + 1) % n), d = (i + 1) % m + m * ((j + 1) % n);
            mesh.triangles.emplace_back(a, b, d);
            mesh.triangles.emplace_back(a, d, c);
        }
    return mesh;
}

// Both in one mesh, vertices apart.
inline Mesh beside(Mesh a, const Mesh& b) {
    const auto offset = static_cast<uint32_t>(a.positions.size());
    a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
    for (const glm::uvec3 t : b.triangles)
        a.triangles.push_back(t + offset);
    return a;
}

inline Mesh turned_over(Mesh mesh) {
    for (glm::uvec3& t : mesh.triangles)
        std::swap(t.y, t.z);
    return mesh;
}

} // namespace palpate::meshes
