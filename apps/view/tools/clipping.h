#pragma once

#include <optional>
#include <vector>

#include "engine/scene/scene.h"

namespace palpate::view {

// A hand's work with the clip planes of the 3D view (Notes::clip_planes, at most
// kMaxClipPlanes). A part of ViewState.
struct Clipping {
    std::optional<size_t> selected;
    std::optional<size_t> held; // a plane that a drag moves
    bool turns = false;         // or turns
    glm::dvec3 held_mm{0.0};    // where its handle was

    friend bool operator==(const Clipping&, const Clipping&) = default;
};

} // namespace palpate::view
