#pragma once

#include <imgui/imgui.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <utility>

// Widgets that sections of the side panel share.
namespace palpate::view {

// A list of names to choose from; whether the choice changed.
template <class Choice, class List = std::initializer_list<std::pair<const char*, Choice>>>
bool choose(const char* id, Choice& now, const List& all) {
    const char* shown = "";
    for (const auto& [name, value] : all)
        if (value == now)
            shown = name;
    bool changed = false;
    if (ImGui::BeginCombo(id, shown)) {
        for (const auto& [name, value] : all)
            if (ImGui::Selectable(name, value == now)) {
                now = value;
                changed = true;
            }
        ImGui::EndCombo();
    }
    return changed;
}

inline bool slide(const char* id, double& value, double low, double high, const char* format,
                  bool logarithmic = false) {
    return ImGui::SliderScalar(
        id, ImGuiDataType_Double, &value, &low, &high, format,
        ImGuiSliderFlags_AlwaysClamp | (logarithmic ? ImGuiSliderFlags_Logarithmic : 0));
}

// Dimmed text that is broken into lines at the edge of the panel.
inline void hint(const char* text) {
    ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
    ImGui::TextWrapped("%s", text);
    ImGui::PopStyleColor();
}

// The text with line ends where it would leave the panel, for widgets that do not break lines.
inline std::string wrapped(const std::string& text) {
    const float width = ImGui::GetContentRegionAvail().x;
    std::string lines;
    const char *at = text.c_str(), *const end = at + text.size();
    while (at < end) {
        const char* stop = ImGui::GetFont()->CalcWordWrapPositionA(1.0f, at, end, width);
        stop = std::max(stop, at + 1); // narrower than a letter
        lines += (lines.empty() ? "" : "\n") + std::string(at, stop);
        for (at = stop; at < end && *at == ' ';)
            ++at;
    }
    return lines;
}

} // namespace palpate::view
