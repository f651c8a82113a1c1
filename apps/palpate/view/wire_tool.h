#pragma once

#include <span>

#include "apps/palpate/view/interaction.h"

namespace palpate::view {

// The live-wire tool: what the left button and keys do while it is in the hand. Pure, as after()
// is.
//
// In a slice along the samples a click begins a contour; from there the path of least cost
// (Subject::path) follows the pointer, and each click freezes it. Enter, a double click or a click
// on the first sample closes the contour by one more path, and Order::Kind::fill_wire asks for its
// inside. A contour stays in the slice in which it was begun.

// The axis of the grid across which a slice lies; none where it is oblique to the samples.
std::optional<int> axis_across(const Grid& grid, const SliceView& slice);

// Whether a panel shows the slice of the contour that is begun.
bool shows_wire(const ViewState& state, const Grid& grid, Panel panel);

// A press of the left button in a slice. `twice`: of a double click.
void press_wire(Outcome& next, const Event& event, const Subject& subject, Panel panel, bool twice);
// The pointer has moved.
void follow_wire(ViewState& state, const Subject& subject);
// False: none was begun.
bool cancel_wire(ViewState& state);
// U, Enter. False: the key is another's.
bool press_wire_key(Outcome& next, const Event& event, const Subject& subject);

// The samples of a closed contour and those within it, in order of memory. Within is what a line
// along the slice enters from outside an odd number of times.
std::vector<glm::uvec3> filled(std::span<const glm::uvec3> contour, int axis);

} // namespace palpate::view
