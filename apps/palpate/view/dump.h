#pragma once

#include "apps/palpate/view/work.h"

namespace palpate::view {

// What the panels show, for Work::dump().
void dump_panels(Work& work, const ViewState& state, Json& json);

} // namespace palpate::view
