#pragma once

#include "apps/palpate/view/interaction.h"

namespace palpate::view {

// The tool that pulls the mesh of an object: what a drag of the left button does. Pure, as after()
// is. In 3D a press takes the mesh where the pointer meets it, in a slice where it is near; what is
// held then follows the pointer, across the view or in the slice's plane.

// False: no mesh is there.
bool press_mesh(Outcome& next, const Event& event, const Subject& subject, Panel panel);
void drag_mesh(Outcome& next, const Event& event, const Subject& subject, Panel panel);

} // namespace palpate::view
