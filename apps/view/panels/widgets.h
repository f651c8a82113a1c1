#pragma once

#include <imgui/imgui.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "apps/view/drawing/looks.h"
#include "apps/view/panels/panels.h"
#include "apps/view/window/state.h"

// Widgets that sections of the side panel share.
namespace palpate::view {

// The colour of words that stand out.
inline ImVec4 accent(const ViewState& state) {
    return rgb_color(theme_of(state.light).warning);
}

// The next window fills a box.
inline void place_window(const Box& box) {
    ImGui::SetNextWindowPos(
        ImVec2(static_cast<float>(box.low_px.x), static_cast<float>(box.low_px.y)));
    ImGui::SetNextWindowSize(
        ImVec2(static_cast<float>(box.size_px.x), static_cast<float>(box.size_px.y)));
}

// A window that stays where it is put.
constexpr ImGuiWindowFlags kFixedWindow =
    ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
    ImGuiWindowFlags_NoFocusOnAppearing;

// Begins a window that fills a box to its edges, as the bars do.
inline void begin_bar(const char* name, const Box& box) {
    place_window(box);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.0f, 0.0f));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0f, 1.0f));
    ImGui::Begin(name, nullptr,
                 kFixedWindow | ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse);
    ImGui::PopStyleVar(2);
}

// Begins a window in the middle, over the views; `open`: it has a button that closes it.
inline void begin_dialog(const char* title, bool* open, const ViewState& state,
                         ImGuiWindowFlags size = ImGuiWindowFlags_AlwaysAutoResize) {
    ImGui::SetNextWindowPos(ImVec2(0.5f * static_cast<float>(state.size_px.x),
                                   0.5f * static_cast<float>(state.size_px.y)),
                            ImGuiCond_Always, ImVec2(0.5f, 0.5f));
    ImGui::Begin(title, open,
                 size | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoSavedSettings);
}

// Draws the name of a setting at the left, in a column that all of a panel share, and leaves the
// rest of the line to the next widget. Returns the widget's id, which shows no name.
std::string named(const char* name);

// A list of names to choose from, which has the id, and its rows id/NAME; whether the choice
// changed.
template <class Choice, class List = std::initializer_list<std::pair<const char*, Choice>>>
bool choose(Widgets& ui, const std::string& id, const char* title, Choice& now, const List& all) {
    const char* shown = "";
    for (const auto& [name, value] : all)
        if (value == now)
            shown = name;
    bool changed = false;
    if (ImGui::BeginCombo(named(title).c_str(), shown)) {
        for (const auto& [name, value] : all) {
            if (ImGui::Selectable(name, value == now)) {
                now = value;
                changed = true;
            }
            ui.note(id + "/" + name);
        }
        ImGui::EndCombo();
    }
    ui.note(id);
    return changed;
}

// The name of a value, its slider, and a field into which it is typed; `format` has its unit. As an
// item it is the track of the slider. Whether the value changed.
bool slide(const char* name, double& value, double low, double high, const char* format,
           bool logarithmic = false); // low > 0 where it is logarithmic

// A name in lines that have room in a width, the first one in a width of its own: broken after
// blanks and signs, and within a word only where the word alone has no room. At least one line.
std::vector<std::string> name_lines(const std::string& name, float first_px, float width_px);

// Dimmed text that is broken into lines at the edge of the panel.
inline void hint(const char* text) {
    ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
    ImGui::TextWrapped("%s", text);
    ImGui::PopStyleColor();
}

// The text, or its beginning and its end with ".." between them, as much as has room in a width:
// names often differ in their last letters. Cut between letters of UTF-8.
inline std::string fitted(const std::string& text, float width_px) {
    const auto fits = [&](const std::string& one) {
        return ImGui::CalcTextSize(one.c_str()).x <= width_px;
    };
    if (fits(text))
        return text;
    std::vector<size_t> letters; // where they begin
    for (size_t i = 0; i < text.size(); ++i)
        if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80)
            letters.push_back(i);
    const auto with = [&](size_t kept) {
        const size_t tail = (kept + 1) / 2, head = kept - tail;
        return text.substr(0, head < letters.size() ? letters[head] : text.size()) + ".." +
               (tail > 0 ? text.substr(letters[letters.size() - tail]) : "");
    };
    size_t least = 0, most = letters.size(); // the most letters that fit lie in least .. most - 1
    while (least + 1 < most) {
        const size_t middle = (least + most) / 2;
        (fits(with(middle)) ? least : most) = middle;
    }
    return with(least);
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
