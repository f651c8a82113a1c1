// Segmentation: seeds, a method, and what it found.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/palpate/view/interface.h"
#include "apps/palpate/view/widgets.h"

namespace palpate::view {

void Interface::draw_seed_brush(ViewState& state, std::vector<Order>& orders) {
    constexpr std::pair<const char*, SeedBrush> brushes[] = {{"inside", SeedBrush::inside},
                                                             {"outside", SeedBrush::outside},
                                                             {"erase", SeedBrush::erase}};
    for (const auto& [name, brush] : brushes) {
        if (brush != SeedBrush::inside)
            ImGui::SameLine();
        const bool is_it = state.hand == Hand::seed && state.segmenting.brush == brush;
        if (ImGui::RadioButton(name, is_it)) {
            state.hand = Hand::seed;
            state.segmenting.brush = brush;
        }
        note(fmt::format("segment/{}", name).c_str());
    }
    slide("radius", state.radius_mm, 0.1, 100.0, "%.3g mm", true);
    note("segment/radius");
    int label = state.label;
    if (ImGui::InputInt("label", &label))
        state.label = static_cast<uint16_t>(std::clamp(label, 1, Work::kOutside - 1));
    note("segment/label");
    if (ImGui::Button("clear seeds"))
        orders.push_back({Order::Kind::clear_seeds, {}, time_s_, {}});
    note("segment/clear");
}

// One line a parameter: a box that says whether a person gives it, and its value.
void Interface::draw_parameters(ViewState& state, const SegmentMethod& method) {
    ParameterValues& given = state.segmenting.given[method.name];
    for (const MethodParameter& parameter : method.parameters) {
        ImGui::PushID(parameter.name);
        const auto found = given.find(parameter.name);
        bool is_given = found != given.end();
        const double fallback = std::isnan(parameter.fallback) ? 0.0 : parameter.fallback;
        if (ImGui::Checkbox("##given", &is_given)) {
            if (is_given)
                given[parameter.name] = std::clamp(fallback, parameter.least, parameter.most);
            else
                given.erase(parameter.name);
        }
        note(fmt::format("segment/give/{}", parameter.name).c_str());
        ImGui::SameLine();
        if (is_given) {
            ImGui::SetNextItemWidth(0.35f * ImGui::GetWindowWidth());
            double& value = given[parameter.name];
            if (ImGui::InputDouble("##value", &value, 0.0, 0.0, "%.6g"))
                value = std::clamp(value, parameter.least, parameter.most);
            note(fmt::format("segment/value/{}", parameter.name).c_str());
            ImGui::SameLine();
            ImGui::TextUnformatted(parameter.name);
        } else {
            ImGui::TextUnformatted(parameter.name);
            ImGui::SameLine();
            ImGui::TextDisabled("%s", parameter.fallback_text
                                          ? parameter.fallback_text
                                          : fmt::format("{:g}", fallback).c_str());
        }
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s%s%s", parameter.purpose, *parameter.unit ? "; " : "",
                              parameter.unit);
        ImGui::PopID();
    }
}

// The threshold of what the last method left behind: seen while it is dragged, and taken when it
// is let go.
void Interface::draw_strength(ViewState& state, Work& work, std::vector<Order>& orders) {
    const auto& strength = work.strength();
    if (!strength || state.segmenting.method != strength->method->name)
        return;
    ImGui::TextDisabled("%s", strength->method->strength);
    double at = state.segmenting.preview.value_or(strength->threshold);
    if (slide("bound", at, 0.0, strength->slider_most, "%.4g"))
        state.segmenting.preview = at;
    if (ImGui::IsItemDeactivatedAfterEdit() && state.segmenting.preview) {
        state.segmenting.given[state.segmenting.method]["threshold"] = *state.segmenting.preview;
        state.segmenting.preview.reset();
        orders.push_back({Order::Kind::segment, {}, time_s_, {}});
    }
    note("segment/bound");
}

