#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace palpate::view {

// How the mesh of an object is pulled. A part of ViewState.
struct Pulling {
    uint32_t reach = 3;      // of the patch: faces away from the one that is held
    glm::dvec3 held_mm{0.0}; // where the mesh was taken, by the drag under way or the last one

    friend bool operator==(const Pulling&, const Pulling&) = default;
};

} // namespace palpate::view
