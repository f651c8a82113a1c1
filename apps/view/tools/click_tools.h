#pragma once

#include <memory>

#include "apps/view/document/label_changes.h"
#include "apps/view/tools/tool.h"
#include "engine/segment/click_region.h"

namespace palpate::view {

// The settings of the tools, and the click that would be made under the
// pointer. A state of theirs.
struct Clicking {
    double reach_mm = 30.0, times = 3.0; // LocalThreshold's
    std::optional<RegionClick> under{};  // none: the pointer is in no slice along the samples
    bool is_outlined = true;             // false: it would take too long at each move
    RegionClick clicked{};               // the last one that was asked for

    friend bool operator==(const Clicking&, const Clicking&) = default;
};

class RegionPreview;

// The tools found it last. No part of the value: states that differ in it are equal.
struct Previewing {
    std::shared_ptr<RegionPreview> preview{}; // from the first move on

    friend bool operator==(const Previewing&, const Previewing&) { return true; }
};

// Tools that give samples the label that is drawn: those about the pointer that
// are alike, or those within the contour of one grey value through it, in one
// slice. What a click would take is drawn over the slices as the pointer moves.
// A click asks for it with order::ChangeLabel of one of these changes, by
// Clicking::clicked.
extern const LabelChange kLocalChange, kTraceChange;
extern const Tool kLocalThresholdTool, kLevelTraceTool;

bool takes_regions(const Tool& tool); // one of the two

void draw_region(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box);

} // namespace palpate::view
