// The bar at the left: a button for each tool, and one for a picture of the window.

#include <imgui/imgui.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "apps/view/drawing/looks.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/tool.h"

namespace palpate::view {

namespace {

// Lengths of the bar, in pixels of the window.
struct BarLengths {
    float side, gap, edge; // of a button; between groups; before the first one
};

// Buttons become smaller where the bar is too short for them.
BarLengths lengths_of(const Box& bar, double text_scale, size_t buttons, size_t gaps) {
    const auto scale = static_cast<float>(text_scale);
    const auto width = static_cast<float>(bar.size_px.x),
               height = static_cast<float>(bar.size_px.y);
    // In whole pixels: sharp.
    BarLengths all{0.0f, std::floor(std::min(9.0f * scale, 0.02f * height)),
                   std::floor(std::min(4.0f * scale, 0.1f * width))};
    const float room = height - 2.0f * all.edge - all.gap * static_cast<float>(gaps);
    all.side = std::floor(std::min(width - 2.0f * all.edge, room / static_cast<float>(buttons)));
    return all;
}

} // namespace

void draw_tool_bar(Widgets& ui, ViewState& state) {
    const Box bar = places_of(state).bar;
    if (bar.size_px.x <= 0)
        return;
    std::vector<const Tool*> shown;
    size_t gaps = 1; // before the picture
    for (const Tool* tool : tools()) {
        if (!tool->title)
            continue;
        gaps += !shown.empty() && shown.back()->group != tool->group;
        shown.push_back(tool);
    }
    const BarLengths lengths = lengths_of(bar, state.text_scale, shown.size() + 1, gaps);
    begin_bar("bar", bar);
    const float left = static_cast<float>(bar.low_px.x) +
                       std::floor(0.5f * (static_cast<float>(bar.size_px.x) - lengths.side));
    float top = static_cast<float>(bar.low_px.y) + lengths.edge;
    const auto line = [&] {
        const float y = std::floor(top + 0.5f * lengths.gap);
        ImGui::GetWindowDrawList()->AddLine({left, y}, {left + lengths.side, y},
                                            ImGui::GetColorU32(ImGuiCol_Separator));
        top += lengths.gap;
    };
    for (size_t i = 0; i < shown.size(); ++i) {
        const Tool& tool = *shown[i];
        if (i > 0 && shown[i - 1]->group != tool.group)
            line();
        std::string title = tool.title;
        title[0] = static_cast<char>(std::toupper(title[0]));
        const std::string tip = fmt::format("{} ({})\n{}", title, key_of(tool), tool.help);
        ImGui::SetCursorScreenPos({left, top});
        if (draw_icon_button(ui,
                             {.id = fmt::format("tool/{}", tool.name),
                              .icon = tool.icon,
                              .letters = title.substr(0, 2),
                              .tip = tip,
                              .side_px = lengths.side,
                              .is_chosen = is_in_hand(state, tool)},
                             state))
            choose_tool(state, tool);
        top += lengths.side;
    }
    line();
    ImGui::SetCursorScreenPos({left, top});
    if (draw_icon_button(ui,
                         {.id = "bar/picture",
                          .icon = Icon::camera,
                          .letters = "Pi",
                          .tip = "Picture of the window (Ctrl+P)\na PNG in the current folder",
                          .side_px = lengths.side},
                         state))
        ui.order(order::TakePicture{});
    ImGui::End();
}

} // namespace palpate::view
