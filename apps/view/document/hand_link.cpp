#include "apps/view/document/hand_link.h"

#include <cmath>

#include "apps/view/document/stroke_edit.h"
#include "apps/view/tools/hand_pointer.h"
#include "apps/view/tools/mesh_tool.h"

namespace palpate::view {

namespace {

// Half the volume's size along the patient's axes.
glm::dvec3 half_size_mm(const Grid& grid) {
    glm::dvec3 size(0.0);
    for (int axis = 0; axis < 3; ++axis)
        size += glm::abs(glm::dvec3(grid.world_from_index[axis])) * double(grid.size[axis]);
    return 0.5 * size;
}

} // namespace

HandLink::HandLink(OpenDocument& document, MeshPulling& mesh_pulling)
    : document_(document),
      mesh_pulling_(mesh_pulling),
      touch_(document.session(), document.threaded(), center_mm(document.subject().grid),
             half_size_mm(document.subject().grid)) {}

void HandLink::start(const std::string& device, const Stylus& stylus) {
    if (is_drawing_)
        return document_.tell("a stroke is under way: end it first");
    HandOptions options = touch_.options();
    if (!device.empty())
        options.device = device;
    if (options.device.empty())
        options.device = kMouse;
    touch_.set_up(std::move(options));
    if (Result<void> started = touch_.start(stylus); !started)
        document_.tell(started.error().message);
}

// Gives the session what strokes of the left button's tool do.
bool HandLink::take_tool(const ViewState& state) {
    const Carve carve = state.tool->stroke;
    if (!row_of(carve).stroke || (row_of(carve).on_labels && !document_.make_labels()))
        return false;
    std::optional<EditSetup> setup =
        stroke_edit(document_, carve, TipShape::ball, state, disc_across_ != glm::dvec3(0.0));
    return setup && rack_.hold(document_.session(), std::move(*setup));
}

ToolPose HandLink::posed(const ToolPose& tool) const {
    return disc_across_ == glm::dvec3(0.0)
               ? tool
               : pose_of_disc(tool.position_mm, disc_across_, document_.subject().grid);
}

void HandLink::begin_stroke(StrokePose pose, const ViewState& state, glm::dvec3 disc_across) {
    if (touch_.running())
        document_.tell("a hand is running: stop it to draw with the mouse");
    disc_across_ = disc_across;
    pose.tool = posed(pose.tool);
    is_drawing_ =
        !is_drawing_ && take_tool(state) && document_.session().stroke(EditInput::Kind::down, pose);
    last_ = pose;
}

void HandLink::move_stroke(StrokePose pose) {
    pose.tool = posed(pose.tool);
    // A pose that the full ring does not take is left out: the sweep from the last one has no gap.
    if (is_drawing_ && document_.session().stroke(EditInput::Kind::move, pose))
        last_ = pose;
}

void HandLink::end_stroke(StrokePose pose) {
    if (!is_drawing_)
        return;
    Session& session = document_.session();
    pose.tool = posed(pose.tool);
    pose.time_s = std::max(pose.time_s, last_.time_s);
    while (!session.stroke(EditInput::Kind::up, pose)) // the ring is full
        session.settle();
    is_drawing_ = false;
}

void HandLink::cancel_stroke(double time_s) {
    if (!is_drawing_)
        return;
    disc_across_ = {}; // the last pose has it
    end_stroke({time_s, last_.tool});
    document_.session().undo();
}

// Gives the buttons of the hand their tools; makes a label map to draw on where there is none.
void HandLink::hold_tools(const ViewState& state) {
    Session& session = document_.session();
    const Carve carves[] = {state.stylus.first, state.stylus.second};
    for (uint8_t tool = 0; tool < Editor::kTools; ++tool) {
        if (!row_of(carves[tool]).stroke) {
            rack_.lay_down(session, tool);
            continue;
        }
        if (carves[tool] == Carve::seed) {
            const bool are_there = document_.seeds().has_value();
            if (!are_there && seeds_asked_)
                continue; // they come with one of the next frames
            seeds_asked_ = !are_there;
        }
        if (row_of(carves[tool]).on_labels && !document_.labels()) {
            if (labels_asked_ || !document_.make_labels())
                continue; // comes with one of the next frames
            labels_asked_ = true;
        }
        if (auto setup = stroke_edit(document_, carves[tool], state.stylus.shape, state))
            rack_.hold(session, std::move(*setup), tool);
        else
            rack_.lay_down(session, tool);
    }
    haptics::TouchParameters parameters = session.parameters();
    const double felt_mm = felt_radius_mm(state.radius_mm, document_.subject().grid);
    if (parameters.tool_radius_mm != felt_mm) {
        parameters.tool_radius_mm = felt_mm;
        session.feel(parameters);
    }
}

void HandLink::measure_backlog(double time_s) {
    const uint64_t done = document_.edited().inputs_done;
    const uint64_t given = document_.session().inputs_given();
    while (!given_.empty() && given_.front().first <= done)
        given_.pop_front();
    if (given > done && (given_.empty() || given_.back().first < given))
        given_.emplace_back(given, time_s);
    backlog_ = {given - done, given_.empty() ? 0.0 : time_s - given_.front().second};
}

// The pressed buttons of which the tool may know: from when the hand has come to the pointer and
// its tool with it.
uint32_t HandLink::granted_buttons(const ViewState& state, double time_s) {
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
        document_.tell(
            "the tool is held by what lies between it and the pointer: fetch it there, or "
            "start the hand again (O twice)");
        held_since_s_ = INFINITY; // told
    }
    return granted_;
}

