// The labels: what is seen, what may be changed, how much there is of each.

#include <imgui/imgui.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <string_view>

#include "apps/view/document/label_changes.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/tool.h"
#include "engine/measure/measure_report.h"

namespace palpate::view {

namespace {

constexpr size_t kMostRows = 14; // seen at once

// Those that a file names, those that occur, and the one that is drawn.
std::vector<uint32_t> listed_labels(const ViewState& state, Work& work) {
    std::set<uint32_t> all{state.label};
    for (const LabelName& name : state.notes.label_names)
        all.insert(name.label);
    const auto known = work.figures().known();
    for (size_t label = 1; label < known->label_counts.size(); ++label)
        if (known->label_counts[label] > 0)
            all.insert(static_cast<uint32_t>(label));
    all.erase(0);
    return {all.begin(), all.end()};
}

// The lowest number from 1 to 65535 that is not listed; 0: none.
uint32_t first_free(const std::vector<uint32_t>& listed) {
    uint32_t free = 1; // the list ascends
    for (const uint32_t label : listed)
        free += label == free;
    return free <= 65535 ? free : 0;
}

// Whether a name has a part, whatever the case of its letters; an empty part is in all.
bool has_part(const std::string& name, std::string_view part) {
    const auto same = [](unsigned char a, unsigned char b) {
        return std::tolower(a) == std::tolower(b);
    };
    return std::search(name.begin(), name.end(), part.begin(), part.end(), same) != name.end() ||
           part.empty();
}

void draw_label_row(Widgets& ui, ViewState& state, Work& work, uint32_t label) {
    ImGui::PushID(static_cast<int>(label));
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    LabelStyle style = style_of(state.notes, label);
    if (ImGui::Checkbox("##visible", &style.visible))
        set_style(state.notes, label, style);
    ui.note(fmt::format("labels/visible/{}", label));
    ImGui::TableNextColumn();
    auto& locked = state.notes.locked_labels;
    const auto place = std::lower_bound(locked.begin(), locked.end(), label);
    bool is_locked = place != locked.end() && *place == label;
    if (ImGui::Checkbox("##locked", &is_locked)) {
        if (is_locked)
            locked.insert(place, static_cast<uint16_t>(label));
        else
            locked.erase(place);
    }
    ui.note(fmt::format("labels/lock/{}", label));
    ImGui::TableNextColumn();
    float rgba[] = {static_cast<float>(style.color.x), static_cast<float>(style.color.y),
                    static_cast<float>(style.color.z), static_cast<float>(style.opacity)};
    if (ImGui::ColorEdit4("##color", rgba,
                          ImGuiColorEditFlags_NoInputs | ImGuiColorEditFlags_NoTooltip |
                              ImGuiColorEditFlags_AlphaBar |
                              ImGuiColorEditFlags_AlphaPreviewHalf)) {
        style.color =
            glm::clamp(glm::dvec3(rgba[0], rgba[1], rgba[2]), glm::dvec3(0.0), glm::dvec3(1.0));
        style.opacity = std::clamp(double{rgba[3]}, 0.0, 1.0);
        set_style(state.notes, label, style);
    }
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("%s", "Colour of the label; its opacity is that of its surface in 3D");
    ui.note(fmt::format("labels/color/{}", label));
    ImGui::TableNextColumn();
    const std::string name = numbered_name(state.notes, label);
    const float gap = ImGui::CalcTextSize(" ").x; // before its volume
    const bool is_chosen = state.label == label;
    ImGui::PushFont(is_chosen ? bold_letters() : ImGui::GetFont());
    const std::string shown = fitted(name, ImGui::GetContentRegionAvail().x - gap);
    if (ImGui::Selectable(shown.c_str(), is_chosen) && label <= 65535)
        state.label = static_cast<uint16_t>(label);
    ImGui::PopFont();
    if (ImGui::IsItemHovered()) // the column may be narrower
        ImGui::SetTooltip("%s", name.c_str());
    ui.note(fmt::format("labels/row/{}", label));
    ImGui::TableNextColumn();
    const auto known = work.figures().known();
    const uint64_t count = label < known->label_counts.size() ? known->label_counts[label] : 0;
    if (const auto mm3 = work.label_sample_mm3(); mm3 && count > 0)
        ImGui::TextUnformatted(ml_text(static_cast<double>(count) * *mm3).c_str());
    else
        ImGui::TextDisabled("-");
    ImGui::PopID();
}

// Buttons, as many in a line as have room; in front of those by mm, how far.
void draw_label_changes(Widgets& ui, ViewState& state) {
    bool is_first = true, has_mm = false;
    for (const LabelChange& change : label_changes()) {
        const float width =
            ImGui::CalcTextSize(change.title).x + 2.0f * ImGui::GetStyle().FramePadding.x;
        if (change.takes_mm && !std::exchange(has_mm, true)) {
            slide("by", state.change_label_mm, 0.1, 20.0, "%.2g mm", true);
            ui.note("labels/by");
            is_first = true;
        }
        if (!std::exchange(is_first, false)) {
            ImGui::SameLine();
            if (ImGui::GetContentRegionAvail().x < width)
                ImGui::NewLine();
        }
        ui.button(change.title, fmt::format("labels/{}", change.id), order::ChangeLabel{&change});
    }
}

// Draws the figures of the label that is chosen.
void draw_label_figures(Widgets& ui, ViewState& state, Work& work) {
    const auto known = work.figures().known();
    const uint64_t count =
        state.label < known->label_counts.size() ? known->label_counts[state.label] : 0;
    ImGui::Separator();
    ImGui::PushID(state.label);
    ImGui::AlignTextToFramePadding();
    ImGui::Text("label %u", unsigned{state.label});
    ImGui::SameLine();
    std::array<char, 128> name{};
    name_of_label(state.notes, state.label).copy(name.data(), name.size() - 1);
    ImGui::SetNextItemWidth(-1.0f);
    if (ImGui::InputTextWithHint("##name", "name", name.data(), name.size()))
        name_label(state.notes, state.label, name.data());
    ImGui::PopID();
    ui.note("labels/name");
    if (count == 0) {
        ImGui::TextDisabled("no sample carries it");
        return;
    }
    const double mm3 = static_cast<double>(count) * work.label_sample_mm3().value_or(0.0);
    ImGui::Text("%s, %llu samples", ml_text(mm3).c_str(), static_cast<unsigned long long>(count));
    ImGui::BeginDisabled(work.mesh_pulling().share().has_value());
    draw_label_changes(ui, state);
    ImGui::EndDisabled();
    for (const LabelStatistics& one : known->labels) {
        if (one.label != state.label)
            continue;
        if (one.count != count) {
            ImGui::TextDisabled("counting ..");
            return;
        }
        draw_values(one.values, work.unit());
        if (ImGui::Button("go to its middle"))
            move_crosshair(state, work.subject().grid, one.centroid_mm);
        ui.note("labels/middle");
    }
}

} // namespace

void draw_label_panel(Widgets& ui, LabelPanel& panel, ViewState& state, Work& work) {
    draw_label_looks(ui, state, /*all=*/true);
    slide("outline", state.outline_px, 0.0, 5.0, "%.0f px");
    ui.note("labels/outline");
    const auto all = listed_labels(state, work);
    const auto set_visible = [&](auto is_visible) {
        for (const uint32_t label : all) {
            LabelStyle style = style_of(state.notes, label);
            style.visible = is_visible(label);
            set_style(state.notes, label, style);
        }
    };
    if (ImGui::SmallButton("see all"))
        set_visible([](uint32_t) { return true; });
    ui.note("labels/all");
    ImGui::SameLine();
    if (ImGui::SmallButton("see one"))
        set_visible([&](uint32_t label) { return label == state.label; });
    ui.note("labels/one");
    ImGui::SameLine();
    const uint32_t next = first_free(all);
    ImGui::BeginDisabled(next == 0);
    if (ImGui::SmallButton("new label")) {
        state.label = static_cast<uint16_t>(next);
        state.tool = &kDrawTool;
        panel.sought = {}; // it would leave the new one out
    }
    ImGui::EndDisabled();
    ui.note("labels/new");
    ImGui::SetNextItemWidth(-ImGui::CalcTextSize("find_").x);
    ImGui::InputText("find", panel.sought.data(), panel.sought.size());
    ui.note("labels/find");
    std::vector<uint32_t> found = all;
    std::erase_if(found, [&](uint32_t label) {
        return !has_part(numbered_name(state.notes, label), panel.sought.data());
    });
    const float row = ImGui::GetFrameHeightWithSpacing();
    const float height = row * static_cast<float>(std::min(found.size(), kMostRows) + 1) + 4.0f;
    if (ImGui::BeginTable("labels", 5,
                          ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg |
                              ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_NoPadOuterX,
                          ImVec2(0.0f, height))) {
        ImGui::TableSetupScrollFreeze(0, 1);
        ImGui::TableSetupColumn("see");
        ImGui::TableSetupColumn("lock");
        ImGui::TableSetupColumn("");
        ImGui::TableSetupColumn("label", ImGuiTableColumnFlags_WidthStretch);
        ImGui::TableSetupColumn("volume");
        ImGui::TableHeadersRow();
        ImGuiListClipper rows; // an atlas has hundreds
        rows.Begin(static_cast<int>(found.size()));
        while (rows.Step())
            for (int i = rows.DisplayStart; i < rows.DisplayEnd; ++i)
                draw_label_row(ui, state, work, found[static_cast<size_t>(i)]);
        ImGui::EndTable();
    }
    if (ImGui::SmallButton("labels of a file..")) { // in the place of what is there
        state.browser_open = true;
        state.browsing = Browsing::labels;
    }
    ui.note("labels/open");
    draw_label_figures(ui, state, work);
}

// To a file, whose name says what: all labels, or the surface of the one that is chosen.
void draw_label_files_section(Widgets& ui, LabelPanel& panel, ViewState& state) {
    name_file(ui, "labels/file", panel.file, "labels.nii.gz", "export", state);
    ImGui::SameLine();
    if (ImGui::Button("export"))
        ui.order(order::ExportLabels{panel.file.data()});
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("%s",
                          ".nii.gz, .nrrd, .mha: all labels\n"
                          ".stl, .ply, .obj, .vtp: the surface of the label that is chosen");
    ui.note("labels/export");
}

} // namespace palpate::view
