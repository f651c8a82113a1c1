#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace palpate::haptics {

// Free where dot(normal, p) >= offset; normal has unit length.
struct Plane {
    glm::dvec3 normal{0.0};
    double offset = 0.0;
};

struct Projection {
    glm::dvec3 point{0.0};
    bool is_feasible = true;   // else the planes have no point in common, and point is the goal's
                               // nearest to those that do
    uint32_t active_count = 0; // at most 3
    std::array<uint32_t, 3> active{};
};

// The point nearest to `goal` that every plane leaves free: the quadratic program
//     minimise |p - goal|^2 subject to dot(n_i, p) >= o_i
// in three unknowns, where at most three planes hold the answer. A dual active set: the plane that
// is broken most joins the active ones, and the best subset of these (at most four) that holds it
// is found by trying all. Each step is farther from the goal than the one before, so it ends; it is
// cut off after 4 x planes + 8 steps. Planes to within 1e-9 mm.
Projection project_to_planes(glm::dvec3 goal, std::span<const Plane> planes);

} // namespace palpate::haptics
