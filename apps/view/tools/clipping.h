#pragma once

#include <optional>
#include <vector>

#include "engine/scene/scene.h"

namespace palpate::view {

// The clip planes of the 3D view, and what a hand does with them. A part of ViewState.
struct Clipping {
    std::vector<ClipPlane> planes; // at most kMaxClipPlanes; normals of unit length
    std::optional<size_t> selected;
    std::optional<size_t> held; // a plane that a drag moves
    bool turns = false;         // or turns
    glm::dvec3 held_mm{0.0};    // where its handle was

    friend bool operator==(const Clipping&, const Clipping&) = default;
};

} // namespace palpate::view
