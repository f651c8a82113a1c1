// The side panel: the sections that the chosen task needs, and the grip that gives it its width.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/looks.h"
#include "apps/view/panels/export_panel.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

// The head of a section, which folds it; whether it is open.
bool draw_head(Widgets& ui, ViewState& state, const SectionEntry& section) {
    const Theme& theme = theme_of(state.light);
    const auto scale = static_cast<float>(state.text_scale);
    const float height = 24.0f * scale, arrow = 16.0f * scale;
    const ImVec2 low = ImGui::GetCursorScreenPos();
    const float width = std::max(ImGui::GetContentRegionAvail().x, 1.0f);
    if (ImGui::InvisibleButton(fmt::format("##section/{}", section.name).c_str(), {width, height}))
        state.sections.set(section.section, !state.sections.has(section.section));
    ui.note(fmt::format("section/{}", section.name));
    const bool is_open = state.sections.has(section.section);
    const ImU32 color =
        ImGui::GetColorU32(rgb_color(ImGui::IsItemHovered() ? theme.text : theme.hint));
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 middle(low.x + 0.5f * arrow, low.y + 0.5f * height);
    if (!draw_icon(list, middle, arrow, is_open ? Icon::down : Icon::right, color))
        list.AddText({low.x, low.y + 0.5f * (height - ImGui::GetFontSize())}, color,
                     is_open ? "-" : "+");
    draw_spaced(list, {low.x + arrow + 4.0f * scale, middle.y}, section.title, color);
    return is_open;
}

void draw_section(Widgets& ui, SidePanel& panel, Section section, ViewState& state, Work& work) {
    switch (section) {
        case Section::window:
            return draw_window_section(ui, panel.ends, state, work);
        case Section::volume:
            return draw_volume_section(ui, state, work);
        case Section::colours:
            return draw_transfer_panel(ui, state, work);
        case Section::labels_shown:
            return draw_label_looks(ui, state, /*all=*/false);
        case Section::layout:
            return draw_layout_section(ui, state);
        case Section::slices:
            return draw_slices_section(ui, state, work);
        case Section::clips:
            return draw_clip_panel(ui, state, work);
        case Section::stereo:
            return draw_stereo_section(ui, state);
        case Section::appearance:
            return draw_appearance_section(ui, state);
        case Section::brush:
            return draw_brush_section(ui, state);
        case Section::mask:
            return draw_mask_section(ui, panel.ends, state, work);
        case Section::labels:
            return draw_label_panel(ui, panel.labels, state, work);
        case Section::seeds:
            return draw_seeds_section(ui, state);
        case Section::method:
            return draw_method_section(ui, panel.bound_held, state, work);
        case Section::mesh:
            return draw_mesh_section(ui, state, work);
        case Section::wire:
            return draw_wire_section(ui, state);
        case Section::measures:
            return draw_measure_panel(ui, panel.measures_file, state, work);
        case Section::hand:
            return draw_hand_section(ui, panel.touch, state, work);
        case Section::burr:
            return draw_burr_section(ui, state, work);
        case Section::removed:
            return draw_removed_panel(ui, work);
        case Section::feel:
            return draw_feel_section(ui, work);
        case Section::forces:
            return draw_forces_section(ui, state, work);
        case Section::files:
            return draw_files_section(ui, panel.files, state, work);
        case Section::label_files:
            return draw_label_files_section(ui, panel.labels, state, work);
        case Section::print:
            return draw_export_panel(ui, panel.files.mesh_file, state, work);
        case Section::figure:
            return draw_figure_panel(ui, panel.files.figure_file, state);
        case Section::session:
            return draw_session_panel(ui, panel.files.session_file, state);
        case Section::steps:
            return draw_steps_section(ui, panel.files.shown_step, work);
    }
}

// Each section has its own widgets, though two may have the same names.
void draw_sections(Widgets& ui, SidePanel& panel, ViewState& state, Work& work) {
    const WindowTask task = state.task;
    for (const SectionEntry& section : sections()) {
        if (section.task != task || !draw_head(ui, state, section))
            continue;
        ImGui::PushID(section.name);
        draw_section(ui, panel, section.section, state, work);
        ImGui::PopID();
        ImGui::Dummy({0.0f, 2.0f * static_cast<float>(state.text_scale)});
    }
}

