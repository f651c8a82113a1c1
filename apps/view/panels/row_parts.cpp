// Parts of the rows of lists: switches, swatches, names.

#include <imgui/imgui.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

bool draw_row_switch(Widgets& ui, const std::string& id, RowSwitch what,
                     std::array<const char*, 2> tips, bool& is_on, const ViewState& state) {
    const bool is_eye = what == RowSwitch::shown;
    const bool pressed = draw_icon_button(ui,
                                          {.id = id,
                                           .icon = is_eye ? (is_on ? Icon::eye : Icon::eye_off)
                                                          : (is_on ? Icon::lock : Icon::lock_open),
                                           .letters = !is_on   ? "-"
                                                      : is_eye ? "o"
                                                               : "L",
                                           .tip = tips[is_on],
                                           .side_px = ImGui::GetFrameHeight(),
                                           .is_faint = !is_on,
                                           .icon_px = 16.0f},
                                          state);
    is_on = is_on != pressed;
    return pressed;
}

bool pick_color(Widgets& ui, const std::string& id, const char* tip, glm::dvec3& color,
                double* opacity) {
    constexpr float kSwatch = 0.6f; // of the row's height
    const float height = ImGui::GetFrameHeight(), side = std::round(kSwatch * height);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    ImGui::PushID(id.c_str());
    if (ImGui::InvisibleButton("swatch", {side + 4.0f, height}))
        ImGui::OpenPopup("picker");
    ui.note(id);
    const bool is_under = ImGui::IsItemHovered();
    if (is_under)
        ImGui::SetTooltip("%s", tip);
    const ImVec2 low(at.x + 2.0f, at.y + std::round(0.5f * (height - side))),
        high(low.x + side, low.y + side);
    const ImVec4 shown(static_cast<float>(color.x), static_cast<float>(color.y),
                       static_cast<float>(color.z), 1.0f);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float rounding = 0.25f * side;
    list.AddRectFilled(low, high, ImGui::GetColorU32(shown), rounding);
    list.AddRect(low, high, ImGui::GetColorU32(is_under ? ImGuiCol_Text : ImGuiCol_Border),
                 rounding);
    bool changed = false;
    if (ImGui::BeginPopup("picker")) {
        std::array<float, 4> rgba{shown.x, shown.y, shown.z,
                                  opacity ? static_cast<float>(*opacity) : 1.0f};
        const ImGuiColorEditFlags alpha =
            opacity ? ImGuiColorEditFlags_AlphaBar | ImGuiColorEditFlags_AlphaPreviewHalf
                    : ImGuiColorEditFlags_NoAlpha;
        changed = ImGui::ColorPicker4(
            "##picker", rgba.data(),
            alpha | ImGuiColorEditFlags_NoSidePreview | ImGuiColorEditFlags_NoLabel);
        if (changed) {
            color =
                glm::clamp(glm::dvec3(rgba[0], rgba[1], rgba[2]), glm::dvec3(0.0), glm::dvec3(1.0));
            if (opacity)
                *opacity = std::clamp(double{rgba[3]}, 0.0, 1.0);
        }
        ImGui::EndPopup();
    }
    ImGui::PopID();
    return changed;
}

std::vector<std::string> name_lines(const std::string& name, float first_px, float width_px) {
    std::vector<std::string> lines;
    const auto fits = [&](size_t from, size_t to) {
        return ImGui::CalcTextSize(name.data() + from, name.data() + to).x <=
               (lines.empty() ? first_px : width_px);
    };
    const auto next_letter = [&](size_t at) { // of UTF-8
        for (++at; at < name.size() && (static_cast<unsigned char>(name[at]) & 0xC0) == 0x80;)
            ++at;
        return at;
    };
    size_t begin = 0;
    do {
        size_t end = begin, good = begin; // good: the last place where it may be broken
        while (end < name.size()) {
            const size_t next = next_letter(end);
            if (end > begin && !fits(begin, next))
                break;
            const auto letter = static_cast<unsigned char>(name[end]);
            end = next;
            if (letter < 0x80 && !std::isalnum(letter))
                good = end;
        }
        if (end < name.size() && good > begin)
            end = good;
        size_t last = end;
        while (end < name.size() && last > begin && name[last - 1] == ' ')
            --last; // unseen at the end of a line
        lines.push_back(name.substr(begin, last - begin));
        begin = end;
    } while (begin < name.size());
    return lines;
}

} // namespace palpate::view
