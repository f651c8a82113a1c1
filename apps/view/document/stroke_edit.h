#pragma once

#include <optional>

#include "apps/view/document/hand_tool.h"
#include "apps/view/document/open_document.h"

namespace palpate::view {

// Seeds are labels, 1 .. kLastSeeded, but for kOutsideSeed, the seed of what is no object: label
// 255 itself is kSeedOf255 there.
constexpr uint16_t kOutsideSeed = 255, kSeedOf255 = 65535, kLastSeeded = 65534;

// The edit that strokes of a tool make, as a state wants it. An operation on labels changes those,
// and at the values, that a person lets it change. Without an edit a seed is of no label, which a
// person is told, or there is no map of seeds yet.
// disc: a brush on labels is a disc about its origin, across the tool's z axis, thinner than a
// layer.
std::optional<EditSetup> stroke_edit(OpenDocument& document, Carve carve, TipShape shape,
                                     const ViewState& state, bool disc = false);

} // namespace palpate::view