// A strip upon the panel's edge: dragged, it gives the panel another width.
void draw_grip(Widgets& ui, ViewState& state, const Box& panel) {
    const auto scale = static_cast<float>(state.text_scale);
    const float width = std::round(6.0f * scale);
    const ImVec2 low(static_cast<float>(panel.low_px.x), static_cast<float>(panel.low_px.y)),
        size(width, static_cast<float>(panel.size_px.y));
    ImGui::SetNextWindowPos(low);
    ImGui::SetNextWindowSize(size);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0.0f, 0.0f));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0f, 1.0f));
    // In front of the panel, which would be there for whatever lies upon its edge.
    constexpr ImGuiWindowFlags kUpon = kFixedWindow & ~ImGuiWindowFlags_NoBringToFrontOnFocus;
    ImGui::Begin("grip", nullptr,
                 kUpon | ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoBackground);
    ImGui::PopStyleVar(2);
    ImGui::InvisibleButton("panel/width", size);
    ui.note("panel/width");
    const Theme& theme = theme_of(state.light);
    if (ImGui::IsItemActive()) {
        const float right = low.x + static_cast<float>(panel.size_px.x);
        const double wanted = static_cast<double>(right - ImGui::GetIO().MousePos.x + 0.5f * width);
        state.panel_px =
            std::clamp(std::round(wanted / state.text_scale), kNarrowestPanel_px, kWidestPanel_px);
    }
    const bool is_used = ImGui::IsItemActive() || ImGui::IsItemHovered();
    const float thick = is_used ? std::round(2.0f * scale) : 1.0f;
    ImGui::GetWindowDrawList()->AddRectFilled(
        low, {low.x + thick, low.y + size.y},
        ImGui::GetColorU32(rgb_color(is_used ? theme.accent : theme.line)));
    ImGui::End();
}

// Below what is scrolled.
void draw_foot(Widgets& ui, ViewState& state, Work& work, const Box& box) {
    const ImGuiStyle& style = ImGui::GetStyle();
    const auto height = static_cast<float>(box.size_px.y);
    begin_bar("foot", box);
    const ImVec2 low = ImGui::GetWindowPos();
    ImGui::GetWindowDrawList()->AddLine(low, {low.x + ImGui::GetWindowWidth(), low.y},
                                        ImGui::GetColorU32(ImGuiCol_Separator));
    ImGui::SetCursorPos(
        {style.WindowPadding.x, std::round(0.5f * (height - ImGui::GetFrameHeight()))});
    draw_segment_foot(ui, state, work);
    ImGui::End();
}

} // namespace

std::string samples_text(const Work& work) {
    const glm::uvec3 size = work.subject().grid.size;
    const glm::dvec3 spacing = spacing_mm(work.subject().grid);
    return fmt::format("{} x {} x {}, {:.3g} x {:.3g} x {:.3g} mm", size.x, size.y, size.z,
                       spacing.x, spacing.y, spacing.z);
}

void draw_side_panel(Widgets& ui, SidePanel& panel, ViewState& state, Work& work) {
    panel.bound_held = false;
    const Box box = places_of(state).tools;
    if (box.size_px.x > 0) {
        place_window(box);
        // The scroll bar is always there, else lines would move as it comes. Each task has a window
        // of its own, which keeps how far it is scrolled.
        ImGui::Begin(fmt::format("tools/{}", name_of(state.task)).c_str(), nullptr,
                     kFixedWindow | ImGuiWindowFlags_AlwaysVerticalScrollbar);
        if (state.task == WindowTask::look) {
            hint(samples_text(work).c_str());
            if (work.zero_hu() != 0.0) {
                hint(fmt::format("a CT stored as HU + {:g}", work.zero_hu()).c_str());
                ui.note("file/zero_hu");
            }
        }
        const char* const longest = state.task == WindowTask::drill       ? "right button_"
                                    : state.task == WindowTask::exporting ? "background_"
                                                                          : "thickness_";
        ImGui::PushItemWidth(
            -std::min(ImGui::CalcTextSize(longest).x, 0.6f * ImGui::GetContentRegionAvail().x));
        draw_sections(ui, panel, state, work);
        ImGui::PopItemWidth();
        ImGui::End();
        const Box foot = places_of(state).foot;
        if (foot.size_px.y > 0)
            draw_foot(ui, state, work, foot);
        draw_grip(ui, state, {box.low_px, box.size_px + glm::ivec2(0, foot.size_px.y)});
    }
    if (!panel.bound_held && !work.segmentation().share()) // taken, or no longer shown
        state.segmenting.preview.reset();
}

} // namespace palpate::view
