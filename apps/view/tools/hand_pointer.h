#pragma once

#include "apps/view/window/state.h"

namespace palpate::view {

// The pointer as a hand, while Stylus::by_pointer. Pure, as interaction.h.
//
//     move           the hand goes where the pointer is: on a slice's plane, in 3D on its plane
//     wheel in 3D    deeper (away from the person) or nearer, by a sample
//     left, right    buttons 0 and 1; left over a widget in 3D presses it
//     middle in 3D   rotates; Shift: pans

// The hand goes to the pointer. In 3D the depth is that of what is seen there. While a button of
// the hand is pressed, it is that of what was seen there before (Subject::pick), so that a tool
// does not follow its own hole; and it does not jump, as over an opening.
void point_hand(ViewState& state, const Subject& subject);
// A hand that begins: at the pointer, or else before the volume, where nothing is touched.
void begin_hand(ViewState& state, const Subject& subject);
// A ball is felt a sample smaller than it cuts: else the felt surface keeps the tool away.
double felt_radius_mm(double radius_mm, const Grid& grid);

// Whether the tool of the hand (the proxy) is where the hand is, as one sees it in 3D: not beside
// it, held by what lies between. A tool that is pressed there would bore its way to the hand. In
// depth it may be away, as where one pushes. Always, where the pointer is in no 3D view.
bool is_tool_with_hand(const Stylus& stylus, double radius_mm, glm::dvec3 hand_mm,
                       glm::dvec3 tool_mm);

// False: the event is not the hand's.
bool press_hand(ViewState& state, const Event& event, const Subject& subject, bool in_view);
bool wheel_hand(ViewState& state, const Event& event, const Subject& subject);

} // namespace palpate::view
