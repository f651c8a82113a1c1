// A surface of an iso-value or of a label, for print.

#include "apps/view/panels/export_panel.h"

#include <imgui/imgui.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "apps/view/document/free_name.h"
#include "apps/view/panels/widgets.h"
#include "engine/session/default_scene.h"

namespace palpate::view {

namespace {

// The iso-surfaces that the list has, else the value that the hand feels; the label; and skin and
// bone of a CT, where the list does not have them.
std::vector<std::pair<std::string, std::optional<double>>> sources(const ViewState& state,
                                                                   Work& work) {
    std::vector<std::pair<std::string, std::optional<double>>> all;
    const Scene& scene = work.session().scene();
    const bool is_iso = scene.ray_cast && scene.ray_cast->mode == RayMode::iso;
    for (const ListedIso& one :
         is_iso ? followed(state.iso.list, scene.ray_cast->isos) : IsoList()) {
        const std::string value = fmt::format("{:.5g} {}", one.surface.value, work.unit());
        all.emplace_back(one.name.empty() ? value : one.name + ", " + value, one.surface.value);
    }
    if (all.empty()) {
        const double value = work.session().parameters().iso;
        all.emplace_back(fmt::format("{:.5g} {}", value, work.unit()), value);
    }
    if (work.has_labels())
        all.emplace_back("label " + numbered_name(state.notes, state.label), std::nullopt);
    const auto add = [&](const char* name, std::optional<double> value) {
        const auto is_same = [&](const auto& one) { return one.second == value; };
        if (value && std::none_of(all.begin(), all.end(), is_same))
            all.emplace_back(fmt::format("{}, {:.5g} {}", name, *value, work.unit()), value);
    };
    add("skin", skin_value(work.loaded()));
    add("bone", bone_value(work.loaded()));
    return all;
}

void draw_choices(Widgets& ui, ExportSetup& setup, const ViewState& state, Work& work) {
    const auto all = sources(state, work);
    const auto chosen = std::find_if(all.begin(), all.end(), [&](const auto& one) {
        return setup.of_label ? !one.second : one.second == setup.made.iso;
    });
    const auto& now = chosen == all.end() ? all.front() : *chosen;
    setup.of_label = !now.second;
    setup.made.iso = now.second;
    if (ImGui::BeginCombo(named("surface").c_str(), now.first.c_str())) {
        for (size_t i = 0; i < all.size(); ++i) {
            if (ImGui::Selectable(all[i].first.c_str(), &all[i] == &now)) {
                setup.of_label = !all[i].second;
                setup.made.iso = all[i].second;
            }
            ui.note(fmt::format("export/of/{}", i));
        }
        ImGui::EndCombo();
    }
    ui.note("export/of");
    ui.check("largest piece only", "export/largest", setup.made.pieces.largest_only);
    ImGui::BeginDisabled(setup.made.pieces.largest_only); // and the rows below stay where they are
    double least_ml = 1e-3 * setup.made.pieces.least_mm3;
    if (slide("at least", least_ml, 0.0, 100.0, least_ml > 0.0 ? "%.3g ml" : "all", true))
        setup.made.pieces.least_mm3 = 1e3 * least_ml;
    ui.note("export/least");
    ImGui::EndDisabled();
    ImGui::BeginDisabled(state.notes.clip_planes.empty());
    ui.check("cut as in 3D", "export/cut", setup.is_cut);
    ImGui::EndDisabled();
    slide("simplify", setup.made.decimate_mm, 0.0, 2.0,
          setup.made.decimate_mm > 0.0 ? "%.2f mm" : "no");
    ui.note("export/decimate");
    slide("scale", setup.made.scale, 0.05, 4.0, "%.2f", true);
    ui.note("export/scale");
    slide("wall", setup.made.wall_mm, 0.0, 10.0, setup.made.wall_mm > 0.0 ? "%.1f mm" : "solid");
    ui.note("export/wall");
}

} // namespace

std::string surface_file_name(const ExportSetup& setup, const ViewState& state, Work& work) {
    if (setup.of_label) {
        const std::string name = name_of_label(state.notes, state.label);
        return (name.empty() ? fmt::format("label-{}", state.label) : file_word(name)) + ".stl";
    }
    const double value = setup.made.iso.value_or(work.session().parameters().iso);
    for (const ListedIso& one : state.iso.list)
        if (one.surface.value == value && !one.name.empty())
            return file_word(one.name) + ".stl";
    return fmt::format("surface_{:.5g}.stl", value);
}

void draw_export_panel(Widgets& ui, TypedText& file, ViewState& state, Work& work) {
    ExportSetup& setup = state.exporting;
    draw_choices(ui, setup, state, work);
    if (const auto share = work.mesh_writing().share()) {
        ui.progress("export/share", share->share, share->what, "cancel");
        ImGui::SameLine();
        ui.button("cancel", "export/cancel", order::StopMesh{});
        return;
    }
    name_file(ui, "export/file", file, surface_file_name(setup, state, work), "write", state);
    ImGui::SameLine();
    MeshExport wanted = setup.made;
    wanted.label = state.label;
    if (setup.is_cut)
        wanted.within = state.notes.clip_planes;
    ui.button("write", "export/write", order::ExportMesh{wanted, file.data()});
    draw_result(ui, "export/result", work.mesh_writing().last(), state);
}

} // namespace palpate::view
