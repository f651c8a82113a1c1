// Sections of files: what was opened last, and the steps that were done. And how the window looks.

#include <imgui/imgui.h>

#include <algorithm>
#include <filesystem>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

// Steps that were done, and below the present, dimmed, those that can be redone. A click goes
// there.
void draw_steps_section(Widgets& ui, size_t& shown_step, Work& work) {
    const EditState edit = work.edited();
    const std::vector<std::string> titles = work.session().step_titles();
    const float row = ImGui::GetTextLineHeightWithSpacing();
    if (!ImGui::BeginChild("steps",
                           ImVec2(0.0f, std::max(ImGui::GetContentRegionAvail().y, 4 * row))))
        return ImGui::EndChild();
    const auto line = [&](size_t done, const std::string& title) {
        ImGui::PushID(static_cast<int>(done));
        const bool is_redo = done > edit.undo_steps;
        if (is_redo)
            ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
        if (ImGui::Selectable(title.c_str(), done == edit.undo_steps)) {
            for (size_t i = done; i < edit.undo_steps; ++i)
                ui.order(order::Undo{});
            for (size_t i = edit.undo_steps; i < done; ++i)
                ui.order(order::Redo{});
        }
        ui.note(fmt::format("file/step/{}", done));
        if (done == edit.undo_steps && std::exchange(shown_step, done) != done)
            ImGui::SetScrollHereY(0.5f);
        if (is_redo)
            ImGui::PopStyleColor();
        ImGui::PopID();
    };
    line(0, "as opened");
    for (size_t i = 0; i < titles.size(); ++i)
        line(i + 1, fmt::format("{}  {}", i + 1, titles[i]));
    ImGui::EndChild();
}

void draw_files_section(Widgets& ui, FilesPanel& panel, ViewState& state, Work& work) {
    if (ImGui::Button("open..")) {
        state.browser_open = true;
        state.browsing = Browsing::documents;
    }
    ui.note("file/open");
    ImGui::SameLine();
    ui.button("save", "file/save", order::Save{});
    ImGui::SameLine();
    ui.button("picture", "file/picture", order::TakePicture{});
    if (!ImGui::IsWindowHovered(ImGuiHoveredFlags_AllowWhenBlockedByActiveItem) ||
        panel.listed.empty())
        panel.listed = panel.recent; // else rows would move under the pointer
    if (!state.names_hidden && !panel.listed.empty()) {
        ImGui::TextDisabled("opened last");
        constexpr size_t kMost = 4; // the chooser of `open` has the folders of all
        for (size_t i = 0; i < std::min(panel.listed.size(), kMost); ++i) {
            ImGui::PushID(static_cast<int>(i));
            const std::filesystem::path path(panel.listed[i]);
            const std::string name = (path.has_filename() ? path : path.parent_path()).filename();
            if (ImGui::Selectable(name.c_str()))
                ui.order(order::Open{panel.listed[i]});
            if (ImGui::IsItemHovered())
                ImGui::SetTooltip("%s", panel.listed[i].c_str());
            ui.note(fmt::format("file/recent/{}", i));
            ImGui::PopID();
        }
    }
    draw_series_list(ui, state, work);
}

void draw_appearance_section(Widgets& ui, ViewState& state) {
    ui.check("light", "file/light", state.light);
    constexpr double scales[] = {1.0, 1.25, 1.5, 2.0};
    if (ImGui::BeginCombo(named("letters").c_str(),
                          fmt::format("{:g}", state.text_scale).c_str())) {
        for (const double scale : scales) {
            if (ImGui::Selectable(fmt::format("{:g}", scale).c_str(), state.text_scale == scale))
                state.text_scale = scale;
            ui.note(fmt::format("file/text/{:g}", scale));
        }
        ImGui::EndCombo();
    }
    ui.note("file/text");
    ui.check("indices of samples", "file/indices", state.indices_shown);
    ui.check("hide names", "file/hide", state.names_hidden);
}

} // namespace palpate::view
