#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace palpate::haptics {

// A place on a tool: one of its samples or, on a ball, the direction of any.
struct Touch {
    uint32_t sample = 0; // below the number of the tool's
    glm::dvec3 way{0.0}; // unit length, world axes; 0 where the tool is no ball
};

// What holds a tool there: a plane.
struct Hold {
    Touch touch;
    glm::dvec3 normal{0.0};    // unit length, out of the material
    double clearance_mm = 0.0; // negative: in material
    double seen_mm = 0.0;    // of a contact's place itself, before a ball turns to face the surface
    double confidence = 1.0; // 0 .. 1
};

} // namespace palpate::haptics
