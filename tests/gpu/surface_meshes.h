#pragma once

#include <cmath>
#include <memory>
#include <numbers>

#include "engine/mesh/mesh.h"

namespace palpate::testing_meshes {

// A closed surface over a grid of `across` x `down` places that meets itself on all sides; point
// and normal by angles from 0 to 2 pi.
template <class Place>
Mesh wrapped(uint32_t across, uint32_t down, const Place& place) {
    Mesh mesh;
    const double turn = 2.0 * std::numbers::pi;
    for (uint32_t j = 0; j < down; ++j)
        for (uint32_t i = 0; i < across; ++i) {
            const auto [point, normal] = place(turn * i / across, turn * j / down);
            mesh.positions.push_back(point);
            mesh.normals.push_back(normal);
            const uint32_t right = (i + 1) % across, below = (j + 1) % down;
            const uint32_t a = j * across + i, b = j * across + right;
            const uint32_t c = below * across + i, d = below * across + right;
            mesh.triangles.push_back({a, b, d});
            mesh.triangles.push_back({a, d, c});
        }
    return mesh;
}

// A torus about the z axis.
inline Mesh torus_mesh(glm::dvec3 center, double radius_mm, double tube_mm, uint32_t across = 48,
                       uint32_t down = 24) {
    return wrapped(across, down, [&](double u, double v) {
        const glm::dvec3 out(std::cos(u), std::sin(u), 0.0);
        const glm::dvec3 normal = std::cos(v) * out + glm::dvec3(0.0, 0.0, std::sin(v));
        return std::pair(glm::vec3(center + radius_mm * out + tube_mm * normal), glm::vec3(normal));
    });
}

// The six faces of a box, each of `parts` x `parts` squares, without normals.
inline Mesh box(glm::dvec3 low, glm::dvec3 high, uint32_t parts = 1) {
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            const auto first = static_cast<uint32_t>(mesh.positions.size());
            for (uint32_t j = 0; j <= parts; ++j)
                for (uint32_t i = 0; i <= parts; ++i) {
                    glm::dvec3 at(0.0);
                    at[axis] = side;
                    at[u] = static_cast<double>(i) / parts;
                    at[v] = static_cast<double>(j) / parts;
                    mesh.positions.emplace_back(glm::mix(low, high, at));
                }
            for (uint32_t j = 0; j < parts; ++j)
                for (uint32_t i = 0; i < parts; ++i) {
                    const uint32_t a = first + j * (parts + 1) + i, b = a + 1;
                    const uint32_t c = a + parts + 1, d = c + 1;
                    mesh.triangles.push_back(side ? glm::uvec3(a, b, d) : glm::uvec3(a, d, b));
                    mesh.triangles.push_back(side ? glm::uvec3(a, d, c) : glm::uvec3(a, c, d));
                }
        }
    return mesh;
}

inline void append(Mesh& mesh, const Mesh& more, uint16_t label) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
    for (const glm::uvec3 t : more.triangles) {
        mesh.triangles.push_back(t + first);
        mesh.labels.push_back(label);
    }
}

inline std::shared_ptr<const Mesh> shared(Mesh mesh) {
    return std::make_shared<const Mesh>(std::move(mesh));
}

} // namespace palpate::testing_meshes
