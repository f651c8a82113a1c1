#pragma once

#include "apps/view/document/work.h"

namespace palpate::view {

// Everything that a test or a report of a fault wants to know of a window. Strokes under way are
// in it.
Json dump_of(Work& work, const ViewState& state);

} // namespace palpate::view
