#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace palpate::view {

// A contour that is drawn along edges in one slice of samples. A part of ViewState.
struct Wiring {
    int axis = 0; // of the grid, across which the slice lies
    // Samples of the contour, each a neighbour of the one before: those that clicks have frozen,
    // from the first click on, and from the last of them to the pointer, both included.
    std::vector<glm::uvec3> frozen{}, live{}; // frozen is empty: none is begun
    std::vector<glm::uvec3> closed{};         // the last one that was closed

    friend bool operator==(const Wiring&, const Wiring&) = default;
};

} // namespace palpate::view
