#pragma once

#include <vector>

#include "apps/view/document/label_changes.h"
#include "apps/view/tools/tool.h"
#include "engine/segment/scissors.h"

namespace palpate::view {

// How deep scissors cut.
enum class CutDepth { all, slab, seen_first };

// What scissors do, and the outline that is being drawn. A state of their tool.
struct Cutting {
    ScissorsAction action = ScissorsAction::erase_inside;
    CutDepth depth = CutDepth::all;
    double slab_mm = 10.0; // CutDepth::slab: about the slice, in 3D about the crosshair
    bool all_labels = false;
    std::vector<glm::dvec2> drawn_px{}; // of the window
    Scissors cut{};                     // the last one that was asked for

    friend bool operator==(const Cutting&, const Cutting&) = default;
};

// The scissors. A drag draws an outline by hand in a slice or over the 3D view;
// where it is let go it is closed, and order::ChangeLabel asks for one of these
// changes by Cutting::cut. A slice is looked at along its normal, the 3D view
// from its camera.
extern const LabelChange kEraseByScissors, kFillByScissors;
extern const Tool kScissorsTool;

void draw_scissors(ImDrawList& list, const ViewState& state, Work& work, Panel panel,
                   const Box& box);

} // namespace palpate::view
