#pragma once

#include <optional>
#include <vector>

#include "engine/measure/measure.h"

namespace palpate::view {

// The state of the tool that makes measures (Notes::measures). A part of ViewState.
struct Measuring {
    MeasureKind kind = MeasureKind::ruler; // that is placed next
    std::vector<glm::dvec3> begun;         // points of the one that is being placed
    glm::dvec3 normal{0.0};                // of the plane in which a polygon is placed
    std::optional<size_t> selected;
    std::optional<size_t> held; // the point of the selected one that a drag moves

    friend bool operator==(const Measuring&, const Measuring&) = default;
};

} // namespace palpate::view
