#pragma once

#include "haptics/field/touch_scene.h"

namespace palpate {
class Shape;
}

namespace palpate::haptics {

// About `count` points spread evenly on the surface of any implicit tool: the middles of the cells
// of a lattice that the surface cuts, moved onto it along its gradient. The lattice is halved until
// it has at least `count` cells and then thinned. Not for the servo thread.
ToolPoints sample_tool(const Shape& shape, uint32_t count);

} // namespace palpate::haptics
