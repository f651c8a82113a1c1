#pragma once

#include <span>
#include <string_view>

#include "apps/view/window/state.h"

// Widgets are described once: the tooltip over a widget and a line of the search box are
// made from the table (tests/view/search_test.cpp compares it with the panels).
namespace palpate::view {

struct WidgetHelp {
    const char* id;     // "slices/thickness"
    const char* title;  // words that stand alone: "thickness of slices"
    const char* help;   // what it does, its unit, and what more of it does
    const char* also;   // other words by which people look for it
    bool always = true; // false: it is there at times only, and is not offered by the search box
};

std::span<const WidgetHelp> widget_help();      // in the order of the panels
const WidgetHelp* help_of(std::string_view id); // null: none

// Opens the panel that has a widget.
void open_panel_of(ViewState& state, std::string_view id);

} // namespace palpate::view
