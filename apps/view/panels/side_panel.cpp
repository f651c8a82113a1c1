// The side panel: what is open, and the panels that its tabs choose.

#include "apps/view/drawing/looks.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

void draw_tabs(Widgets& ui, ViewState& state) {
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, ImVec2(4.0f, 0.0f));
    for (const Tab tab : {Tab::view, Tab::transfer, Tab::labels, Tab::segment, Tab::measure,
                          Tab::clip, Tab::file}) {
        if (tab != Tab::view)
            ImGui::SameLine(0.0f, 3.0f);
        if (ImGui::GetContentRegionAvail().x < ImGui::CalcTextSize(name_of(tab)).x + 8.0f)
            ImGui::NewLine();
        const bool is_it = state.tab == tab;
        if (is_it) {
            const Theme& theme = theme_of(state.light);
            ImGui::PushStyleColor(ImGuiCol_Button, rgb_color(theme.accent));
            ImGui::PushStyleColor(ImGuiCol_Text, rgb_color(theme.on_accent));
        }
        if (ImGui::SmallButton(name_of(tab)))
            state.tab = tab;
        if (is_it)
            ImGui::PopStyleColor(2);
        ui.note(fmt::format("tab/{}", name_of(tab)));
    }
    ImGui::PopStyleVar();
}

void draw_title(Widgets& ui, const ViewState& state, Work& work) {
    ImGui::TextUnformatted(state.names_hidden ? "(name hidden)" : work.title().c_str());
    const glm::uvec3 size = work.subject().grid.size;
    const glm::dvec3 spacing = spacing_mm(work.subject().grid);
    const std::string samples = fmt::format("{} x {} x {},", size.x, size.y, size.z);
    const std::string extent =
        fmt::format("{:.3g} x {:.3g} x {:.3g} mm", spacing.x, spacing.y, spacing.z);
    ImGui::TextDisabled("%s", samples.c_str());
    if (ImGui::CalcTextSize((samples + " " + extent).c_str()).x <
        ImGui::GetContentRegionAvail().x) // else in a line of its own
        ImGui::SameLine(0.0f, ImGui::CalcTextSize(" ").x);
    ImGui::TextDisabled("%s", extent.c_str());
    if (work.zero_hu() != 0.0) {
        hint(fmt::format("a CT stored as HU + {:g}", work.zero_hu()).c_str());
        ui.note("file/zero_hu");
    }
}

void draw_tab(Widgets& ui, SidePanel& panel, ViewState& state, Work& work) {
    switch (state.tab) {
        case Tab::view:
            draw_view_panel(ui, panel.ends, state, work);
            break;
        case Tab::transfer:
            draw_transfer_panel(ui, state, work);
            break;
        case Tab::labels:
            draw_label_panel(ui, panel.labels, panel.ends, state, work);
            break;
        case Tab::segment:
            draw_segment_panel(ui, panel.bound_held, state, work);
            break;
        case Tab::measure:
            draw_measure_panel(ui, panel.measures_file, state, work);
            break;
        case Tab::clip:
            draw_clip_panel(ui, state, work);
            break;
        case Tab::file:
            draw_files_panel(ui, panel.files, state, work);
            break;
    }
}

} // namespace

void draw_side_panel(Widgets& ui, SidePanel& panel, ViewState& state, Work& work) {
    panel.bound_held = false;
    const Box box = places_of(state).tools;
    if (box.size_px.x > 0) {
        place_window(box);
        ImGui::Begin("tools", nullptr,
                     kFixedWindow | ImGuiWindowFlags_AlwaysVerticalScrollbar); // else lines
                                                                               // move as it comes
        draw_tabs(ui, state);
        draw_title(ui, state, work);
        ImGui::PushItemWidth(-ImGui::CalcTextSize("thickness_").x);
        draw_tab(ui, panel, state, work);
        ImGui::PopItemWidth();
        ImGui::End();
    }
    if (!panel.bound_held && !work.segmentation().share()) // taken, or no longer shown
        state.segmenting.preview.reset();
}

} // namespace palpate::view
