// The transfer function over the histogram of the values.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/panels/panels.h"
#include "engine/scene/presets.h"
#include "engine/session/default_scene.h"
#include "engine/session/feel.h"

namespace palpate::view {

namespace {

ImU32 im_color(glm::dvec3 color, double alpha = 1.0) {
    return ImGui::ColorConvertFloat4ToU32(
        ImVec4(static_cast<float>(color.x), static_cast<float>(color.y),
               static_cast<float>(color.z), static_cast<float>(alpha)));
}

constexpr ImU32 kFrame = IM_COL32(110, 110, 110, 255), kBack = IM_COL32(22, 22, 24, 255),
                kCounts = IM_COL32(78, 84, 96, 255), kCurve = IM_COL32(235, 235, 225, 255),
                kIso = IM_COL32(255, 160, 70, 255), kEdge = IM_COL32(0, 0, 0, 255);

struct Drawing {
    ImDrawList& list;
    const TransferPlot& plot;

    double left() const { return plot.box.low_px.x; }
    double right() const { return plot.box.low_px.x + plot.box.size_px.x; }
    double foot() const { return plot.box.low_px.y + plot.box.size_px.y; }

    void frame(const Box& box) const {
        list.AddRect(to_im(glm::dvec2(box.low_px)), to_im(glm::dvec2(box.low_px + box.size_px)),
                     kFrame);
    }
    // One bar a pixel: the counts of all bins in it.
    void counts(const Figures::Known& known, bool log_counts) const {
        if (known.histogram.empty())
            return;
        const auto bins = static_cast<double>(known.histogram.size());
        const double bin = (known.high - known.low) / bins;
        std::vector<double> heights;
        for (int x = 0; x < plot.box.size_px.x; ++x) {
            const double v = plot.value_at(left() + x), w = plot.value_at(left() + x + 1);
            const double first = std::floor((v - known.low) / bin),
                         last = std::floor((w - known.low) / bin);
            double most = 0.0;
            for (double i = std::max(first, 0.0); i <= std::min(last, bins - 1.0); ++i)
                most = std::max(most, static_cast<double>(known.histogram[static_cast<size_t>(i)]));
            heights.push_back(log_counts ? std::log1p(most) : most);
        }
        std::vector<double> sorted = heights; // one bin of air would hide the rest
        std::sort(sorted.begin(), sorted.end());
        const double top =
            log_counts
                ? sorted.back()
                : 1.2 * sorted[static_cast<size_t>(0.98 * static_cast<double>(sorted.size() - 1))];
        for (size_t x = 0; x < heights.size() && top > 0.0; ++x) {
            const double h = std::min(heights[x] / top, 1.0) * (plot.box.size_px.y - 2);
            if (h >= 0.5)
                list.AddRectFilled(to_im({left() + static_cast<double>(x), foot() - h}),
                                   to_im({left() + static_cast<double>(x) + 1.0, foot()}), kCounts);
        }
    }
    void curve(const TransferFunction& function, const std::optional<TransferPoint>& chosen) const {
        const auto& points = function.opacities;
        const auto place = [&](size_t i) {
            return glm::dvec2(plot.x_of(points[i].value), plot.y_of(points[i].opacity)) + 0.5;
        };
        list.AddLine(to_im({left(), place(0).y}), to_im(place(0)), kCurve, 1.5f);
        for (size_t i = 0; i + 1 < points.size(); ++i)
            list.AddLine(to_im(place(i)), to_im(place(i + 1)), kCurve, 1.5f);
        list.AddLine(to_im(place(points.size() - 1)), to_im({right(), place(points.size() - 1).y}),
                     kCurve, 1.5f);
        for (size_t i = 0; i < points.size(); ++i) {
            const bool is_chosen = chosen == TransferPoint{TransferPoint::Of::opacity, i};
            list.AddCircleFilled(to_im(place(i)), 5.0f, is_chosen ? kMarkChosen : kEdge);
            list.AddCircleFilled(to_im(place(i)), 3.5f,
                                 im_color(color_at(function, points[i].value)));
            list.AddCircle(to_im(place(i)), 4.5f, is_chosen ? kMarkChosen : kCurve);
        }
    }
    void colors(const TransferFunction& function,
                const std::optional<TransferPoint>& chosen) const {
        const double y = plot.bar.low_px.y, end = y + plot.bar.size_px.y;
        for (int x = 0; x < plot.bar.size_px.x; ++x)
            list.AddRectFilled(to_im({left() + x, y}), to_im({left() + x + 1.0, end}),
                               im_color(color_at(function, plot.value_at(left() + x))));
        for (size_t i = 0; i < function.colors.size(); ++i) {
            const double at = plot.x_of(function.colors[i].value) + 0.5;
            const bool is_chosen = chosen == TransferPoint{TransferPoint::Of::color, i};
            const ImVec2 a = to_im({at, y + 2.0}), b = to_im({at - 5.0, end + 5.0}),
                         c = to_im({at + 5.0, end + 5.0});
            list.AddTriangleFilled(a, b, c, im_color(function.colors[i].color));
            list.AddTriangle(a, b, c, is_chosen ? kMarkChosen : kCurve, is_chosen ? 2.0f : 1.0f);
        }
    }
    void isos(const std::vector<double>& values, const std::optional<TransferPoint>& chosen) const {
        for (size_t i = 0; i < values.size(); ++i) {
            const double at = plot.x_of(values[i]) + 0.5, y = plot.box.low_px.y;
            const bool is_chosen = chosen == TransferPoint{TransferPoint::Of::iso, i};
            const ImU32 color = is_chosen ? kMarkChosen : kIso;
            list.AddLine(to_im({at, y}), to_im({at, foot()}), color, 1.0f);
            list.AddTriangleFilled(to_im({at - 5.0, y}), to_im({at + 5.0, y}), to_im({at, y + 9.0}),
                                   color);
        }
    }
};

// Colours by value with opacity as their share over dark grey: a preset's picture.
void draw_swatch(ImDrawList& list, ImVec2 low, ImVec2 size, const TransferFunction& function) {
    const std::vector<double> all = knots(function);
    const double from = all.front(), to = std::max(all.back(), from + 1e-9);
    for (float x = 0.0f; x < size.x; x += 1.0f) {
        const double value = from + double{x} / double{size.x} * (to - from);
        const double share = std::sqrt(std::min(opacity_at(function, value), 1.0));
        list.AddRectFilled(ImVec2(low.x + x, low.y), ImVec2(low.x + x + 1.0f, low.y + size.y),
                           im_color(glm::mix(glm::dvec3(0.1), color_at(function, value), share)));
    }
}

// Numbers and colour of the point that is chosen.
void draw_chosen_point(Widgets& ui, ViewState& state, Work& work, TransferFunction& function,
                       std::vector<double>& isos, RayCastLayer& layer, bool& changed,
                       bool& isos_changed) {
    const std::optional<TransferPoint>& chosen = state.transfer.chosen;
    if (!chosen)
        return;
    const ValueRange range = work.subject().range;
    const float speed = std::max(1e-6f, (range.max - range.min) / 2000.0f);
    const GreyWindow reach = limited({-INFINITY, INFINITY}, range);
    const auto drag = [&](const char* id, double& value) {
        const bool moved =
            ImGui::DragScalar(named(id).c_str(), ImGuiDataType_Double, &value, speed, &reach.low,
                              &reach.high, "%.5g", ImGuiSliderFlags_AlwaysClamp);
        ui.note(fmt::format("transfer/{}", id));
        return moved;
    };
    const auto color_edit = [&](glm::dvec3& color) {
        float rgb[] = {static_cast<float>(color.x), static_cast<float>(color.y),
                       static_cast<float>(color.z)};
        const bool edited =
            ImGui::ColorEdit3(named("colour").c_str(), rgb, ImGuiColorEditFlags_Float);
        ui.note("transfer/colour");
        if (edited)
            color =
                glm::clamp(glm::dvec3(rgb[0], rgb[1], rgb[2]), glm::dvec3(0.0), glm::dvec3(1.0));
        return edited;
    };
    const size_t number = chosen->number;
    if (chosen->of == TransferPoint::Of::opacity && number < function.opacities.size()) {
        auto point = function.opacities[number];
        bool moved = drag("value", point.value);
        moved |= slide("opacity", point.opacity, 0.0, 1.0, "%.3f");
        ui.note("transfer/opacity");
        if (moved)
            move_opacity(function, number, point.value, point.opacity);
        changed |= moved;
    } else if (chosen->of == TransferPoint::Of::color && number < function.colors.size()) {
        double value = function.colors[number].value;
        if (drag("value", value)) {
            move_color(function, number, value);
            changed = true;
        }
        changed |= color_edit(function.colors[number].color);
    } else if (chosen->of == TransferPoint::Of::iso && number < isos.size()) {
        isos_changed |= drag("value", isos[number]);
        if (layer.mode == RayMode::iso) {
            IsoSurface& iso = layer.isos[number];
            color_edit(iso.color);
            slide("opacity", iso.opacity, 0.01, 1.0, "%.2f");
            ui.note("transfer/opacity");
        } else {
            ImGui::TextDisabled("solid to the hand from here on");
        }
    }
}

// One function for eye and hand, or an iso-value for the hand.
void draw_felt(Widgets& ui, Work& work, const TransferFunction& function) {
    haptics::TouchParameters parameters = work.session().parameters();
    bool is_felt = parameters.opacity.point_count > 0;
    if (ImGui::Checkbox("the hand feels it", &is_felt)) {
        double most = 0.0;
        for (const auto& point : function.opacities)
            most = std::max(most, point.opacity);
        parameters.opacity = is_felt ? opacity_to_touch(function) : haptics::HapticTransfer{};
        parameters.iso = is_felt ? 0.5 * most : default_iso(work.loaded());
        work.session().feel(parameters);
    }
    ui.note("transfer/felt");
}

} // namespace

void draw_presets(Widgets& ui, RayCastLayer& layer, Work& work, bool& changed) {
    if (!ImGui::BeginCombo(named("colours").c_str(), "presets"))
        return;
    const float height = ImGui::GetTextLineHeight();
    for (const std::string_view name : preset_names()) {
        const ImVec2 at = ImGui::GetCursorScreenPos();
        if (ImGui::Selectable(fmt::format("##{}", name).c_str())) {
            layer.transfer = fitted(*preset(name), std::string(name), work.loaded());
            changed = true;
        }
        ui.note(fmt::format("preset/{}", name));
        draw_swatch(*ImGui::GetWindowDrawList(), at, ImVec2(4.0f * height, height), *preset(name));
        ImGui::SameLine(4.6f * height);
        ImGui::TextUnformatted(std::string(name).c_str());
    }
    ImGui::EndCombo();
}

void draw_transfer_panel(Widgets& ui, ViewState& state, Work& work) {
    TransferEditing& editing = state.transfer;
    Scene scene = work.session().scene();
    if (!scene.ray_cast || scene.ray_cast->transfer.colors.empty()) {
        ImGui::TextWrapped("Nothing is drawn by rays: choose a mode above.");
        return;
    }
    RayCastLayer& layer = *scene.ray_cast;
    TransferFunction function = layer.transfer;
    const bool is_iso = layer.mode == RayMode::iso;
    std::vector<double> isos;
    if (is_iso)
        for (const IsoSurface& iso : layer.isos)
            isos.push_back(iso.value);
    else if (work.session().parameters().opacity.point_count == 0)
        isos.push_back(work.session().parameters().iso);

    const ValueRange range = work.subject().range;
    const double least = range.min, most = std::max(least + 1e-3, double{range.max});
    const bool is_whole = !(editing.low < editing.high);
    const float scale = static_cast<float>(state.text_scale);
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const auto width = static_cast<int>(ImGui::GetContentRegionAvail().x);
    const int height = static_cast<int>(150.0f * scale), bar = static_cast<int>(14.0f * scale);
    const glm::ivec2 low(static_cast<int>(at.x), static_cast<int>(at.y));
    TransferPlot plot{{low, {width, height}},
                      {{low.x, low.y + height + 2}, {width, bar}},
                      is_whole ? least : editing.low,
                      is_whole ? most : editing.high};

    const ImVec2 pointer = ImGui::GetIO().MousePos;
    const glm::dvec2 px(pointer.x, pointer.y);
    ImGui::InvisibleButton(
        "plot", ImVec2(static_cast<float>(width), static_cast<float>(height + bar) + 8.0f * scale),
        ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
    ui.note("transfer/plot");
    const double value = plot.value_at(px.x), opacity = plot.opacity_at(px.y);
    bool changed = false, isos_changed = false;
    if (ImGui::IsItemClicked(ImGuiMouseButton_Left)) {
        editing.chosen = point_under(plot, function, isos, px);
        const bool in_bar = px.y >= plot.bar.low_px.y;
        if (!editing.chosen && in_bar) {
            editing.chosen = {TransferPoint::Of::color, add_color(function, value)};
            changed = true;
        } else if (!editing.chosen && !is_iso) {
            editing.chosen = {TransferPoint::Of::opacity, add_opacity(function, value, opacity)};
            changed = true;
        } else if (!editing.chosen && isos.size() < kMaxIsos) {
            editing.chosen = {TransferPoint::Of::iso, isos.size()};
            layer.isos.push_back({value, surface_color(isos.size()), 0.35});
            isos.push_back(value);
            isos_changed = true;
        }
        editing.is_dragged = editing.chosen.has_value();
    }
    if (!ImGui::IsItemActive())
        editing.is_dragged = false;
    if (editing.is_dragged && ImGui::IsMouseDown(ImGuiMouseButton_Left) &&
        (ImGui::GetIO().MouseDelta.x != 0.0f || ImGui::GetIO().MouseDelta.y != 0.0f)) {
        const size_t number = editing.chosen->number;
        const double within = std::clamp(value, plot.low, plot.high);
        if (editing.chosen->of == TransferPoint::Of::opacity) {
            move_opacity(function, number, within, opacity);
            changed = true;
        } else if (editing.chosen->of == TransferPoint::Of::color) {
            move_color(function, number, within);
            changed = true;
        } else {
            isos[number] = within;
            isos_changed = true;
        }
    }
    const auto remove = [&](TransferPoint point) {
        if (point.of != TransferPoint::Of::iso) {
            changed |= remove_point(function, point);
        } else if (is_iso && isos.size() > 1) {
            isos.erase(isos.begin() + static_cast<ptrdiff_t>(point.number));
            layer.isos.erase(layer.isos.begin() + static_cast<ptrdiff_t>(point.number));
            isos_changed = true;
        }
        editing.chosen.reset();
        editing.is_dragged = false;
    };
    if (ImGui::IsItemClicked(ImGuiMouseButton_Right))
        if (const auto under = point_under(plot, function, isos, px))
            remove(*under);

    ImDrawList& list = *ImGui::GetWindowDrawList();
    const Drawing draw{list, plot};
    list.AddRectFilled(to_im(glm::dvec2(plot.box.low_px)), to_im({draw.right(), draw.foot()}),
                       kBack);
    list.PushClipRect(to_im(glm::dvec2(low) - 6.0),
                      to_im({draw.right() + 6.0, draw.foot() + bar + 12.0}), true);
    draw.counts(*work.figures().known(), editing.log_counts);
    draw.curve(function, editing.chosen);
    draw.colors(function, editing.chosen);
    draw.isos(isos, editing.chosen);
    draw.frame(plot.box);
    list.PopClipRect();
    ImGui::TextDisabled("%.5g", plot.low);
    const std::string end = fmt::format("{:.5g} {}", plot.high, work.unit());
    ImGui::SameLine(static_cast<float>(width) - ImGui::CalcTextSize(end.c_str()).x);
    ImGui::TextDisabled("%s", end.c_str());

    draw_chosen_point(ui, state, work, function, isos, layer, changed, isos_changed);
    if (editing.chosen) {
        if (ImGui::Button("remove point"))
            remove(*editing.chosen);
        ui.note("transfer/remove");
    }
    ui.check("log counts", "transfer/log", editing.log_counts);
    double ends[] = {plot.low, plot.high};
    const float speed = static_cast<float>((most - least) / 1000.0);
    if (ImGui::DragScalarN(named("values").c_str(), ImGuiDataType_Double, ends, 2, speed, &least,
                           &most, "%.5g", ImGuiSliderFlags_AlwaysClamp) &&
        ends[0] < ends[1]) {
        editing.low = ends[0];
        editing.high = ends[1];
    }
    ui.note("transfer/values");
    if (!is_whole) {
        if (ImGui::Button("all values"))
            editing.low = editing.high = 0.0;
        ui.note("transfer/all_values");
    }
    if (layer.mode != RayMode::iso) {
        RayCastLayer with = layer;
        with.transfer = function;
        draw_presets(ui, with, work, changed);
        ui.note("transfer/presets");
        function = std::move(with.transfer);
    }
    draw_felt(ui, work, function);
    ImGui::TextDisabled("click: add; drag: move;\nright click: remove");

    if (isos_changed) {
        for (size_t i = 0; is_iso && i < isos.size(); ++i)
            layer.isos[i].value = isos[i];
        if (is_iso) {
            const size_t chosen = editing.chosen ? editing.chosen->number : 0;
            const double kept = isos.size() > chosen ? isos[chosen] : isos.front();
            std::stable_sort(layer.isos.begin(), layer.isos.end(),
                             [](const auto& a, const auto& b) { return a.value < b.value; });
            for (size_t i = 0; editing.chosen && i < layer.isos.size(); ++i)
                if (layer.isos[i].value == kept)
                    editing.chosen->number = i;
            work.session().show(scene);
            work.session().set_iso(layer.isos.front().value);
        } else {
            work.session().set_iso(isos.front());
        }
    } else if (changed) {
        if (editing.chosen && editing.chosen->of == TransferPoint::Of::opacity &&
            editing.chosen->number >= function.opacities.size())
            editing.chosen.reset();
        if (editing.chosen && editing.chosen->of == TransferPoint::Of::color &&
            editing.chosen->number >= function.colors.size())
            editing.chosen.reset();
        work.session().set_transfer(std::move(function));
    } else if (scene != work.session().scene()) {
        work.session().show(std::move(scene));
    }
}

} // namespace palpate::view
