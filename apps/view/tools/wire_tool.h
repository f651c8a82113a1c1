#pragma once

#include <span>

#include "apps/view/tools/tool.h"

namespace palpate::view {

// A contour that is drawn along edges in one slice of samples. A state of its tool.
struct Wiring {
    int axis = 0; // of the grid, across which the slice lies
    // Samples of the contour, each a neighbour of the one before: those that clicks have frozen,
    // from the first click on, and from the last of them to the pointer, both included.
    std::vector<glm::uvec3> frozen{}, live{};    // frozen is empty: none is begun
    std::vector<glm::uvec3> closed{};            // the last one that was closed
    bool begun_by_press = false, traced = false; // by the press that is down; and dragged since

    friend bool operator==(const Wiring&, const Wiring&) = default;
};

// The live-wire tool. In a slice along the samples a click begins a contour; from there the path of
// least cost (Subject::path) follows the pointer, and each click freezes it. Enter, a double click
// or a click on the first sample closes the contour by one more path, and order::FillWire
// asks for its inside. A contour stays in the slice in which it was begun. A drag traces by hand:
// one that began the contour closes it where it is let go.

extern const Tool kWireTool;

// The axis of the grid across which a slice lies; none where it is oblique to the samples.
std::optional<int> axis_across(const Grid& grid, const SliceView& slice);

// Whether a panel shows the slice of the contour that is begun.
bool shows_wire(const ViewState& state, const Grid& grid, Panel panel);

void draw_wire(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box);

// The samples of a closed contour and those within it, in order of memory. Within is what a line
// along the slice enters from outside an odd number of times.
std::vector<glm::uvec3> filled(std::span<const glm::uvec3> contour, int axis);

} // namespace palpate::view
