#pragma once

#include <imgui/imgui.h>

#include <initializer_list>
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

} // namespace palpate::view
