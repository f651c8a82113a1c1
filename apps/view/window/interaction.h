#pragma once

#include <vector>

#include "apps/view/document/order.h"
#include "apps/view/window/state.h"

namespace palpate::view {

// The state after an input, and what else the input asks for. Pure: the same arguments give the
// same result. Events for widgets change the pointer, the keys that are held, and nothing else.
//
//             left                       middle  right  wheel
//     slices  tool; W: window            pan     zoom   next slice; Ctrl: zoom
//     3D      rotate; Shift: pan;        pan     zoom   zoom
//             Ctrl: roll
//
// Shift and a move without button set the crosshair everywhere. A double click maximises a view,
// where the left button draws nothing. While the mouse is a hand: hand_pointer.h.
struct Outcome {
    ViewState state;
    std::vector<Order> orders{};
};
Outcome after(ViewState state, const Event& event, const Subject& subject);

// A plane can be turned in a slice's view by handles: on the lines of the other two, this far from
// the crosshair, as a share of the shorter side.
constexpr double kHandle_share = 0.38, kHandle_px = 7.0;
struct Handle {
    Panel plane; // the one whose line it lies on
    glm::dvec2 at_px;
};
std::vector<Handle> handles_of(const ViewState& state, const Grid& grid, Panel panel);

// The direction in which a panel shows another slice's line, in pixels (y down), of unit length.
glm::dvec2 line_of(const ViewState& state, Panel panel, Panel other);

} // namespace palpate::view
