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

// A label as the list has it: its name in as many lines as it needs, and how much there is.
struct LabelRow {
    uint32_t label = 0;
    std::vector<std::string> lines{};
    std::string amount{};

    float height() const {
        return static_cast<float>(lines.size()) * ImGui::GetTextLineHeight() +
               2.0f * ImGui::GetStyle().FramePadding.y;
    }
};

// Lengths that all rows share: a switch, a swatch, the name, the amount, a switch.
struct LabelColumns {
    float gap, name, name_width, amount_end, lock, width;
};

LabelColumns columns_of(float width, const std::vector<LabelRow>& rows) {
    const float side = ImGui::GetFrameHeight(), gap = std::round(0.25f * side);
    float amount = 0.0f;
    for (const LabelRow& row : rows)
        amount = std::max(amount, ImGui::CalcTextSize(row.amount.c_str()).x);
    LabelColumns all{};
    all.gap = gap;
    all.width = width;
    all.name = 2.0f * side;
    all.lock = width - side;
    all.amount_end = all.lock - 0.5f * gap;
    all.name_width = std::max(side, std::floor(all.amount_end - amount - gap - all.name));
    return all;
}

std::vector<LabelRow> rows_of(const std::vector<uint32_t>& labels, Work& work) {
    const auto known = work.figures().known();
    const auto mm3 = work.label_sample_mm3();
    std::vector<LabelRow> rows;
    rows.reserve(labels.size());
    for (const uint32_t label : labels) {
        const uint64_t count = label < known->label_counts.size() ? known->label_counts[label] : 0;
        rows.push_back(
            {label, {}, mm3 && count > 0 ? ml_text(static_cast<double>(count) * *mm3) : "-"});
    }
    return rows;
}

void draw_name(Widgets& ui, ViewState& state, const LabelRow& row, const LabelColumns& columns,
               ImVec2 low, const Theme& theme) {
    const bool is_chosen = state.label == row.label;
    ImGui::SetCursorScreenPos({low.x + columns.name, low.y});
    if (ImGui::InvisibleButton("##name", {columns.name_width, row.height()}) && row.label <= 65535)
        state.label = static_cast<uint16_t>(row.label);
    ui.note(fmt::format("labels/row/{}", row.label));
    const bool is_under = ImGui::IsItemHovered();
    const bool is_seen = style_of(state.notes, row.label).visible;
    const ImU32 color = ImGui::GetColorU32(rgb_color(is_under  ? theme.accent_text
                                                     : is_seen ? theme.text
                                                               : theme.second));
    ImDrawList& list = *ImGui::GetWindowDrawList();
    ImFont* const font = is_chosen ? bold_letters() : ImGui::GetFont();
    float top = low.y + ImGui::GetStyle().FramePadding.y;
    for (const std::string& line : row.lines) {
        list.AddText(font, font->FontSize, {low.x + columns.name, top}, color, line.c_str());
        top += ImGui::GetTextLineHeight();
    }
    if (is_under)
        ImGui::SetTooltip("%s\na click: brush and methods write this label",
                          numbered_name(state.notes, row.label).c_str());
}

void draw_label_row(Widgets& ui, ViewState& state, const LabelRow& row,
                    const LabelColumns& columns) {
    const uint32_t label = row.label;
    const Theme& theme = theme_of(state.light);
    const ImVec2 low = ImGui::GetCursorScreenPos();
    const float side = ImGui::GetFrameHeight(), height = row.height();
    ImDrawList& list = *ImGui::GetWindowDrawList();
    if (state.label == label)
        list.AddRectFilled(low, {low.x + columns.width, low.y + height},
                           ImGui::GetColorU32(rgb_color(theme.accent, theme.chosen)),
                           ImGui::GetStyle().FrameRounding);
    ImGui::PushID(static_cast<int>(label));
    LabelStyle style = style_of(state.notes, label);
    if (draw_row_switch(ui, fmt::format("labels/visible/{}", label), RowSwitch::shown,
                        {"hidden: a click shows it", "shown: a click hides it"}, style.visible,
                        state))
        set_style(state.notes, label, style);
    ImGui::SetCursorScreenPos({low.x + side, low.y});
    if (pick_color(ui, fmt::format("labels/color/{}", label),
                   "Colour of the label; its opacity is that of its surface in 3D", style.color,
                   &style.opacity))
        set_style(state.notes, label, style);
    draw_name(ui, state, row, columns, low, theme);
    const float amount = ImGui::CalcTextSize(row.amount.c_str()).x;
    list.AddText({low.x + columns.amount_end - amount, low.y + ImGui::GetStyle().FramePadding.y},
                 ImGui::GetColorU32(rgb_color(theme.second)), row.amount.c_str());
    ImGui::SetCursorScreenPos({low.x + columns.lock, low.y});
    auto& locked = state.notes.locked_labels;
    const auto place = std::lower_bound(locked.begin(), locked.end(), label);
    bool is_locked = place != locked.end() && *place == label;
    if (draw_row_switch(ui, fmt::format("labels/lock/{}", label), RowSwitch::locked,
                        {"unlocked: a click locks it, and no tool changes it",
                         "locked: no tool changes it; a click unlocks it"},
                        is_locked, state)) {
        if (is_locked)
            locked.insert(place, static_cast<uint16_t>(label));
        else
            locked.erase(place);
    }
    ImGui::PopID();
    ImGui::SetCursorScreenPos({low.x, low.y + height + ImGui::GetStyle().ItemSpacing.y});
}

