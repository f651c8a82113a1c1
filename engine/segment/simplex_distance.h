#pragma once

#include <array>
#include <glm/glm.hpp>

#include "engine/volume/grid.h"

namespace palpate {

// The distance u at a sample from those of its face neighbours, on any grid: |grad u| = 1, where
// the gradient is that of the plane through the values on a simplex of the sample and a neighbour
// on each of up to three axes. With the edges e_i of the simplex in mm and G_ij = e_i . e_j,
//     sum over i, j of (u - v_i) (G^-1)_ij (u - v_j) = 1,
// which on upright grids is sum of ((u - v_i) / h_i)^2 = 1 (Sethian & Vladimirsky, Fast methods for
// the Eikonal and related Hamilton-Jacobi equations on unstructured meshes, PNAS 2000).
class SimplexDistance {
 public:
    explicit SimplexDistance(const Grid& grid);

    struct Neighbour {
        float value = 0.0f;
        int side = 0; // of the axis: low (-1), high (1), or none (0)
    };
    // The least u whose way to the surface leads through the simplex of all neighbours, else
    // through one of its faces or edges; and where that way meets it, as the neighbours' shares,
    // whose sum is 1. At least one neighbour.
    struct Solution {
        float u;
        glm::vec3 shares;
    };
    Solution solve(const std::array<Neighbour, 3>& axes) const;

    // G^-1 of a simplex with the high neighbours on the axes whose bits are set; 0 on others.
    const glm::mat3& inverse(unsigned axes) const { return inverse_[axes][0]; }

    // The least of solve() from values of 0, whichever neighbours there are.
    float least() const { return least_; }

 private:
    // By the axes that take part (bits) and those of them whose neighbour is on the low side.
    std::array<std::array<glm::mat3, 8>, 8> inverse_;
    float least_;
};

} // namespace palpate
