// The section of the brush: how large it is, which label it draws, and where.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/tool.h"

namespace palpate::view {

namespace {

// The values that tools on labels are confined to: at first those of the window.
void draw_only_values(Widgets& ui, WindowEnds& ends, ViewState& state, Work& work) {
    bool only = state.only_values.has_value();
    if (ImGui::Checkbox("only where values are", &only))
        state.only_values = only ? std::optional(state.window) : std::nullopt;
    ui.note("labels/only");
    if (!state.only_values)
        return;
    const ValueRange range = work.subject().range;
    const double low = range.min, high = std::max(low + 1e-3, double{range.max});
    drag_ends(ui, ends, "labels", {"from", "to"}, *state.only_values, 0.0, {low, high}, work);
}

} // namespace

void draw_brush_section(Widgets& ui, WindowEnds& ends, ViewState& state, Work& work) {
    if (state.tool->kind) {
        ImGui::TextDisabled("%s: %s", state.tool->title, state.tool->kind(state).c_str());
        ui.note("tool/kind");
    }
    ui.check("disc in the slice", "tool/disc", state.brush_is_disc);
    slide("radius", state.radius_mm, 0.1, 100.0, "%.3g mm", true);
    ui.note("tool/radius");
    int label = state.label;
    if (ImGui::InputInt(named("label").c_str(), &label))
        state.label = static_cast<uint16_t>(std::clamp(label, 1, 65535));
    ui.note("tool/label");
    draw_only_values(ui, ends, state, work);
}

} // namespace palpate::view
