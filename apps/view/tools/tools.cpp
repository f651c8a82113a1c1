// The table of tools.

#include <cctype>

#include "apps/view/tools/click_tools.h"
#include "apps/view/tools/measure_tool.h"
#include "apps/view/tools/mesh_tool.h"
#include "apps/view/tools/pick_tool.h"
#include "apps/view/tools/scissors_tool.h"
#include "apps/view/tools/tool.h"
#include "apps/view/tools/wire_tool.h"

namespace palpate::view {

std::span<const Tool* const> tools() {
    static constexpr const Tool* all[] = {
        &kCrosshairTool,  &kPickTool, &kDrawTool, &kEraseTool, &kScissorsTool, &kLocalThresholdTool,
        &kLevelTraceTool, &kWireTool, &kSeedTool, &kCutTool,   &kPullTool,     &kMeasureTool};
    return all;
}

std::string key_of(const Tool& tool) {
    return {static_cast<char>(std::toupper(tool.key[0]))};
}

void choose_tool(ViewState& state, const Tool& tool) {
    state.tool = &tool;
    if (tool.first_button)
        state.stylus.first = *tool.first_button;
    state.hand_put_down =
        state.stylus.by_pointer && tool.first_button.value_or(Carve::nothing) == Carve::nothing;
}

bool is_in_hand(const ViewState& state, const Tool& tool) {
    return state.stylus.by_pointer ? tool.first_button == state.stylus.first : state.tool == &tool;
}

bool take_tool(ViewState& state, const std::string& key) {
    for (const Tool* tool : tools()) {
        if (!tool->key || key != tool->key)
            continue;
        if (tool->take)
            tool->take(state, state.tool == tool);
        choose_tool(state, *tool);
        return true;
    }
    return false;
}

} // namespace palpate::view
