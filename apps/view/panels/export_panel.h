#pragma once

#include "apps/view/panels/panels.h"

namespace palpate::view {

// A surface for print: what of, how it is made, and a file's name; while one is made, how far it
// is.
void draw_export_panel(Widgets& ui, TypedText& file, ViewState& state, Work& work);

// The name that is proposed: of the surface that is chosen, "bone.stl".
std::string surface_file_name(const ExportSetup& setup, const ViewState& state, Work& work);

} // namespace palpate::view
