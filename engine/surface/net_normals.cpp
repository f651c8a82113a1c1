#include "engine/surface/net_normals.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numeric>

namespace palpate {

namespace {

constexpr uint32_t kUnseen = ~0u, kSeveral = kUnseen - 1;

glm::vec3 unit_or_none(glm::vec3 v) {
    const float square = glm::dot(v, v);
    return square > 0.0f ? v / std::sqrt(square) : glm::vec3(0.0f);
}

} // namespace

std::vector<glm::vec3> wall_normals(const Mesh& walls, uint32_t rounds) {
    std::vector<uint32_t> all(walls.triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    return wall_normals(walls, rounds, all);
}

std::vector<glm::vec3> wall_normals(const Mesh& walls, uint32_t rounds,
                                    std::span<const uint32_t> triangles) {
    const size_t count = walls.positions.size();
    std::vector<uint32_t> pairs(count, kUnseen); // of the labels about each vertex
    std::vector<glm::vec3> normals(count, glm::vec3(0.0f)), sums;
    for (const uint32_t n : triangles) {
        const glm::uvec3 t = walls.triangles[n];
        const uint32_t pair = uint32_t{walls.labels[n]} | uint32_t{walls.outer_labels[n]} << 16;
        const glm::vec3 a = walls.positions[t.x];
        const glm::vec3 area = glm::cross(walls.positions[t.y] - a, walls.positions[t.z] - a);
        for (int corner = 0; corner < 3; ++corner) {
            uint32_t& known = pairs[t[corner]];
            known = known == kUnseen || known == pair ? pair : kSeveral;
            normals[t[corner]] += area;
        }
    }
    const auto to_unit = [&](const std::vector<glm::vec3>& from) {
        tbb::parallel_for(size_t{0}, count, [&](size_t v) {
            normals[v] = pairs[v] == kSeveral ? glm::vec3(0.0f) : unit_or_none(from[v]);
        });
    };
    to_unit(normals);
    for (uint32_t round = 0; round < rounds; ++round) {
        sums = normals;
        for (const uint32_t n : triangles) {
            const glm::uvec3 t = walls.triangles[n];
            for (int corner = 0; corner < 3; ++corner)
                sums[t[corner]] += normals[t[(corner + 1) % 3]] + normals[t[(corner + 2) % 3]];
        }
        to_unit(sums);
    }
    return normals;
}

} // namespace palpate
