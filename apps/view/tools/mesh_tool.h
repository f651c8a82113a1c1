#pragma once

#include "apps/view/tools/tool.h"

namespace palpate::view {

// How the mesh of an object is pulled. The state of its tool, and of a hand that pulls.
struct Pulling {
    uint32_t reach = 3;      // of the patch: faces away from the one that is held
    glm::dvec3 held_mm{0.0}; // where the mesh was taken, by the drag under way or the last one

    friend bool operator==(const Pulling&, const Pulling&) = default;
};

// The tool that pulls the mesh of an object. In 3D a press takes the mesh where the pointer meets
// it, in a slice where it is near; what is held then follows the pointer, across the view or in the
// slice's plane.
extern const Tool kPullTool;

void draw_mesh(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box);

} // namespace palpate::view
