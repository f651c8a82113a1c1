#pragma once

#include "apps/view/document/work.h"

namespace palpate::view {

inline Json json_of(glm::dvec3 v) {
    return {v.x, v.y, v.z};
}

// Adds what the panels show, for Work::dump().
void dump_panels(Work& work, const ViewState& state, Json& json);

} // namespace palpate::view