void HandLink::follow(ViewState& state, double time_s) {
    measure_backlog(time_s);
    if (touch_.running())
        hold_tools(state);
    if (document_.labels())
        labels_asked_ = false;
    if (state.stylus.buttons == 0)
        before_press_.reset();
    else if (!before_press_) // the servo does not know of the press yet
        before_press_ = document_.grey();
    Stylus given = state.stylus;
    given.buttons = granted_buttons(state, time_s);
    touch_.frame(given, time_s);
    const haptics::Milling milling = document_.session().milling();
    dust_.frame(milling.removed_mm3,
                touch_.now() ? touch_.now()->proxy.position_mm : glm::dvec3(0.0), time_s);
    if (document_.threaded()) // a script plays nothing
        sound_.frame(milling, touch_.running() && state.stylus.sound_on);
    const Carve carves[] = {state.stylus.first, state.stylus.second};
    for (size_t i = 0; i < 2; ++i)
        if ((state.stylus.buttons & ~pressed_buttons_ & (1u << i)) && carves[i] == Carve::nothing)
            document_.tell("this button does nothing yet: the touch window (Y) gives it a tool");
    pressed_buttons_ = state.stylus.buttons;
    palette_.follow(state, touch_, document_.session());
    move_things(state);
    state.stylus.on = touch_.running();
    state.stylus.by_pointer = touch_.by_pointer();
    if (!state.stylus.by_pointer)
        state.stylus.buttons = 0;
}

// A pressed button that makes no stroke moves a face of the mesh, by as much as the hand moves from
// where the tool has met it, or the crosshair.
void HandLink::move_things(ViewState& state) {
    const std::optional<TouchSample>& now = touch_.now();
    const auto presses = [&](Carve carve) {
        return touch_.running() && now &&
               (((now->buttons & 1u) && state.stylus.first == carve) ||
                ((now->buttons & 2u) && state.stylus.second == carve));
    };
    if (presses(Carve::crosshair))
        move_crosshair(state, document_.subject().grid, now->proxy.position_mm);
    PulledMesh* mesh = mesh_pulling_.mesh();
    if (!presses(Carve::pull)) {
        if (std::exchange(pull_, std::nullopt) && mesh)
            mesh->let_go(true);
        return;
    }
    if (!mesh) {
        document_.tell("there is no mesh to pull: the task Segment makes one of a label");
    } else if (pull_) {
        mesh->pull(pull_->held_mm + now->probe.position_mm - pull_->from_mm);
    } else if (const auto met = mesh->near(now->proxy.position_mm, state.radius_mm)) {
        mesh->hold(*met, state.own.of<Pulling>().reach);
        pull_ = {*met, now->probe.position_mm};
    }
}

std::vector<HandLink::Surface> HandLink::surfaces(const ViewState& state) {
    std::vector<Surface> all;
    const std::optional<TouchSample>& now = touch_.now();
    if (touch_.running() && now)
        all.push_back({{.style = {.color = {0.25, 0.8, 1.0}}},
                       tip_.at(state.stylus.shape, state.radius_mm, now->proxy)});
    const PulledMesh* mesh = mesh_pulling_.mesh();
    if (mesh && (state.tool == &kPullTool || state.stylus.can(Carve::pull)))
        all.push_back({{.style = {.color = {1.0, 0.7, 0.25}, .opacity = 0.7}, .smooth = false},
                       mesh->surface()});
    if (palette_.is_shown())
        all.push_back({palette_.layer(), palette_.mesh()});
    return all;
}

Volume HandLink::pointed_at() {
    return before_press_ ? *before_press_ : document_.grey();
}

} // namespace palpate::view
