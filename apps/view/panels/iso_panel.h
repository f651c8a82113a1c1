#pragma once

#include "apps/view/panels/panels.h"

namespace palpate::view {

// The list of iso-surfaces of the 3D view, and the buttons that fill it. Its changes are seen at
// once, in mode iso.
void draw_iso_panel(Widgets& ui, ViewState& state, Work& work);

} // namespace palpate::view
