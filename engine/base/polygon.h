#pragma once

#include <glm/glm.hpp>
#include <span>

namespace palpate {

// Whether a line from a point towards +x crosses an edge. An edge has its lower end and not its
// upper one, so that a corner counts once.
inline bool crosses(glm::dvec2 a, glm::dvec2 b, glm::dvec2 point) {
    return (a.y > point.y) != (b.y > point.y) &&
           point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x);
}

// Whether a point lies within a closed polygon: even-odd, and of two polygons which share an edge
// one has a point on it.
inline bool contains(std::span<const glm::dvec2> polygon, glm::dvec2 point) {
    bool inside = false;
    for (size_t i = 0; i < polygon.size(); ++i)
        inside ^= crosses(polygon[i], polygon[(i + 1) % polygon.size()], point);
    return inside;
}

} // namespace palpate
