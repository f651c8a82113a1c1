#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace palpate::haptics {

// A place on a tool: one of its samples or, on a ball, the direction of any.
struct Touch {
    uint32_t sample = 0; // below the number of the tool's
    glm::dvec3 way{0.0}; // unit length, world axes; 0 where the tool is no ball
    // Of a ball's: what it had to turn by, when last looked at, to face the surface, and the share
    // of that which it turned by; 0 where it was not looked at.
    glm::dvec3 turned{0.0};
    double turn_share = 0.0;
};

// A contact constraint of a tool: a plane.
struct Hold {
    Touch touch;
    glm::dvec3 normal{0.0};    // unit length, out of the material
    double clearance_mm = 0.0; // negative: in material
    double seen_mm = 0.0;      // the same before a ball turned its place to face the surface
    double confidence = 1.0;   // 0 .. 1
    bool is_pushed = false;    // where the hand pushes a ball on grey values, for this look
};

} // namespace palpate::haptics
