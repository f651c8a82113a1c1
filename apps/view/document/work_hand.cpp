// The hand of a window, beside its document.

#include <cmath>

#include "apps/view/document/work.h"
#include "apps/view/script/dump.h"
#include "apps/view/tools/hand_pointer.h"
#include "apps/view/tools/mesh_tool.h"

namespace palpate::view {

ToolFor Work::tool_for() const {
    return {subject_.grid, subject_.range, session().parameters().iso, grey_name(), labels_name()};
}

// Gives the buttons of the hand their tools; makes a label map to draw on where there is none.
void Work::hold_tools(const ViewState& state) {
    const Carve carves[] = {state.stylus.first, state.stylus.second};
    for (uint8_t tool = 0; tool < Editor::kTools; ++tool) {
        if (!is_stroke(carves[tool])) {
            rack_.lay_down(session(), tool);
            continue;
        }
        if (carves[tool] == Carve::seed) {
            const bool are_there = edited().document.find(kSeeds) != nullptr;
            if (!are_there && seeds_asked_)
                continue; // they come with one of the next frames
            seeds_asked_ = !are_there;
        }
        if (is_on_labels(carves[tool]) && !edited().document.find(labels_name())) {
            if (labels_asked_ || !make_labels())
                continue; // comes with one of the next frames
            labels_asked_ = true;
        }
        if (std::optional<EditSetup> setup = edit_of(carves[tool], state.stylus.shape, state))
            rack_.hold(session(), std::move(*setup), tool);
        else
            rack_.lay_down(session(), tool);
    }
    haptics::TouchParameters parameters = session().parameters();
    const double felt_mm = felt_radius_mm(state.radius_mm, subject_.grid);
    if (parameters.tool_radius_mm != felt_mm) {
        parameters.tool_radius_mm = felt_mm;
        session().feel(parameters);
    }
}

void Work::obey_hand(const Order& order, const ViewState& state) {
    switch (order.kind) {
        case Order::Kind::hand_start: {
            if (down_) {
                message_ = "a stroke is under way: end it first";
                break;
            }
            HandOptions options = touch_.options();
            if (!order.path.empty())
                options.device = order.path;
            if (options.device.empty())
                options.device = kMouse;
            touch_.set_up(std::move(options));
            if (Result<void> started = touch_.start(state.stylus); !started)
                message_ = started.error().message;
            break;
        }
        case Order::Kind::hand_stop:
            touch_.stop();
            break;
        case Order::Kind::hand_arm:
            touch_.arm();
            break;
        default:
            touch_.disarm();
    }
}

void Work::measure_backlog(double time_s) {
    const uint64_t done = edited().inputs_done, given = session().inputs_given();
    while (!given_.empty() && given_.front().first <= done)
        given_.pop_front();
    if (given > done && (given_.empty() || given_.back().first < given))
        given_.emplace_back(given, time_s);
    backlog_ = {given - done, given_.empty() ? 0.0 : time_s - given_.front().second};
}

// The pressed buttons of which the tool may know: from when the hand has come to the pointer and
// its tool with it.
uint32_t Work::granted_buttons(const ViewState& state, double time_s) {
    constexpr double kHeld_s = 0.5; // after which a person is told
    const Stylus& stylus = state.stylus;
    granted_ &= stylus.buttons;
    const std::optional<TouchSample>& now = touch_.now();
    const bool is_there =
        !now ||
        (is_tool_with_hand(stylus, state.radius_mm, now->probe.position_mm,
                           now->proxy.position_mm) &&
         (!stylus.by_pointer || glm::distance(now->probe.position_mm, stylus.meant.position_mm) <=
                                    1e3 * haptics::PointerHand::kFar_m + std::abs(stylus.push_mm)));
    if (is_there)
        granted_ = stylus.buttons;
    if (granted_ == stylus.buttons) {
        held_since_s_.reset();
    } else if (!held_since_s_) {
        held_since_s_ = time_s;
    } else if (*held_since_s_ < time_s - kHeld_s) {
        message_ =
            "the tool is held by what lies between it and the pointer: fetch it there, or "
            "start the hand again (O twice)";
        held_since_s_ = INFINITY; // told
    }
    return granted_;
}

void Work::follow_hand(ViewState& state, double time_s) {
    measure_backlog(time_s);
    if (touch_.running())
        hold_tools(state);
    if (edited().document.find(labels_name()))
        labels_asked_ = false;
    if (state.stylus.buttons == 0)
        before_press_.reset();
    else if (!before_press_) // the servo does not know of the press yet
        before_press_ = *edited().document.find(grey_name());
    Stylus given = state.stylus;
    given.buttons = granted_buttons(state, time_s);
    touch_.frame(given, time_s);
    follow_milling(state, time_s);
    const Carve carves[] = {state.stylus.first, state.stylus.second};
    for (size_t i = 0; i < 2; ++i)
        if ((state.stylus.buttons & ~pressed_buttons_ & (1u << i)) && carves[i] == Carve::nothing)
            message_ = "this button does nothing yet: the touch window (Y) gives it a tool";
    pressed_buttons_ = state.stylus.buttons;
    press_widgets(state);
    move_by_hand(state);
    state.stylus.on = touch_.running();
    state.stylus.by_pointer = touch_.by_pointer();
    if (!state.stylus.by_pointer)
        state.stylus.buttons = 0;
}

// Moves things by a pressed button that makes no stroke: a face of the mesh, by as much as the hand
// moves from where the tool has met it; the crosshair.
void Work::move_by_hand(ViewState& state) {
    const std::optional<TouchSample>& now = touch_.now();
    const auto presses = [&](Carve carve) {
        return touch_.running() && now &&
               (((now->buttons & 1u) && state.stylus.first == carve) ||
                ((now->buttons & 2u) && state.stylus.second == carve));
    };
    if (presses(Carve::crosshair))
        move_crosshair(state, subject_.grid, now->proxy.position_mm);
    PulledMesh* mesh = mesh_pulling_.mesh();
    if (!presses(Carve::pull)) {
        if (std::exchange(hand_pull_, std::nullopt) && mesh)
            mesh->let_go(true);
        return;
    }
    if (!mesh) {
        message_ = "there is no mesh to pull: the tab segment makes one of a label";
    } else if (hand_pull_) {
        mesh->pull(hand_pull_->held_mm + now->probe.position_mm - hand_pull_->from_mm);
    } else if (const auto met = mesh->near(now->proxy.position_mm, state.radius_mm)) {
        mesh->hold(*met, state.own.of<Pulling>().reach);
        hand_pull_ = {*met, now->probe.position_mm};
    }
}

void Work::follow_milling(const ViewState& state, double time_s) {
    const haptics::Milling milling = session().milling();
    const std::optional<TouchSample>& now = touch_.now();
    dust_.frame(milling.removed_mm3, now ? now->proxy.position_mm : glm::dvec3(0.0), time_s);
    if (threaded()) // a script plays nothing
        sound_.frame(milling, touch_.running() && state.stylus.sound_on);
}

void Work::show_as_wanted(ViewState& state) {
    const SeenAs now = seen_as(session().scene());
    if (now == state.seen_as)
        return;
    Scene scene = session().scene();
    if (show_as(scene, state.seen_as, session().parameters().iso, rays_))
        session().show(std::move(scene));
    else
        message_ = fmt::format("expected a scene that can be shown by {}, found one with {}",
                               name_of(state.seen_as), name_of(now));
    state.seen_as = seen_as(session().scene());
}

// Widgets act when they are pressed far enough; a slider follows as long as it is.
void Work::press_widgets(ViewState& state) {
    std::vector<Widget3d> palette = touch_.running() ? palette_of(state) : std::vector<Widget3d>();
    const std::vector<haptics::PlateTouch> touches = touch_.take_plates();
    for (const haptics::PlateTouch& touched : touches) {
        const auto number = static_cast<size_t>(touched.plate);
        if (touched.plate < 0 || number >= palette_.size()) {
            widget_down_ = false;
            continue;
        }
        const Widget3d& widget = palette_[number];
        const double share = touched.depth_mm / widget.plate.travel_mm;
        const bool begins = !widget_down_ && share > kPressed;
        widget_down_ = share > (widget_down_ ? kReleased : kPressed);
        const bool goes_on = widget_down_ && is_dragged(widget.kind) && &touched == &touches.back();
        if ((begins || goes_on) && press_widget(state, widget, touched))
            session().undo();
    }
    const haptics::PlateTouch now =
        touch_.running() && touch_.now() ? touch_.now()->plate : haptics::PlateTouch();
    const auto plates = [](const std::vector<Widget3d>& all) {
        haptics::TouchPlates result;
        for (const Widget3d& widget : all)
            result.plates.push_back(widget.plate);
        return result;
    };
    if (plates(palette) != plates(palette_)) {
        SessionSources sources = session().sources();
        sources.touch.plates = palette.empty()
                                   ? nullptr
                                   : std::make_shared<const haptics::TouchPlates>(plates(palette));
        session().choose(std::move(sources));
    }
    // Drawn anew where it is seen to have moved.
    constexpr double kStill_mm = 0.1;
    if (palette != palette_ || now.plate != pressed_.plate ||
        std::abs(now.depth_mm - pressed_.depth_mm) > kStill_mm) {
        palette_ = std::move(palette);
        pressed_ = now;
        palette_mesh_ = std::make_shared<const Mesh>(palette_mesh(palette_, pressed_));
    }
}

std::vector<Work::HandSurface> Work::hand_surfaces(const ViewState& state) {
    std::vector<HandSurface> surfaces;
    const std::optional<TouchSample>& now = touch_.now();
    if (touch_.running() && now)
        surfaces.push_back({{.style = {.color = {0.25, 0.8, 1.0}}},
                            tip_.at(state.stylus.shape, state.radius_mm, now->proxy)});
    if (const PulledMesh* mesh = mesh_pulling_.mesh();
        mesh && (state.tool == &kPullTool || state.stylus.can(Carve::pull)))
        surfaces.push_back({{.style = {.color = {1.0, 0.7, 0.25}, .opacity = 0.7}, .smooth = false},
                            mesh->surface()});
    if (!palette_.empty())
        surfaces.push_back({palette_layer(palette_, pressed_), palette_mesh_});
    return surfaces;
}

Json Work::dump_hand(const ViewState& state) {
    const Stylus& stylus = state.stylus;
    const std::optional<TouchSample>& now = touch_.now();
    Json json{{"on", stylus.on},
              {"device", stylus.on ? touch_.options().device : ""},
              {"algorithm", touch_.options().algorithm},
              {"armed", touch_.armed()},
              {"first", name_of(stylus.first)},
              {"second", name_of(stylus.second)},
              {"shape", name_of(stylus.shape)},
              {"push_mm", stylus.push_mm},
              {"sound_on", stylus.sound_on},
              {"dust_shown", stylus.dust_shown},
              {"removed_mm3", session().milling().removed_mm3},
              {"grains", dust_.made()},
              {"sound_level", milling_level(session().milling())}};
    if (stylus.by_pointer)
        json["meant_mm"] = json_of(stylus.meant.position_mm);
    if (now) {
        json["probe_mm"] = json_of(now->probe.position_mm);
        json["proxy_mm"] = json_of(now->proxy.position_mm);
        json["force_n"] = json_of(now->force_n);
        json["energy_mj"] = now->energy_mj;
        json["plate"] = now->plate.plate;
    }
    return json;
}

} // namespace palpate::view
