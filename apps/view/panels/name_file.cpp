// Fields for names of files, what became of writing them, and what is being opened.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/document/free_name.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

void type(TypedText& typed, const std::string& text) {
    typed = {};
    text.copy(typed.data(), typed.size() - 1);
}

void browse_for_name(Widgets& ui, const std::string& id, const std::string& name,
                     ViewState& state) {
    ui.named = {id, name};
    state.naming = id;
    state.browsing = Browsing::name;
    state.browser_open = true;
}

void name_file(Widgets& ui, const std::string& id, TypedText& typed, const std::string& name,
               const char* button, ViewState& state) {
    const bool chooses = state.browser_open && state.browsing == Browsing::name;
    if (ui.named.first == id && !chooses)
        type(typed, std::exchange(ui.named, {}).second);
    std::string& proposed = ui.proposed[id];
    if (typed[0] == '\0' || name != proposed)
        type(typed, followed_name(typed.data(), proposed, name));
    proposed = name;
    const auto width = [](const char* text) {
        return ImGui::CalcTextSize(text).x + 2.0f * ImGui::GetStyle().FramePadding.x +
               ImGui::GetStyle().ItemSpacing.x;
    };
    ImGui::PushID(id.c_str());
    ImGui::SetNextItemWidth(-(width("..") + width(button)));
    ImGui::InputText("##name", typed.data(), typed.size(), ImGuiInputTextFlags_AutoSelectAll);
    ui.note(id);
    ImGui::SameLine();
    if (ImGui::Button(".."))
        browse_for_name(ui, id, typed.data(), state);
    ui.note(fmt::format("{}/choose", id));
    ImGui::PopID();
}

// While a file is read.
void draw_opening(Widgets& ui, const ViewState& state) {
    if (state.opening.empty())
        return;
    begin_dialog("Opening", nullptr, state);
    if (!state.names_hidden)
        ImGui::TextUnformatted(state.opening.c_str());
    const double seconds = std::max(0.0, ui.time_s - state.opening_since_s);
    const std::string shown = state.opening_share > 0.0
                                  ? fmt::format("{:.0f} % {}", 100.0 * state.opening_share,
                                                time_left_text(state.opening_share, seconds))
                                  : fmt::format("{:.0f} s", seconds);
    ImGui::ProgressBar(static_cast<float>(state.opening_share),
                       ImVec2(18.0f * ImGui::GetFontSize(), 0.0f), shown.c_str());
    ui.note("opening/share");
    ui.button("cancel", "opening/cancel", order::CancelOpening{});
    ImGui::End();
}

void draw_result(Widgets& ui, const std::string& id, const Message& told, const ViewState& state) {
    if (told.empty())
        return;
    hint(told.shown(state.names_hidden).c_str());
    ui.note(id);
}

} // namespace palpate::view
