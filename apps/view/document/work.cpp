#include "apps/view/document/work.h"

#include "apps/view/drawing/pick.h"
#include "apps/view/tools/mesh_tool.h"

namespace palpate::view {

Work::Work(Source source, glm::uvec2 window_px, double text_scale, bool threaded)
    : OpenDocument(source, window_px, text_scale, threaded),
      figures_(threaded),
      mesh_pulling_(*this),
      hand_(*this, mesh_pulling_),
      segmentation_(*this, hand_),
      label_export_(*this),
      saving_(*this, std::move(source.project)) {
    subject_.path = [this](glm::uvec3 from, glm::uvec3 to, int axis) {
        return segmentation_.wire().path(from, to, axis);
    };
    subject_.mesh_met = [this](const Ray& ray) {
        const PulledMesh* mesh = mesh_pulling_.mesh();
        return mesh ? mesh->met(ray) : std::nullopt;
    };
    subject_.mesh_near = [this](glm::dvec3 point_mm, double within_mm) {
        const PulledMesh* mesh = mesh_pulling_.mesh();
        return mesh ? mesh->near(point_mm, within_mm) : std::nullopt;
    };
    subject_.pick = [this](const Ray& ray) {
        return first_seen(ray, hand_.pointed_at(), session().scene());
    };
}

void Work::obey(const Order& order, const ViewState& state) {
    const StrokePose pose{order.time_s, {order.at_mm}};
    PulledMesh* mesh = mesh_pulling_.mesh();
    switch (order.kind) {
        case Order::Kind::stroke_down:
            hand_.begin_stroke(pose, state);
            break;
        case Order::Kind::stroke_move:
            hand_.move_stroke(pose);
            break;
        case Order::Kind::stroke_up:
            hand_.end_stroke(pose);
            break;
        case Order::Kind::stroke_cancel:
            hand_.cancel_stroke(order.time_s);
            break;
        case Order::Kind::hand_start:
            hand_.start(order.path, state.stylus);
            break;
        case Order::Kind::hand_stop:
            hand_.touch().stop();
            break;
        case Order::Kind::hand_arm:
            hand_.touch().arm();
            break;
        case Order::Kind::hand_disarm:
            hand_.touch().disarm();
            break;
        case Order::Kind::undo:
        case Order::Kind::redo:
            notes().keep(state.notes);
            step_back(order.kind == Order::Kind::undo);
            break;
        case Order::Kind::save:
            saving_.save(state, order.path);
            break;
        case Order::Kind::export_measures:
            export_measures(state, order.path);
            break;
        case Order::Kind::export_labels:
            label_export_.begin(state.label, order.path);
            break;
        case Order::Kind::segment:
            segmentation_.begin(state);
            break;
        case Order::Kind::bound:
            segmentation_.bound(state);
            break;
        case Order::Kind::stop_segmenting:
            segmentation_.stop();
            break;
        case Order::Kind::clear_seeds:
            clear_seeds();
            break;
        case Order::Kind::fill_wire:
            segmentation_.wire().fill(state);
            break;
        case Order::Kind::keep_largest:
        case Order::Kind::fill_holes:
            mesh_pulling_.clean(state, order.kind == Order::Kind::fill_holes);
            break;
        case Order::Kind::mesh_make:
            mesh_pulling_.make(state.label);
            break;
        case Order::Kind::mesh_apply:
            mesh_pulling_.apply(state);
            break;
        case Order::Kind::mesh_drop:
            mesh_pulling_.drop();
            break;
        case Order::Kind::pull_down:
            if (mesh)
                mesh->hold(order.at_mm, state.own.of<Pulling>().reach);
            break;
        case Order::Kind::pull_move:
            if (mesh)
                mesh->pull(order.at_mm);
            break;
        case Order::Kind::pull_up:
        case Order::Kind::pull_cancel:
            if (mesh)
                mesh->let_go(order.kind == Order::Kind::pull_up);
            break;
        case Order::Kind::tell:
            tell(order.path);
            break;
        case Order::Kind::open:
        case Order::Kind::open_labels:
        case Order::Kind::open_fused:
        case Order::Kind::close:
        case Order::Kind::leave:
        case Order::Kind::cancel_opening:
        case Order::Kind::picture:
        case Order::Kind::figure:
        case Order::Kind::stop_figure:
            break; // the window's
    }
}

void Work::poll() {
    tell_step();
    segmentation_.poll();
    mesh_pulling_.poll();
    label_export_.poll();
    saving_.poll();
}

std::string Work::take_message() {
    std::string refusal = session().take_refusal();
    if (refusal.empty())
        refusal = hand_.touch().take_message();
    return refusal.empty() ? std::exchange(message_, {}) : refusal;
}

bool Work::leaving_loses_edits() {
    return mesh_pulling_.is_pulled() || saving_.leaving_loses_steps();
}

void Work::step_back(bool is_undo) {
    size_t redo_steps = edited().redo_steps;
    const auto step = [&] { return is_undo ? session().undo() : session().redo(); };
    if (!step()) { // a long way back: the editor comes after
        session().settle();
        redo_steps = edited().redo_steps;
        step();
    }
    stepping_ = {is_undo, redo_steps, session().commands_given()};
    notes().expect_change();
}

// Says which step was undone or redone, once all that was asked for is done.
void Work::tell_step() {
    if (!stepping_)
        return;
    const EditState now = edited();
    if (now.commands_done < stepping_->command)
        return;
    const Stepping asked = *std::exchange(stepping_, std::nullopt);
    if (now.redo_steps == asked.redo_steps)
        return; // it was refused
    const std::vector<std::string> titles = session().step_titles();
    const size_t step = now.undo_steps - (asked.is_undo ? 0 : 1);
    if (step < titles.size())
        tell(fmt::format("{}: {}", asked.is_undo ? "undone" : "redone", titles[step]));
}

void Work::follow_notes(ViewState& state, bool is_busy) {
    const std::optional<Notes::Bound> before = notes().known().bound;
    notes().follow(state, is_busy || hand_.presses_widget());
    if (notes().known().bound != before)
        segmentation_.follow_bound();
}

void Work::show_as_wanted(ViewState& state) {
    const SeenAs now = seen_as(session().scene());
    if (now == state.seen_as)
        return;
    Scene scene = session().scene();
    if (show_as(scene, state.seen_as, session().parameters().iso, rays_))
        session().show(std::move(scene));
    else
        tell(fmt::format("expected a scene that can be shown by {}, found one with {}",
                         name_of(state.seen_as), name_of(now)));
    state.seen_as = seen_as(session().scene());
}

} // namespace palpate::view
