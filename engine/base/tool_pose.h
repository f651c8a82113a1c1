#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace palpate {

// The pose in the world of a tool that a hand holds: the same for tools that touch (haptics) and
// tools that cut (engine/edit).
struct ToolPose {
    glm::dvec3 position_mm{0.0};             // of the tool's origin
    glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; // world_from_tool, unit length; (w, x, y, z)

    friend bool operator==(const ToolPose&, const ToolPose&) = default;
};

} // namespace palpate
