#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace palpate {
class Shape;
}

namespace palpate::haptics {

// A tool as a point shell, in tool space: the points that swept-tool moves through a volume.
struct ToolPoints {
    std::vector<glm::dvec3> points_mm; // at most 4096 are used
};

// About `count` points spread evenly on the surface of any implicit tool: the middles of the cells
// of a lattice that the surface cuts, moved onto it along its gradient. The lattice is halved until
// it has at least `count` cells and then thinned. Not for the servo thread.
ToolPoints sample_tool(const Shape& shape, uint32_t count);

} // namespace palpate::haptics
