#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace palpate::haptics {

// A mesh's own axes made perpendicular and of unit length. Nearest points, slides and normals are
// found in it: in mesh space itself, lengths and angles are those of the world only where a grid is
// not sheared (gantry tilt) and nothing is scaled.
struct RigidSpace {
    glm::dmat3 from_mesh{1.0};        // exactly the identity where mesh space is rigid already
    glm::dmat4 world_from_rigid{1.0}; // keeps lengths
    glm::dmat3 normal_from_mesh{1.0}; // normals are covectors: the inverse transpose of from_mesh
    bool is_mesh_space = true;        // from_mesh is the identity

    // The largest box about the middle of one in mesh space with the same proportions, of which
    // every point lies in that: by what share its sides are shorter. 1 without shear.
    double inner_share(glm::dvec3 half) const {
        const glm::dmat3 mesh_from = glm::inverse(from_mesh);
        double share = 1.0;
        for (int row = 0; row < 3; ++row) {
            double reach = 0.0;
            for (int column = 0; column < 3; ++column)
                reach += std::abs(mesh_from[column][row]) * half[column];
            share = std::min(share, half[row] / reach);
        }
        return share;
    }
};

// By Gram-Schmidt: world_from_mesh, invertible, is a rotation (and a mirroring) times an upper
// triangle, which is from_mesh.
inline RigidSpace rigid_space(const glm::dmat4& world_from_mesh) {
    const glm::dmat3 m(world_from_mesh);
    const glm::dvec3 x = glm::normalize(m[0]);
    const glm::dvec3 y = glm::normalize(m[1] - glm::dot(m[1], x) * x);
    const glm::dvec3 z =
        glm::dot(glm::cross(x, y), m[2]) < 0.0 ? -glm::cross(x, y) : glm::cross(x, y);
    const glm::dmat3 turn(x, y, z), from_mesh = glm::transpose(turn) * m;
    double off = 0.0;
    for (int i = 0; i < 9; ++i)
        off = std::max(off, std::abs(from_mesh[i / 3][i % 3] - (i / 3 == i % 3 ? 1.0 : 0.0)));
    RigidSpace space{.world_from_rigid = world_from_mesh};
    if (off < 1e-6) // headers round directions to as many digits
        return space;
    space.is_mesh_space = false;
    space.from_mesh = from_mesh;
    space.normal_from_mesh = glm::transpose(glm::inverse(from_mesh));
    space.world_from_rigid = glm::dmat4(turn);
    space.world_from_rigid[3] = world_from_mesh[3];
    return space;
}

} // namespace palpate::haptics
