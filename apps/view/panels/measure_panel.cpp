// The list of measures and what they say.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/measure_tool.h"
#include "engine/measure/measure_report.h"

namespace palpate::view {

// Both with the decimals of two digits of the deviation.
static std::string mean_text(double mean, double sd) {
    const int decimals = static_cast<int>(std::clamp(1.0 - std::floor(std::log10(sd)), 0.0, 9.0));
    return fmt::format("{:.{}f} \u00b1 {:.{}f}", mean, decimals, sd, decimals);
}

void draw_values(const ValueStatistics& values, const std::string& unit) {
    if (values.count == 0)
        return;
    if (!ImGui::BeginTable("values", 2, ImGuiTableFlags_SizingFixedFit))
        return;
    const auto line = [](const char* name, const std::string& text) {
        ImGui::TableNextColumn();
        ImGui::TextDisabled("%s", name);
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(text.c_str());
    };
    const std::string u = unit.empty() ? "" : " " + unit;
    line("mean", values.sd > 0.0 ? mean_text(values.mean, values.sd) + u
                                 : fmt::format("{:.5g}{}", values.mean, u));
    line("median", fmt::format("{:.5g}{}", values.median, u));
    line("range", fmt::format("{:.5g} .. {:.5g}{}", values.min, values.max, u));
    line("5 %, 95 %", fmt::format("{:.5g}, {:.5g}", values.p5, values.p95));
    line("samples", values.no_data > 0 ? fmt::format("{}, {} no data", values.count, values.no_data)
                                       : std::to_string(values.count));
    ImGui::EndTable();
}

namespace {

// Draws the selected measure.
void draw_measure(Widgets& ui, ViewState& state, Work& work) {
    Measuring& measuring = state.measuring;
    Measure& measure = state.notes.measures[*measuring.selected];
    ImGui::Separator();
    std::array<char, 128> name{};
    measure.name.copy(name.data(), name.size() - 1);
    if (ImGui::InputText(named("name").c_str(), name.data(), name.size()))
        measure.name = name.data();
    ui.note("measure/name");
    if (const auto measured = work.measured(measure)) {
        const auto line = [](const std::optional<double>& value, const char* unit) {
            if (value)
                ImGui::Text("%.2f %s", *value, unit);
        };
        line(measured->length_mm, measure.kind == MeasureKind::polygon ? "mm perimeter" : "mm");
        line(measured->angle_deg, "degrees");
        line(measured->radius_mm, "mm radius");
        line(measured->area_mm2, "mm\u00b2");
        if (measured->volume_mm3)
            line(*measured->volume_mm3 / 1000.0, "ml");
        if (measured->values)
            draw_values(*measured->values, work.unit());
        if (!measured->note.empty())
            ImGui::TextColored(accent(state), "%s", measured->note.c_str());
    } else {
        ImGui::TextDisabled("measuring ..");
    }
    if (ImGui::Button("delete")) {
        state.notes.measures.erase(state.notes.measures.begin() +
                                   static_cast<ptrdiff_t>(*measuring.selected));
        measuring.selected.reset();
    }
    ui.note("measure/delete");
}

} // namespace

void draw_measure_panel(Widgets& ui, TypedText& file, ViewState& state, Work& work) {
    Measuring& measuring = state.measuring;
    for (const MeasureKind kind :
         {MeasureKind::ruler, MeasureKind::angle, MeasureKind::polygon, MeasureKind::sphere}) {
        if (kind == MeasureKind::angle || kind == MeasureKind::sphere) // two rows of two
            ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
        const bool is_it = state.tool == &kMeasureTool && measuring.kind == kind;
        if (ImGui::RadioButton(name_of(kind), is_it)) {
            choose_tool(state, kMeasureTool);
            measuring.kind = kind;
            measuring.begun.clear();
        }
        ui.note(fmt::format("measure/{}", name_of(kind)));
    }
    hint(state.tool == &kMeasureTool ? placing_of(measuring.kind)
                                     : "M takes the tool into the hand");
    ImGui::Separator();
    if (state.notes.measures.empty())
        ImGui::TextDisabled("nothing measured yet");
    const float rows = static_cast<float>(std::clamp<size_t>(state.notes.measures.size(), 1, 8));
    if (!state.notes.measures.empty() &&
        ImGui::BeginChild("list", ImVec2(0.0f, rows * ImGui::GetTextLineHeightWithSpacing() +
                                                   ImGui::GetStyle().FramePadding.y))) {
        for (size_t i = 0; i < state.notes.measures.size(); ++i) {
            const Measure& measure = state.notes.measures[i];
            ImGui::PushID(static_cast<int>(i));
            if (ImGui::Selectable(listed_name(measure, i).c_str(), measuring.selected == i)) {
                measuring.selected = i;
                move_crosshair(state, work.subject().grid, measure.points_mm.front());
            }
            ui.note(fmt::format("measure/row/{}", i));
            if (const auto measured = work.measured(measure)) {
                const std::string text = headline(*measured);
                ImGui::SameLine(std::max(
                    0.45f * ImGui::GetWindowWidth(),
                    ImGui::GetWindowContentRegionMax().x - ImGui::CalcTextSize(text.c_str()).x));
                ImGui::TextUnformatted(text.c_str());
            }
            ImGui::PopID();
        }
    }
    if (!state.notes.measures.empty())
        ImGui::EndChild();
    if (measuring.selected && *measuring.selected < state.notes.measures.size())
        draw_measure(ui, state, work);
    ImGui::Separator();
    name_file(ui, "measure/file", file, "measures.csv", "export CSV", state);
    ImGui::SameLine();
    ui.button("export CSV", "measure/export", order::ExportMeasures{file.data()});
}

} // namespace palpate::view