// The rows, those of a long list in a box of their own that scrolls.
void draw_label_list(Widgets& ui, ViewState& state, Work& work,
                     const std::vector<uint32_t>& labels) {
    std::vector<LabelRow> rows = rows_of(labels, work);
    const ImGuiStyle& style = ImGui::GetStyle();
    const float most = static_cast<float>(kMostRows) * ImGui::GetFrameHeightWithSpacing();
    const float room = ImGui::GetContentRegionAvail().x;
    float all = 0.0f;
    LabelColumns columns{};
    // A bar that scrolls takes some of the names' width: rows are measured again with it.
    for (const float width : {room, room - style.ScrollbarSize}) {
        columns = columns_of(width, rows);
        all = 0.0f;
        for (LabelRow& row : rows) {
            ImGui::PushFont(bold_letters()); // the wider ones
            row.lines = name_lines(numbered_name(state.notes, row.label), columns.name_width,
                                   columns.amount_end - columns.name);
            ImGui::PopFont();
            all += row.height() + style.ItemSpacing.y;
        }
        if (all <= most)
            break;
    }
    if (ImGui::BeginChild("labels", {0.0f, std::min(all, most)})) {
        for (const LabelRow& row : rows) {
            const ImVec2 low = ImGui::GetCursorScreenPos();
            if (ImGui::IsRectVisible({columns.width, row.height()})) // an atlas has hundreds
                draw_label_row(ui, state, row, columns);
            else
                ImGui::SetCursorScreenPos({low.x, low.y + row.height() + style.ItemSpacing.y});
        }
        ImGui::Dummy({0.0f, 0.0f}); // the rows' end, for the bar that scrolls
    }
    ImGui::EndChild();
}

// Buttons, as many in a line as have room.
void draw_changes(Widgets& ui, bool are_daily, bool take_mm) {
    bool is_first = true;
    for (const LabelChange& change : label_changes()) {
        if (change.is_daily != are_daily || change.takes_mm != take_mm)
            continue;
        const float width =
            ImGui::CalcTextSize(change.title).x + 2.0f * ImGui::GetStyle().FramePadding.x;
        if (!std::exchange(is_first, false)) {
            ImGui::SameLine();
            if (ImGui::GetContentRegionAvail().x < width)
                ImGui::NewLine();
        }
        ui.button(change.title, fmt::format("labels/{}", change.id), order::ChangeLabel{&change});
    }
}

// In front of the buttons by mm, how far; those that are seldom used are folded away.
void draw_label_changes(Widgets& ui, ViewState& state) {
    draw_changes(ui, true, false);
    slide("distance", state.change_label_mm, 0.1, 20.0, "%.2g mm", true);
    ui.note("labels/by");
    draw_changes(ui, true, true);
    const bool is_open = ImGui::TreeNodeEx("more", ImGuiTreeNodeFlags_NoTreePushOnOpen);
    ui.note("labels/more");
    if (!is_open)
        return;
    draw_changes(ui, false, false);
    draw_changes(ui, false, true);
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
        choose_tool(state, kDrawTool);
        panel.sought = {}; // it would leave the new one out
    }
    ImGui::EndDisabled();
    ui.note("labels/new");
    ImGui::SetNextItemWidth(-1.0f);
    ImGui::InputTextWithHint("##find", "find a label", panel.sought.data(), panel.sought.size());
    ui.note("labels/find");
    std::vector<uint32_t> found = all;
    std::erase_if(found, [&](uint32_t label) {
        return !has_part(numbered_name(state.notes, label), panel.sought.data());
    });
    draw_label_list(ui, state, work, found);
    if (ImGui::SmallButton("labels of a file..")) { // in the place of what is there
        state.browser_open = true;
        state.browsing = Browsing::labels;
    }
    ui.note("labels/open");
    draw_label_figures(ui, state, work);
}

// To a file, whose name says what: all labels, or the surface of the one that is chosen.
void draw_label_files_section(Widgets& ui, LabelPanel& panel, ViewState& state, Work& work) {
    name_file(ui, "labels/file", panel.file, "labels.nii.gz", "export", state);
    ImGui::SameLine();
    if (ImGui::Button("export"))
        ui.order(order::ExportLabels{panel.file.data(), panel.each});
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("%s",
                          ".nii.gz, .nrrd, .mha: all labels\n"
                          ".stl, .ply, .obj, .vtp: the surface of the label that is chosen");
    ui.note("labels/export");
    ui.check("surfaces: each label in a file", "labels/each", panel.each);
    draw_result(ui, "labels/result", work.label_export().last(), state);
}

} // namespace palpate::view
