// Sections of the task "look": how pictures are shown, and where.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/panels/iso_panel.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/tool.h"
#include "engine/session/default_scene.h"
#include "engine/volume/extent.h"

namespace palpate::view {

void draw_label_looks(Widgets& ui, ViewState& state, bool all) {
    ui.check("shown", "labels/shown", state.labels_shown);
    if (all) {
        ImGui::SameLine();
        ui.check("in 3D", "labels/in_3d", state.labels_in_3d);
        bool smooth = state.label_edges == LabelEdges::smooth;
        ui.check("smooth edges", "labels/edges", smooth);
        state.label_edges = smooth ? LabelEdges::smooth : LabelEdges::voxels;
    }
    slide("opacity", state.label_opacity, 0.0, 1.0, "%.2f");
    ui.note("labels/opacity");
}

void draw_window_section(Widgets& ui, WindowEnds& ends, ViewState& state, Work& work) {
    const Subject& subject = work.subject();
    const double low = subject.range.min, high = std::max(low + 1e-3, double{subject.range.max});
    const double room = high - low;
    drag_ends(ui, ends, "window", {"black", "white"}, state.window,
              std::max(1e-4 * room, are_whole_enough(subject.range) ? 1.0 : 0.0),
              {low - room, high + room}, work);
    state.window = limited(state.window, subject.range);
    for (size_t i = 0; i < subject.windows.size(); ++i) {
        const std::string name = fmt::format("{} {}", i + 1, subject.window_names[i]);
        if (i % 2 == 1)
            ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
        const bool is_chosen = state.window == subject.windows[i];
        ImGui::PushFont(is_chosen ? bold_letters() : ImGui::GetFont());
        const float width = 0.42f * ImGui::GetWindowWidth();
        if (ImGui::Selectable(fitted(name, width).c_str(), is_chosen, 0, ImVec2(width, 0.0f)))
            state.window = subject.windows[i];
        ImGui::PopFont();
        ui.note(fmt::format("window/{}", i + 1));
    }
}

void draw_volume_section(Widgets& ui, ViewState& state, Work& work) {
    Scene scene = work.session().scene();
    bool changed = false;
    if (scene.ray_cast) {
        RayMode mode = scene.ray_cast->mode;
        if (choose<RayMode>(ui, "volume/mode", "mode", mode,
                            {{"shaded", RayMode::alpha},
                             {"maximum", RayMode::mip},
                             {"iso-surface", RayMode::iso}})) {
            scene.ray_cast = default_ray_cast(mode, work.loaded());
            changed = true;
        }
    }
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::alpha) {
        draw_presets(ui, *scene.ray_cast, work, changed);
        ui.note("volume/colours");
    }
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::mip) {
        if (ImGui::Button("as the slices' window")) {
            scene.ray_cast->transfer = grey_of(state);
            changed = true;
        }
        ui.note("volume/as_window");
    }
    draw_iso_panel(ui, state, work);
    ui.check("slices in 3D", "volume/slices", state.slices_in_volume);
    bool is_flat = state.camera.projection == Projection::orthographic;
    if (ImGui::Checkbox("orthographic", &is_flat)) {
        // Things at the target keep their size.
        const double distance = glm::distance(state.camera.eye_mm, state.camera.target_mm);
        const double slope = 2.0 * std::tan(glm::radians(0.5 * state.camera.view_angle_deg));
        if (is_flat)
            state.camera.view_height_mm = distance * slope;
        state.camera.projection = is_flat ? Projection::orthographic : Projection::perspective;
    }
    ui.note("volume/orthographic");
    if (changed)
        work.session().show(std::move(scene));
}

void draw_layout_section(Widgets& ui, ViewState& state) {
    if (choose<Layout>(ui, "layout/views", "views", state.layout,
                       {{"three slices and 3D", Layout::four},
                        {"3D", Layout::volume},
                        {"one slice", Layout::slice}}))
        state.alone.reset();
    if (state.layout == Layout::slice) {
        choose<Panel>(
            ui, "layout/slice", "slice", state.slice,
            {{"axial", Panel::axial}, {"coronal", Panel::coronal}, {"sagittal", Panel::sagittal}});
    }
    ui.check("crosshair", "layout/crosshair", state.crosshair_shown);
    ImGui::SameLine();
    ui.check("notes", "layout/notes", state.notes_shown);
}

void draw_slices_section(Widgets& ui, ViewState& state, Work& work) {
    const double layer = smallest_spacing_mm(work.subject().grid);
    if (slide("thickness", state.slab_mm, 0.0, 100.0 * layer,
              state.slab_mm > 0.0 ? "%.3g mm" : "none"))
        state.slab_mm = layer * std::round(state.slab_mm / layer);
    ui.note("slices/thickness");
    if (state.slab_mm > 0.0) {
        choose(ui, "slices/mode", "of it", state.slab_mode,
               {std::pair("maximum", SlabMode::maximum),
                {"mean", SlabMode::mean},
                {"minimum", SlabMode::minimum}});
    }
    slide("outline", state.outline_px, 0.0, 5.0, "%.0f px");
    ui.note("slices/outline");
    if (ImGui::Button("volume over slices..")) {
        state.browser_open = true;
        state.browsing = Browsing::fused;
    }
    ui.note("slices/open");
    const Scene& scene = work.session().scene();
    if (scene.fusion) {
        slide("fused", state.fusion_opacity, 0.0, 1.0, "%.2f");
        ui.note("slices/fused");
    }
    if (scene.overlay) {
        slide("overlay", state.overlay_opacity, 0.0, 1.0, "%.2f");
        ui.note("slices/overlay");
    }
}

void draw_stereo_section(Widgets& ui, ViewState& state) {
    StereoView& stereo = state.stereo;
    ui.check("both eyes", "stereo/on", stereo.on);
    if (!stereo.on) {
        state.cursor_mm.reset();
        return;
    }
    choose(ui, "stereo/layout", "layout", stereo.layout,
           {std::pair("red and cyan", StereoLayout::anaglyph),
            {"side by side", StereoLayout::side_by_side},
            {"top and bottom", StereoLayout::top_bottom},
            {"rows", StereoLayout::row_interleaved},
            {"columns", StereoLayout::column_interleaved},
            {"checkerboard", StereoLayout::checkerboard},
            {"left eye", StereoLayout::left},
            {"right eye", StereoLayout::right}});
    ui.check("swap eyes", "stereo/swap", stereo.swap_eyes);
    ImGui::SameLine();
    ui.check("mirror", "stereo/mirror", stereo.mirror);
    if (stereo.profile) {
        ImGui::TextDisabled("%s", stereo.profile->name.c_str());
        return;
    }
    double percent = 100.0 * stereo.separation; // of the camera's distance
    if (slide("depth", percent, 0.2, 20.0, "%.1f %%", true))
        stereo.separation = percent / 100.0;
    ui.note("stereo/depth");
}

} // namespace palpate::view
