// The line at the bottom, and a message that is too long for it.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/tool.h"
#include "apps/view/window/slice_view.h"

namespace palpate::view {

namespace {

// On a plate above the line at the bottom, over the views; one that would fill more than half of
// their height is as wide as the window. The pointer passes through it.
void draw_long_message(Widgets& ui, const ViewState& state, const std::string& told) {
    const Places places = places_of(state);
    const ImVec2 pad(6.0f, 4.0f);
    const auto foot = static_cast<float>(places.status.low_px.y);
    float left = 0.0f, width = 0.0f, height = 0.0f;
    const auto fit = [&](int from_px, int to_px) {
        left = static_cast<float>(from_px);
        width = static_cast<float>(to_px - from_px);
        height = 2.0f * pad.y +
                 ImGui::CalcTextSize(told.c_str(), nullptr, false, width - 2.0f * pad.x).y;
    };
    int views_end = 0;
    for (const Places::View& view : places.views)
        views_end = std::max(views_end, view.box.low_px.x + view.box.size_px.x);
    fit(places.bar.size_px.x, views_end);
    if (height > 0.5f * foot)
        fit(0, places.status.size_px.x);
    height = std::min(height, foot);
    ImGui::SetNextWindowPos(ImVec2(left, foot - height));
    ImGui::SetNextWindowSize(ImVec2(width, height));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, pad);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0f, 1.0f));
    ImGui::Begin("message", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs |
                     ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoFocusOnAppearing);
    ImGui::PushStyleColor(ImGuiCol_Text, accent(state));
    ImGui::TextWrapped("%s", told.c_str());
    ImGui::PopStyleColor();
    ui.note("status/message");
    ImGui::End();
    ImGui::PopStyleVar(2);
}

std::string sample_text(Work& work, glm::dvec3 at) {
    const auto sample = sample_at(work.subject().grid, at);
    return sample ? fmt::format("sample ({}, {}, {})", sample->x, sample->y, sample->z)
                  : "outside the volume";
}

// "crosshair  L 12.4  P 88.0  S 262.3 mm  143 HU  label 7 kidney"
std::string place_at(const ViewState& state, Work& work, glm::dvec3 at, bool is_pointer) {
    std::string text =
        fmt::format("{}  {}", is_pointer ? "pointer" : "crosshair", patient_text(at));
    if (!sample_at(work.subject().grid, at))
        return text + "  outside";
    if (state.indices_shown)
        text += "  " + sample_text(work, at);
    return text + "  " + work.values_at(at);
}

} // namespace

std::string StatusLine::shown(double time_s) const {
    constexpr double kTold_s = 6.0, kLettersPer_s = 15.0; // at least
    const double reading_s = static_cast<double>(message.size()) / kLettersPer_s;
    return time_s - told_s < std::max(kTold_s, reading_s) ? message : "";
}

void draw_status(Widgets& ui, StatusLine& line, const ViewState& state, Work& work) {
    // Kinds of a tool look the same over the views: the line has the kind when it is taken into the
    // hand, by a key or in the panel.
    std::string how_to = state.tool->how_to ? state.tool->how_to(state) : "";
    if (how_to != line.how_to && !how_to.empty())
        work.tell(how_to);
    line.how_to = std::move(how_to);
    const Box box = places_of(state).status;
    if (box.size_px.y == 0)
        return;
    place_window(box);
    ImGui::PushStyleVar(
        ImGuiStyleVar_WindowPadding,
        ImVec2(6.0f, 0.5f * (static_cast<float>(box.size_px.y) - ImGui::GetTextLineHeight())));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0f, 1.0f));
    ImGui::Begin("status", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                     ImGuiWindowFlags_NoFocusOnAppearing);
    const bool in_slice = state.under && is_slice(*state.under);
    const glm::dvec3 at =
        in_slice ? point_under(state, work.subject().grid, *state.under, state.pointer_px)
                 : state.crosshair_mm;
    std::string place = place_at(state, work, at, in_slice);
    if (state.stylus.by_pointer)
        place = fmt::format("hand: {}   {}", name_of(state.stylus.first), place);
    line.place = place;
    ImGui::TextUnformatted(place.c_str());
    ui.note("status/place");
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("%s", sample_text(work, at).c_str());
    const EditState edit = work.edited();
    if (const Message message = work.take_message(); !message.empty()) {
        line.message = message.shown(state.names_hidden);
        line.told_s = ui.time_s;
    }
    if (const double behind_s = work.hand().backlog().seconds; behind_s > HandLink::kFarBehind_s) {
        line.message =
            fmt::format("edits are {:.0f} s behind the hand; all of them will be done", behind_s);
        line.told_s = ui.time_s;
    }
    const auto width_of = [](const std::string& words) {
        return ImGui::CalcTextSize(words.c_str()).x;
    };
    // At the right as many of these words as do not reach the place.
    const std::string keys = "? keys";
    std::string right = fmt::format("{} edit{}, {} to redo   {}", edit.undo_steps,
                                    edit.undo_steps == 1 ? "" : "s", edit.redo_steps, keys);
    const float place_end = 6.0f + width_of(place + "  ");
    const auto begin_of = [&](const std::string& words) {
        return static_cast<float>(box.size_px.x) - width_of(words) - 8.0f;
    };
    if (begin_of(right) < place_end)
        right = begin_of(keys) < place_end ? "" : keys;
    std::string told = line.shown(ui.time_s);
    if (told.empty() && state.figure.share)
        told = "drawing the figure ..";
    const float told_end =
        6.0f + width_of(place) + ImGui::GetStyle().ItemSpacing.x + width_of("  " + told + "  ");
    const bool is_long = told_end > begin_of(right);
    if (!told.empty() && !is_long) {
        ImGui::SameLine();
        ImGui::TextColored(accent(state), "  %s", told.c_str());
        ui.note("status/message");
    }
    if (!right.empty()) {
        ImGui::SameLine(begin_of(right));
        ImGui::TextUnformatted(right.c_str());
        ui.note("status/steps");
    }
    ImGui::End();
    ImGui::PopStyleVar(2);
    if (!told.empty() && is_long)
        draw_long_message(ui, state, told);
}

} // namespace palpate::view
