#include "apps/view/window/key_actions.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "apps/view/document/label_changes.h"
#include "apps/view/tools/hand_pointer.h"
#include "engine/edit/alike.h"
#include "engine/session/default_scene.h"
#include "engine/volume/extent.h"

namespace palpate::view {

void choose_window(const KeyPress& press) {
    const auto number = static_cast<size_t>(press.event.key[0] - '1');
    if (!press.shift() && number < press.subject.windows.size())
        press.state.window = press.subject.windows[number];
}

void look(ViewState& state, const char* from) {
    const ViewDirection view = view_direction(from).value();
    const double distance = glm::distance(state.camera.eye_mm, state.camera.target_mm);
    state.camera.eye_mm = state.camera.target_mm + distance * glm::normalize(view.towards);
    state.camera.up = view.up;
}

void page_by_key(const KeyPress& press) {
    const std::optional<Panel> under = press.state.under;
    if (under && is_slice(*under))
        page(press.state, press.subject.grid, *under, press.is("up") ? 1.0 : -1.0);
}

void reset(const KeyPress& press) {
    const ViewState& home = press.subject.home;
    press.state.slices = home.slices;
    press.state.camera = home.camera;
    press.state.crosshair_mm = home.crosshair_mm;
    press.state.window = home.window;
}

void fade_labels(const KeyPress& press) {
    double& opacity = press.state.label_opacity;
    const double by = press.is("d") ? 0.1 : -0.1;
    opacity = std::clamp(std::round((opacity + by) * 10) / 10, 0.0, 1.0);
}

void resize_tool(const KeyPress& press) {
    constexpr double kStep = 1.25;
    double& radius_mm = press.state.radius_mm;
    radius_mm =
        press.is("-") ? std::max(radius_mm / kStep, 0.1) : std::min(radius_mm * kStep, 100.0);
}

void step_slab(const KeyPress& press) {
    const double layer = smallest_spacing_mm(press.subject.grid);
    const double layers = std::round(press.state.slab_mm / layer) + (press.is("]") ? 1.0 : -1.0);
    press.state.slab_mm = layer * std::clamp(layers, 0.0, 100.0);
}

void start_or_stop_hand(const KeyPress& press) {
    if (!press.state.stylus.on)
        begin_hand(press.state, press.subject);
    press.order(press.state.stylus.on ? Order(order::StopHand{}) : order::StartHand{});
}

void take_picture(const KeyPress& press) {
    if (!press.shift())
        return press.order(order::TakePicture{});
    if (press.state.under)
        press.state.figure.panel = *press.state.under;
    press.state.figure.pictures = 1;
    press.order(order::PrintFigure{"figure.png"});
}

void lock_label(const KeyPress& press) {
    ViewState& state = press.state;
    uint16_t label = 0;
    if (state.under && is_slice(*state.under) && press.subject.label_at)
        label = press.subject.label_at(
            point_under(state, press.subject.grid, *state.under, state.pointer_px));
    label = label == 0 ? state.label : label;
    auto& locked = state.notes.locked_labels;
    const auto place = std::lower_bound(locked.begin(), locked.end(), label);
    const bool was = place != locked.end() && *place == label;
    if (was)
        locked.erase(place);
    else
        locked.insert(place, label);
    press.order(order::Tell{fmt::format("label {} is {}", label, was ? "open again" : "locked")});
}

void take_values(const KeyPress& press) {
    ViewState& state = press.state;
    if (state.only_values) {
        state.only_values.reset();
        return press.order(order::Tell{"tools on labels change samples of all values"});
    }
    if (!state.under || !is_slice(*state.under) || !press.subject.value_at)
        return press.order(
            order::Tell{"put the pointer on a slice, where the values are to be "
                        "taken"});
    const Grid& grid = press.subject.grid;
    const glm::dvec3 at(glm::inverse(grid.world_from_index) *
                        glm::dvec4(point_under(state, grid, *state.under, state.pointer_px), 1.0));
    std::vector<double> values;
    for (int z = -kAlikeReach; z <= kAlikeReach; ++z)
        for (int y = -kAlikeReach; y <= kAlikeReach; ++y)
            for (int x = -kAlikeReach; x <= kAlikeReach; ++x)
                if (const auto value = press.subject.value_at(
                        world_point(grid, glm::floor(at + 0.5) + glm::dvec3(x, y, z)));
                    value && !std::isnan(*value))
                    values.push_back(*value);
    if (values.empty())
        return press.order(order::Tell{"no values are here"});
    const AlikeRange range = alike_range(std::move(values), state.alike_deviations);
    state.only_values = {range.low, std::max(range.high, range.low + 1e-3)};
    press.order(order::Tell{fmt::format(
        "tools on labels change samples of {:.5g} .. {:.5g} alone; Ctrl+T: of all again", range.low,
        range.high)});
}

void change_label(const KeyPress& press, std::string_view id) {
    for (const LabelChange& change : label_changes())
        if (change.id == id)
            press.order(order::ChangeLabel{&change});
}

void export_labels(const KeyPress& press) {
    press.order(order::ExportLabels{press.shift() ? fmt::format("label-{}.stl", press.state.label)
                                                  : "labels.nii.gz"});
}

void undo_or_redo(const KeyPress& press) {
    press.order(press.is("y") || press.shift() ? Order(order::Redo{}) : order::Undo{});
}

namespace {

// "Ctrl+J", "Page down".
std::string name_of_key(const KeyPress& press) {
    std::string name = press.event.key;
    name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
    std::replace(name.begin(), name.end(), '_', ' ');
    return press.ctrl() ? "Ctrl+" + name : name;
}

std::string why_idle_with_ctrl(const KeyPress& press) {
    const bool is_of_labels = press.is("i") || press.is("u") || press.is("e");
    const bool has_labels = !press.subject.has_labels || press.subject.has_labels();
    return is_of_labels && !has_labels ? "no labels are there yet: draw some (B)" : "";
}

} // namespace

std::string why_idle(const KeyPress& press, bool is_known) {
    const ViewState& state = press.state;
    const auto is_one_of = [&](std::string_view keys) {
        return press.event.key.size() == 1 && keys.find(press.event.key) != std::string_view::npos;
    };
    for (const char* alone : {"shift", "ctrl", "alt", "w", "escape"})
        if (press.is(alone))
            return "";
    if (state.leaving || state.file_question)
        return "answer the question first, or close it (Esc)";
    if (state.browser_open || state.series_open)
        return "choose a file first, or close the chooser (Esc)";
    if (press.is("delete"))
        return "nothing is chosen: a click on a measure chooses it (M)";
    if (press.is("enter"))
        return "Enter ends a polygon, or an outline of at least three points: none is begun";
    if (!is_known)
        return name_of_key(press) + " does nothing: ? lists all keys";
    if (press.ctrl())
        return why_idle_with_ctrl(press);
    const bool in_slice = state.under && is_slice(*state.under);
    if (is_one_of("123456789") && !press.shift() && !press.subject.windows.empty() &&
        static_cast<size_t>(press.event.key[0] - '0') > press.subject.windows.size())
        return fmt::format("window {}: this volume has windows 1 to {}", press.event.key,
                           press.subject.windows.size());
    if (is_one_of("sad") && press.subject.has_labels && !press.subject.has_labels())
        return "no labels are there yet: draw some (B), or open a file of them";
    if ((press.is("up") || press.is("down")) && !in_slice)
        return "Up and Down go through the slice under the pointer: point at one";
    if (press.is("tab") && state.layout != Layout::slice)
        return "Tab changes the slice that is shown alone: L goes to that layout";
    if (is_one_of("\\") && state.slab_mm == 0.0)
        return "slices are as thin as can be: ] makes them thicker";
    if (press.is("space") && !state.stylus.on)
        return "no hand is started: O starts one";
    if (is_one_of("f") && !state.under && !state.alone)
        return "F fills the window with the view under the pointer: point at one";
    return "";
}

} // namespace palpate::view
