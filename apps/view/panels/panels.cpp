// The side panel: each section changes the state or the session's scene.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/looks.h"
#include "apps/view/panels/interface.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/tool.h"
#include "engine/session/default_scene.h"

namespace palpate::view {

void Interface::draw_tools(ViewState& state, Work& work, std::vector<Order>& orders) {
    const Box box = places_of(state).tools;
    if (box.size_px.x == 0)
        return;
    ImGui::SetNextWindowPos(
        ImVec2(static_cast<float>(box.low_px.x), static_cast<float>(box.low_px.y)));
    ImGui::SetNextWindowSize(
        ImVec2(static_cast<float>(box.size_px.x), static_cast<float>(box.size_px.y)));
    ImGui::Begin("tools", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                     ImGuiWindowFlags_NoFocusOnAppearing |
                     ImGuiWindowFlags_AlwaysVerticalScrollbar); // else lines move as it comes
    draw_tabs(state);
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
        note("file/zero_hu");
    }
    const auto section = [](const char* name) {
        return ImGui::CollapsingHeader(name, ImGuiTreeNodeFlags_DefaultOpen);
    };
    ImGui::PushItemWidth(-ImGui::CalcTextSize("thickness_").x);
    switch (state.tab) {
        case Tab::view:
            if (section("Tool"))
                draw_hand(state, work, orders);
            if (section("Window"))
                draw_window(state, work);
            if (section("Volume"))
                draw_volume(state, work);
            if (section("Labels"))
                draw_labels(state);
            if (section("Layout"))
                draw_layout(state);
            if (section("Slices"))
                draw_slices(state, work);
            if (section("Stereo"))
                draw_stereo(state);
            break;
        case Tab::transfer:
            draw_transfer(state, work);
            break;
        case Tab::labels:
            draw_labels_panel(state, work, orders);
            break;
        case Tab::segment:
            draw_segment_panel(state, work, orders);
            break;
        case Tab::measure:
            draw_measures_panel(state, work, orders);
            break;
        case Tab::clip:
            draw_clip_panel(state, work);
            break;
        case Tab::file:
            draw_files_panel(state, work, orders);
            break;
    }
    ImGui::PopItemWidth();
    ImGui::End();
}

void Interface::draw_tabs(ViewState& state) {
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
        note(fmt::format("tab/{}", name_of(tab)).c_str());
    }
    ImGui::PopStyleVar();
}

void Interface::draw_hands(ViewState& state) {
    size_t buttons = 0;
    const auto next_column = [&] { // of two
        if (buttons % 2 == 1)
            ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
    };
    for (const Tool* tool : tools()) {
        if (!tool->title)
            continue;
        next_column();
        const std::string name = fmt::format("{}##tool", tool->title); // a tab is named as one is
        if (ImGui::RadioButton(name.c_str(), state.tool == tool))
            state.tool = tool;
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s", fmt::format("{}: {}", key_of(*tool), tool->help).c_str());
        note(fmt::format("tool/{}", tool->name).c_str());
        ++buttons;
    }
    if (state.tool->kind) { // beside the last one
        next_column();
        const std::string kind = state.tool->kind(state);
        const std::string whole = fmt::format("{}: {}", state.tool->title, kind);
        const bool fits = ImGui::CalcTextSize(whole.c_str()).x <= ImGui::GetContentRegionAvail().x;
        ImGui::TextDisabled("%s", (fits ? whole : kind).c_str());
        note("tool/kind");
    }
    slide("radius", state.radius_mm, 0.1, 100.0, "%.3g mm", true);
    note("tool/radius");
}

void Interface::draw_hand(ViewState& state, Work& work, std::vector<Order>& orders) {
    draw_hands(state);
    int label = state.label;
    if (ImGui::InputInt("label", &label))
        state.label = static_cast<uint16_t>(std::clamp(label, 1, 65535));
    note("tool/label");
    const EditState edit = work.edited();
    const auto button = [&](const char* name, bool possible, Order order) {
        ImGui::BeginDisabled(!possible);
        if (ImGui::Button(name))
            orders.push_back(std::move(order));
        ImGui::EndDisabled();
        note(fmt::format("tool/{}", name).c_str());
    };
    button("undo", edit.undo_steps > 0, order::Undo{});
    ImGui::SameLine();
    button("redo", edit.redo_steps > 0, order::Redo{});
    ImGui::SameLine();
    button("save", true, order::Save{});
}

void Interface::draw_window(ViewState& state, Work& work) {
    const Subject& subject = work.subject();
    const double low = subject.range.min, high = std::max(low + 1e-3, double{subject.range.max});
    const double room = high - low;
    drag_ends("window", {"black", "white"}, state.window,
              std::max(1e-4 * room, are_whole_enough(subject.range) ? 1.0 : 0.0),
              {low - room, high + room}, work);
    state.window = limited(state.window, subject.range);
    for (size_t i = 0; i < subject.windows.size(); ++i) {
        const std::string name = fmt::format("{} {}", i + 1, subject.window_names[i]);
        if (i % 2 == 1)
            ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
        if (ImGui::Selectable(name.c_str(), state.window == subject.windows[i], 0,
                              ImVec2(0.42f * ImGui::GetWindowWidth(), 0.0f)))
            state.window = subject.windows[i];
        note(fmt::format("window/{}", i + 1).c_str());
    }
}

