// The slider of all panels.

#include <imgui/imgui.h>
#include <imgui/imgui_internal.h>

#include <algorithm>
#include <cmath>

#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

// The handle's place: 0 .. 1.
double share_of(double value, double low, double high, bool logarithmic) {
    const double share = logarithmic && low > 0.0 ? std::log(value / low) / std::log(high / low)
                                                  : (value - low) / (high - low);
    return std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 0.0;
}

// ImGui's slider without its looks: a thin track and a round handle lie over it.
bool draw_track(double& value, double low, double high, const char* format, bool logarithmic,
                float width) {
    ImGuiStyle& style = ImGui::GetStyle();
    for (const ImGuiCol unseen :
         {ImGuiCol_FrameBg, ImGuiCol_FrameBgHovered, ImGuiCol_FrameBgActive, ImGuiCol_Border,
          ImGuiCol_SliderGrab, ImGuiCol_SliderGrabActive, ImGuiCol_Text})
        ImGui::PushStyleColor(unseen, ImVec4(0.0f, 0.0f, 0.0f, 0.0f));
    ImGui::SetNextItemWidth(width);
    const bool changed = ImGui::SliderScalar(
        "##track", ImGuiDataType_Double, &value, &low, &high, format,
        ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoInput |
            (logarithmic ? ImGuiSliderFlags_Logarithmic : ImGuiSliderFlags_None));
    ImGui::PopStyleColor(7);
    const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
    constexpr float kPadding_px = 2.0f; // of ImGui's slider: the handle lies where it is held
    const float inset = kPadding_px + 0.5f * style.GrabMinSize;
    const auto share = static_cast<float>(share_of(value, low, high, logarithmic));
    const ImVec2 handle(from.x + inset + share * (to.x - from.x - 2.0f * inset),
                        0.5f * (from.y + to.y));
    const float half = std::max(1.0f, std::round(style.GrabMinSize / 8.0f));
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const auto line = [&](float left, float right, ImGuiCol color) {
        list.AddRectFilled({left, handle.y - half}, {right, handle.y + half},
                           ImGui::GetColorU32(color), half);
    };
    line(from.x, to.x, ImGuiCol_Border);
    line(from.x, handle.x, ImGuiCol_SliderGrabActive);
    const bool is_held = ImGui::IsItemActive() || ImGui::IsItemHovered();
    list.AddCircleFilled(handle, 0.5f * style.GrabMinSize,
                         ImGui::GetColorU32(is_held ? ImGuiCol_SliderGrab : ImGuiCol_Text));
    return changed;
}

} // namespace

std::string named(const char* name) {
    const char* const end = ImGui::FindRenderedTextEnd(name);
    if (end == name)
        return name;
    const float room = ImGui::GetContentRegionAvail().x, left = ImGui::GetCursorPosX();
    const float text = ImGui::CalcTextSize(name, end).x + ImGui::GetStyle().ItemInnerSpacing.x;
    const float column = std::max(room - ImGui::CalcItemWidth(), text); // a long name has more
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(name, end);
    ImGui::SameLine();
    ImGui::SetCursorPosX(left + std::round(column));
    ImGui::SetNextItemWidth(std::max(1.0f, room - std::round(column)));
    return fmt::format("##{}", name);
}

bool slide(const char* name, double& value, double low, double high, const char* format,
           bool logarithmic) {
    const std::string id = named(name);
    const ImGuiStyle& style = ImGui::GetStyle();
    const float width = ImGui::CalcItemWidth(), gap = style.ItemInnerSpacing.x;
    char shown[64] = "";
    ImFormatString(shown, sizeof(shown), format, value);
    const float field =
        std::clamp(ImGui::CalcTextSize(shown).x + 2.0f * style.FramePadding.x + 2.0f, 0.4f * width,
                   0.65f * width);
    ImGui::BeginGroup();
    ImGui::PushID(id.c_str());
    bool changed = draw_track(value, low, high, format, logarithmic,
                              std::max(1.0f, std::floor(width - gap - field)));
    const ImRect track = GImGui->LastItemData.Rect;
    ImGui::SameLine(0.0f, gap);
    ImGui::SetNextItemWidth(std::floor(field));
    double typed = value;
    if (ImGui::InputScalar("##field", ImGuiDataType_Double, &typed, nullptr, nullptr, format) &&
        !std::isnan(typed)) {
        value = std::clamp(typed, low, high);
        changed = true;
    }
    const ImRect typed_into = GImGui->LastItemData.Rect;
    ImGui::PopID();
    ImGui::EndGroup();
    ImGuiLastItemData& last = GImGui->LastItemData;
    last.Rect = track; // what is pressed for a value by the mouse
    last.DisplayRect = typed_into;
    last.StatusFlags |= ImGuiItemStatusFlags_HasDisplayRect; // Widgets::note() keeps it
    return changed;
}

} // namespace palpate::view
