// The list of iso-surfaces: value, colour, opacity, name, and whether each is shown.

#include "apps/view/panels/iso_panel.h"

#include <imgui/imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "apps/view/panels/widgets.h"
#include "engine/session/default_scene.h"

namespace palpate::view {

namespace {

// Skin can be seen through, and bone is seen behind it.
constexpr double kSkinOpacity = 0.35, kOpacityOfMore = 0.5;

// Skin and bone, in the place of what is listed.
bool take_skin_and_bone(Widgets& ui, IsoList& list, Work& work) {
    const std::optional<double> skin = skin_value(work.loaded()), bone = bone_value(work.loaded());
    if (!skin || !bone) {
        ui.order(
            order::Tell{"skin and bone: expected a CT, found values that are not known to be "
                        "Hounsfield units: add surfaces by their values"});
        return false;
    }
    list = {{{*skin, surface_color(1), kSkinOpacity}, "skin"},
            {{*bone, surface_color(0), 1.0}, "bone"}};
    ui.order(order::Tell{"skin and bone: drawing the surfaces .."});
    return true;
}

void add_value(Widgets& ui, IsoList& list, double value) {
    if (!add_iso(list, {{value, surface_color(list.size()), kOpacityOfMore}}))
        ui.order(order::Tell{fmt::format("at most {} surfaces are listed", kMostListed)});
}

// Returns whether the row is to go.
bool draw_row(Widgets& ui, IsoList& list, size_t number, const ViewState& state, const Work& work,
              bool& changed) {
    const ValueRange range = work.subject().range;
    ListedIso& one = list[number];
    const auto id = [&](const char* part) { return fmt::format("iso/row/{}/{}", number, part); };
    ImGui::PushID(static_cast<int>(number));
    const size_t shown = shown_surfaces(list).size();
    bool is_shown = one.shown;
    // One stays, and no more than the renderer takes.
    ImGui::BeginDisabled(is_shown ? shown <= 1 : shown >= kMaxIsos);
    if (draw_row_switch(ui, id("shown"), RowSwitch::shown,
                        {"hidden: a click shows it",
                         shown <= 1 ? "shown: one surface always is" : "shown: a click hides it"},
                        is_shown, state)) {
        one.shown = is_shown;
        changed = true;
    }
    ImGui::EndDisabled();
    ImGui::SameLine(0.0f, 0.0f);
    changed |= pick_color(ui, id("color"), "colour of the surface", one.surface.color, nullptr);
    ImGui::SameLine();
    const float button = ImGui::CalcTextSize("remove").x + 2.0f * ImGui::GetStyle().FramePadding.x;
    ImGui::SetNextItemWidth(std::max(
        20.0f, ImGui::GetContentRegionAvail().x - button - ImGui::GetStyle().ItemSpacing.x));
    std::array<char, 64> name{};
    one.name.copy(name.data(), name.size() - 1);
    if (ImGui::InputTextWithHint("##name", "name", name.data(), name.size())) {
        one.name = name.data();
        changed = true;
    }
    ui.note(id("name"));
    ImGui::SameLine();
    ImGui::BeginDisabled(one.shown && shown <= 1);
    const bool goes = ImGui::SmallButton("remove");
    ImGui::EndDisabled();
    ui.note(id("remove"));
    const float half = 0.5f * (ImGui::GetContentRegionAvail().x - ImGui::GetStyle().ItemSpacing.x);
    ImGui::SetNextItemWidth(half);
    const double low = range.min, high = std::max(low + 1e-3, double{range.max});
    const std::string format = fmt::format("%.5g {}", work.unit());
    double value = one.surface.value;
    if (ImGui::DragScalar("##value", ImGuiDataType_Double, &value,
                          static_cast<float>(high - low) / 1000.0f, &low, &high, format.c_str(),
                          ImGuiSliderFlags_AlwaysClamp)) {
        while (value != one.surface.value && is_listed(list, value))
            value = std::nextafter(value, value < one.surface.value ? -HUGE_VAL : HUGE_VAL);
        one.surface.value = value;
        changed = true;
    }
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip(
            "the surface lies where values pass this one: drag, or type by Ctrl+click");
    ui.note(id("value"));
    ImGui::SameLine();
    ImGui::SetNextItemWidth(half);
    changed |= slide("##opacity", one.surface.opacity, 0.01, 1.0, "%.2f");
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("opacity of the surface: at 1 nothing is seen through it");
    ui.note(id("opacity"));
    ImGui::PopID();
    return goes;
}

// The list as the scene's surfaces. Where the hand felt the first of them, it feels the one that is
// first now, or, of another scene, what it felt before.
void show_list(const IsoList& list, Work& work) {
    Scene scene = work.session().scene();
    const double felt = work.session().parameters().iso;
    const bool was_iso = scene.ray_cast && scene.ray_cast->mode == RayMode::iso;
    const bool follows = was_iso && scene.ray_cast->isos.front().value == felt;
    if (!was_iso)
        scene.ray_cast = default_ray_cast(RayMode::iso, work.loaded());
    scene.ray_cast->isos = shown_surfaces(list);
    const std::vector<IsoSurface> isos = scene.ray_cast->isos;
    work.session().show(std::move(scene));
    const bool is_there = std::any_of(isos.begin(), isos.end(),
                                      [&](const IsoSurface& iso) { return iso.value == felt; });
    if (follows && !is_there)
        work.session().set_iso(isos.front().value);
}

} // namespace

void draw_iso_panel(Widgets& ui, ViewState& state, Work& work) {
    IsoEditing& editing = state.iso;
    const Scene& scene = work.session().scene();
    const bool is_iso = scene.ray_cast && scene.ray_cast->mode == RayMode::iso;
    if (is_iso)
        editing.list = followed(std::move(editing.list), scene.ray_cast->isos);
    bool changed = false;
    if (ImGui::Button("skin and bone"))
        changed = take_skin_and_bone(ui, editing.list, work) || changed;
    ui.note("iso/skin_and_bone");
    if (is_iso) {
        ImGui::SameLine();
        if (ImGui::Button("add")) {
            const ValueRange range = work.subject().range;
            add_value(ui, editing.list,
                      bone_value(work.loaded()).value_or(0.5 * (double{range.min} + range.max)));
            changed = true;
        }
        ui.note("iso/add");
        ImGui::SameLine();
        if (ImGui::Button(editing.pointing ? "click in a slice .." : "point"))
            editing.pointing = !editing.pointing;
        ui.note("iso/point");
        size_t gone = editing.list.size();
        for (size_t i = 0; i < editing.list.size(); ++i)
            if (draw_row(ui, editing.list, i, state, work, changed))
                gone = i;
        if (gone < editing.list.size()) {
            editing.list.erase(editing.list.begin() + static_cast<ptrdiff_t>(gone));
            changed = true;
        }
    }
    if (const std::optional<double> picked = std::exchange(editing.picked, std::nullopt)) {
        add_value(ui, editing.list, *picked);
        changed = true;
    }
    if (changed)
        show_list(editing.list, work);
}

} // namespace palpate::view