// Tells a person about a typed end: that it was beyond its limits, or that the other end, which it
// moved, stopped at its own, so that the width is less than before.
static std::string end_text(std::array<const char*, 2> names, bool upper, double typed,
                            GreyWindow before, GreyWindow now, GreyWindow limits) {
    if (std::isnan(typed))
        return "";
    const std::string of =
        fmt::format("{:g} .. {:g}, the limits of this volume", limits.low, limits.high);
    const double taken = upper ? now.high : now.low;
    if (taken != typed)
        return fmt::format("{} {:g} is beyond {}: {:g} is taken", names[upper ? 1 : 0], typed, of,
                           taken);
    const double moved = upper ? now.low : now.high, was = upper ? before.low : before.high;
    if (moved == was || now.high - now.low > (1.0 - 1e-9) * (before.high - before.low))
        return "";
    return fmt::format("{} stops at {:g}: the limits of this volume are {:g} .. {:g}",
                       names[upper ? 0 : 1], moved, limits.low, limits.high);
}

// Two fields for the ends of a window. A drag stops at the other end; what is typed moves it along.
void Interface::drag_ends(const char* group, std::array<const char*, 2> names, GreyWindow& window,
                          double least, GreyWindow limits, Work& work) {
    const ValueRange range = work.subject().range;
    const auto speed = static_cast<float>(std::max(1e-3, double{range.max} - range.min) / 2000.0);
    for (const bool upper : {false, true}) {
        double value = upper ? window.high : window.low;
        const double from = upper ? window.low + least : limits.low;
        const double to = upper ? limits.high : window.high - least;
        const char* name = names[upper ? 1 : 0];
        const bool changed = ImGui::DragScalar(name, ImGuiDataType_Double, &value, speed, &from,
                                               &to, are_whole_enough(range) ? "%.0f" : "%.5g");
        if (ImGui::IsItemActivated())
            ends_before_ = window;
        if (changed) {
            // Uses the window before the first digit: those before the last one moved the other.
            window = upper ? with_high(ends_before_, value, least, limits)
                           : with_low(ends_before_, value, least, limits);
            clamped_ = end_text(names, upper, value, ends_before_, window, limits);
        }
        if (ImGui::IsItemDeactivated() && !clamped_.empty())
            work.tell(std::exchange(clamped_, {}));
        note(fmt::format("{}/{}", group, name).c_str());
    }
}

void Interface::draw_volume(ViewState& state, Work& work) {
    Scene scene = work.session().scene();
    bool changed = false;
    if (scene.ray_cast) {
        RayMode mode = scene.ray_cast->mode;
        if (choose<RayMode>("mode", mode,
                            {{"shaded", RayMode::alpha},
                             {"maximum", RayMode::mip},
                             {"iso-surface", RayMode::iso}})) {
            scene.ray_cast = default_ray_cast(mode, work.loaded());
            changed = true;
        }
        note("volume/mode");
    }
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::alpha) {
        draw_presets(*scene.ray_cast, work, changed);
        note("volume/colours");
    }
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::mip) {
        if (ImGui::Button("as the slices' window")) {
            scene.ray_cast->transfer = grey_of(state);
            changed = true;
        }
        note("volume/as_window");
    }
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::iso) {
        double iso = scene.ray_cast->isos.front().value;
        if (slide("iso", iso, work.subject().range.min, work.subject().range.max, "%.5g")) {
            auto& isos = scene.ray_cast->isos;
            isos.front().value = isos.size() > 1 ? std::min(iso, isos[1].value) : iso;
            work.session().set_iso(isos.front().value);
        }
        note("volume/iso");
    }
    ImGui::Checkbox("slices in 3D", &state.slices_in_volume);
    note("volume/slices");
    bool is_flat = state.camera.projection == Projection::orthographic;
    if (ImGui::Checkbox("orthographic", &is_flat)) {
        // Things at the target keep their size.
        const double distance = glm::distance(state.camera.eye_mm, state.camera.target_mm);
        const double slope = 2.0 * std::tan(glm::radians(0.5 * state.camera.view_angle_deg));
        if (is_flat)
            state.camera.view_height_mm = distance * slope;
        state.camera.projection = is_flat ? Projection::orthographic : Projection::perspective;
    }
    note("volume/orthographic");
    if (changed)
        work.session().show(std::move(scene));
}

void Interface::draw_labels(ViewState& state) {
    ImGui::Checkbox("shown", &state.labels_shown);
    note("labels/shown");
    slide("opacity", state.label_opacity, 0.0, 1.0, "%.2f");
    note("labels/opacity");
}

void Interface::draw_layout(ViewState& state) {
    if (choose<Layout>("views", state.layout,
                       {{"three slices and 3D", Layout::four},
                        {"3D", Layout::volume},
                        {"one slice", Layout::slice}}))
        state.alone.reset();
    note("layout/views");
    if (state.layout == Layout::slice) {
        choose<Panel>(
            "slice", state.slice,
            {{"axial", Panel::axial}, {"coronal", Panel::coronal}, {"sagittal", Panel::sagittal}});
        note("layout/slice");
    }
    ImGui::Checkbox("crosshair", &state.crosshair_shown);
    note("layout/crosshair");
    ImGui::SameLine();
    ImGui::Checkbox("notes", &state.notes_shown);
    note("layout/notes");
}

} // namespace palpate::view
