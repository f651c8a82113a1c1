// The section of the brush: how large it is, and which label it draws.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/tool.h"

namespace palpate::view {

void draw_brush_section(Widgets& ui, ViewState& state) {
    if (state.tool->kind) {
        ImGui::TextDisabled("%s: %s", state.tool->title, state.tool->kind(state).c_str());
        ui.note("tool/kind");
    }
    ui.check("disc in the slice", "tool/disc", state.brush_is_disc);
    ui.check("keep to edges", "tool/edges", state.brush_keeps_to_edges);
    if (state.brush_keeps_to_edges) {
        slide("alike within", state.alike_deviations, 0.5, 20.0, "%.3g dev.", true);
        ui.note("tool/alike");
    }
    slide("radius", state.radius_mm, 0.1, 100.0, "%.3g mm", true);
    ui.note("tool/radius");
    int label = state.label;
    if (ImGui::InputInt(named("label").c_str(), &label))
        state.label = static_cast<uint16_t>(std::clamp(label, 1, 65535));
    ui.note("tool/label");
}

} // namespace palpate::view
