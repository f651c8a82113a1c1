#pragma once

#include "apps/palpate/view/interaction.h"

namespace palpate::view {

// What a key does (key_help()), when it is pressed or let go.
void use_key(Outcome& next, const Event& event, const Subject& subject);

// The crosshair goes so many layers of samples away from the eye of a slice.
void page(ViewState& state, const Grid& grid, Panel panel, double layers);

} // namespace palpate::view
