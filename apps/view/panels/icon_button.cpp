// A square button with an icon, of the bars.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/looks.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

bool draw_icon_button(Widgets& ui, const IconButton& button, const ViewState& state) {
    constexpr float kMostShare = 0.8f; // of the side
    const Theme& theme = theme_of(state.light);
    const float side = button.side_px;
    const ImVec2 low = ImGui::GetCursorScreenPos(), high(low.x + side, low.y + side);
    const bool pressed = ImGui::InvisibleButton(button.id.c_str(), {side, side});
    ui.note(button.id);
    const bool is_under = ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    if (button.is_chosen || (is_under && button.is_possible))
        list.AddRectFilled(
            low, high, ImGui::GetColorU32(rgb_color(button.is_chosen ? theme.accent : theme.line)),
            ImGui::GetStyle().FrameRounding);
    const ImVec4 color = !button.is_possible ? rgb_color(theme.hint, 0.5f)
                                             : rgb_color(button.is_chosen  ? theme.on_accent
                                                         : button.is_faint ? theme.hint
                                                                           : theme.text);
    const ImVec2 middle(0.5f * (low.x + high.x), 0.5f * (low.y + high.y));
    const float size = std::round(
        std::min(button.icon_px * static_cast<float>(state.text_scale), kMostShare * side));
    if (!draw_icon(list, middle, size, button.icon, ImGui::GetColorU32(color))) {
        const ImVec2 text = ImGui::CalcTextSize(button.letters.c_str());
        list.AddText({std::round(middle.x - 0.5f * text.x), std::round(middle.y - 0.5f * text.y)},
                     ImGui::GetColorU32(color), button.letters.c_str());
    }
    if (is_under)
        ImGui::SetTooltip("%s", button.tip.c_str());
    return pressed && button.is_possible;
}

} // namespace palpate::view