void Interface::draw_segment_panel(ViewState& state, Work& work, std::vector<Order>& orders) {
    if (ImGui::CollapsingHeader("Seeds", ImGuiTreeNodeFlags_DefaultOpen))
        draw_seed_brush(state, orders);
    if (ImGui::CollapsingHeader("Method", ImGuiTreeNodeFlags_DefaultOpen))
        draw_method(state, work, orders);
    if (ImGui::CollapsingHeader("Mesh", ImGuiTreeNodeFlags_DefaultOpen))
        draw_mesh_pulling(state, work, orders);
    if (!ImGui::CollapsingHeader("Live-wire", ImGuiTreeNodeFlags_DefaultOpen))
        return;
    if (ImGui::RadioButton("contour along edges", state.hand == Hand::wire))
        state.hand = Hand::wire;
    note("segment/wire");
    hint("click in a slice: freeze; Enter or double click: fill with the label");
}

// The mesh of a label, whose faces are pulled, and which becomes the label again.
void Interface::draw_mesh_pulling(ViewState& state, Work& work, std::vector<Order>& orders) {
    const auto button = [&](const char* name, const char* id, Order::Kind kind) {
        const bool pressed = ImGui::Button(name);
        note(fmt::format("mesh/{}", id).c_str());
        if (pressed)
            orders.push_back({kind, {}, time_s_});
        return pressed;
    };
    if (const auto share = work.meshing()) {
        ImGui::ProgressBar(static_cast<float>(*share),
                           ImVec2(0.6f * ImGui::GetWindowWidth(), 0.0f));
        ImGui::SameLine();
        button("cancel##mesh", "cancel", Order::Kind::mesh_drop);
        return;
    }
    if (!work.mesh()) {
        const std::string name = fmt::format("mesh of label {}", state.label);
        if (button(name.c_str(), "make", Order::Kind::mesh_make))
            state.hand = Hand::pull;
        return;
    }
    if (ImGui::RadioButton("pull faces", state.hand == Hand::pull))
        state.hand = Hand::pull;
    note("mesh/pull");
    int reach = static_cast<int>(state.pulling.reach);
    if (ImGui::SliderInt("patch", &reach, 0, 12, "%d faces", ImGuiSliderFlags_AlwaysClamp))
        state.pulling.reach = static_cast<uint32_t>(reach);
    note("mesh/reach");
    button(fmt::format("into label {}", work.mesh()->label()).c_str(), "apply",
           Order::Kind::mesh_apply);
    ImGui::SameLine();
    button("drop", "drop", Order::Kind::mesh_drop);
    hint("drag it in 3D or where a slice cuts it");
}

void Interface::draw_method(ViewState& state, Work& work, std::vector<Order>& orders) {
    if (ImGui::BeginCombo("##method", state.segmenting.method.c_str())) {
        for (const SegmentMethod& method : segment_methods()) {
            if (method.takes_curves)
                continue; // the window has none
            if (ImGui::Selectable(method.name, state.segmenting.method == method.name))
                state.segmenting.method = method.name;
            note(fmt::format("segment/method/{}", method.name).c_str());
            if (ImGui::IsItemHovered())
                ImGui::SetTooltip("%s", method.purpose);
        }
        ImGui::EndCombo();
    }
    note("segment/methods");
    const SegmentMethod* method = find_segment_method(state.segmenting.method);
    if (!method)
        return;
    hint(method->purpose);
    draw_parameters(state, *method);
    if (const auto share = work.segmenting()) {
        ImGui::ProgressBar(static_cast<float>(*share),
                           ImVec2(0.6f * ImGui::GetWindowWidth(), 0.0f));
        ImGui::SameLine();
        if (ImGui::Button("cancel"))
            orders.push_back({Order::Kind::stop_segmenting, {}, time_s_, {}});
        note("segment/cancel");
    } else {
        if (ImGui::Button("segment##run"))
            orders.push_back({Order::Kind::segment, {}, time_s_, {}});
        note("segment/run");
    }
    draw_strength(state, work, orders);
}

} // namespace palpate::view
