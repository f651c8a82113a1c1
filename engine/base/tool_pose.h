#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace palpate {

// Where a hand holds a tool, in the world: the same for what touches (haptics) and for what cuts
// (engine/edit).
struct ToolPose {
    glm::dvec3 position_mm{0.0};             // of the tool's origin
    glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; // world_from_tool, unit length; (w, x, y, z)

    friend bool operator==(const ToolPose&, const ToolPose&) = default;
};

} // namespace palpate
