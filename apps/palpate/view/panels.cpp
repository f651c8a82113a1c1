// The side panel: each section changes the state or the session's scene.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/palpate/view/interface.h"
#include "engine/scene/presets.h"
#include "engine/session/default_scene.h"

namespace palpate::view {

namespace {

template <class Choice>
bool choose(const char* id, Choice& now,
            std::initializer_list<std::pair<const char*, Choice>> all) {
    const char* shown = "";
    for (const auto& [name, value] : all)
        if (value == now)
            shown = name;
    bool changed = false;
    if (ImGui::BeginCombo(id, shown)) {
        for (const auto& [name, value] : all)
            if (ImGui::Selectable(name, value == now)) {
                now = value;
                changed = true;
            }
        ImGui::EndCombo();
    }
    return changed;
}

bool slide(const char* id, double& value, double low, double high, const char* format,
           bool logarithmic = false) {
    return ImGui::SliderScalar(
        id, ImGuiDataType_Double, &value, &low, &high, format,
        ImGuiSliderFlags_AlwaysClamp | (logarithmic ? ImGuiSliderFlags_Logarithmic : 0));
}

} // namespace

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
                     ImGuiWindowFlags_NoFocusOnAppearing);
    ImGui::TextUnformatted(work.title().c_str());
    const glm::uvec3 size = work.subject().grid.size;
    const glm::dvec3 spacing = spacing_mm(work.subject().grid);
    ImGui::TextDisabled("%u x %u x %u, %.3g x %.3g x %.3g mm", size.x, size.y, size.z, spacing.x,
                        spacing.y, spacing.z);
    const auto section = [](const char* name) {
        return ImGui::CollapsingHeader(name, ImGuiTreeNodeFlags_DefaultOpen);
    };
    ImGui::PushItemWidth(-ImGui::CalcTextSize("thickness_").x);
    if (section("Tool"))
        draw_hand(state, work, orders);
    if (section("Window"))
        draw_window(state, work);
    if (section("Volume"))
        draw_volume(state, work);
    if (section("Labels"))
        draw_labels(state, work);
    if (section("Layout"))
        draw_layout(state);
    ImGui::PopItemWidth();
    ImGui::End();
}

void Interface::draw_hand(ViewState& state, Work& work, std::vector<Order>& orders) {
    for (const Hand hand : {Hand::crosshair, Hand::draw, Hand::erase, Hand::cut}) {
        if (hand == Hand::draw || hand == Hand::cut) // two rows of two
            ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
        if (ImGui::RadioButton(name_of(hand), state.hand == hand))
            state.hand = hand;
        note(fmt::format("tool/{}", name_of(hand)).c_str());
    }
    slide("radius", state.radius_mm, 0.1, 100.0, "%.3g mm", true);
    note("tool/radius");
    int label = state.label;
    if (ImGui::InputInt("label", &label))
        state.label = static_cast<uint16_t>(std::clamp(label, 1, 255));
    note("tool/label");
    const EditState edit = work.edited();
    const auto button = [&](const char* name, bool possible, Order::Kind kind) {
        ImGui::BeginDisabled(!possible);
        if (ImGui::Button(name))
            orders.push_back({kind, {}, time_s_, {}});
        ImGui::EndDisabled();
        note(fmt::format("tool/{}", name).c_str());
    };
    button("undo", edit.undo_steps > 0, Order::Kind::undo);
    ImGui::SameLine();
    button("redo", edit.redo_steps > 0, Order::Kind::redo);
    ImGui::SameLine();
    button("save", true, Order::Kind::save);
}

void Interface::draw_window(ViewState& state, Work& work) {
    const Subject& subject = work.subject();
    const double low = subject.range.min, high = std::max(low + 1e-3, double{subject.range.max});
    const float speed = static_cast<float>((high - low) / 2000.0);
    const auto drag = [&](const char* id, double& value, double least, double most) {
        ImGui::DragScalar(id, ImGuiDataType_Double, &value, speed, &least, &most, "%.5g",
                          ImGuiSliderFlags_AlwaysClamp);
    };
    const double least = 1e-4 * (high - low), room = high - low;
    drag("black", state.window.low, low - room, state.window.high - least);
    note("window/black");
    drag("white", state.window.high, state.window.low + least, high + room);
    note("window/white");
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
        if (ImGui::BeginCombo("colours", "presets")) {
            for (const std::string_view name : preset_names())
                if (ImGui::Selectable(std::string(name).c_str())) {
                    scene.ray_cast->transfer =
                        fitted(*preset(name), std::string(name), work.loaded());
                    changed = true;
                }
            ImGui::EndCombo();
        }
        note("volume/colours");
    }
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::mip) {
        if (ImGui::Button("as the slices' window")) {
            scene.ray_cast->transfer = window_function(state.window.low, state.window.high, 1.0);
            changed = true;
        }
        note("volume/as_window");
    }
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::iso) {
        double iso = scene.ray_cast->isos.front().value;
        if (slide("iso", iso, work.subject().range.min, work.subject().range.max, "%.5g")) {
            scene.ray_cast->isos.front().value = iso;
            std::stable_sort(scene.ray_cast->isos.begin(), scene.ray_cast->isos.end(),
                             [](const auto& a, const auto& b) { return a.value < b.value; });
            changed = true;
        }
        note("volume/iso");
    }
    ImGui::Checkbox("slices in 3D", &state.slices_in_volume);
    note("volume/slices");
    bool is_flat = state.camera.projection == Projection::orthographic;
    if (ImGui::Checkbox("orthographic", &is_flat)) {
        // What lies at the target keeps its size.
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

void Interface::draw_labels(ViewState& state, Work& work) {
    ImGui::Checkbox("shown", &state.labels_shown);
    note("labels/shown");
    slide("opacity", state.label_opacity, 0.0, 1.0, "%.2f");
    note("labels/opacity");
    const std::vector<LabelName>& names = work.loaded().label_names;
    Scene scene = work.session().scene();
    if (!scene.labels)
        return;
    bool changed = false;
    const auto row = [&](uint32_t label) {
        LabelStyle style = style_of(*scene.labels, label);
        ImGui::PushID(static_cast<int>(label));
        bool visible = style.visible;
        if (ImGui::Checkbox("##visible", &visible)) {
            auto& styles = scene.labels->styles;
            while (styles.size() <= label)
                styles.push_back(style_of(*scene.labels, static_cast<uint32_t>(styles.size())));
            styles[label].visible = visible;
            changed = true;
        }
        note(fmt::format("labels/visible/{}", label).c_str());
        ImGui::SameLine();
        ImGui::ColorButton(
            "##color",
            ImVec4(static_cast<float>(style.color.x), static_cast<float>(style.color.y),
                   static_cast<float>(style.color.z), 1.0f),
            ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoDragDrop);
        ImGui::SameLine();
        if (ImGui::Selectable(work.name_of_label(label).c_str(), state.label == label) &&
            label <= 65535)
            state.label = static_cast<uint16_t>(label);
        ImGui::PopID();
    };
    if (names.empty()) {
        row(state.label);
    } else if (ImGui::BeginChild("names",
                                 ImVec2(0.0f, 8.0f * ImGui::GetFrameHeightWithSpacing()))) {
        for (const LabelName& name : names)
            if (name.label > 0)
                row(name.label);
        ImGui::EndChild();
    }
    if (changed)
        work.session().show(std::move(scene));
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
