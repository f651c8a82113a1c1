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
      mesh_writing_(*this),
      saving_(*this, std::move(source.project)),
      removed_(*this) {
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
        const std::optional<Volume> seen = labels_in_3d_ ? labels() : std::nullopt;
        return first_seen(ray, hand_.pointed_at(), session().scene(), seen ? &*seen : nullptr);
    };
}

void Work::obey(const DocumentOrder& order, const ViewState& state) {
    set_mask(edit_mask(state));
    PulledMesh* mesh = mesh_pulling_.mesh();
    const auto step = [&](bool is_undo) {
        notes().keep(state.notes);
        step_back(is_undo);
    };
    const Overloaded each{
        [&](const order::StrokeDown& to) {
            hand_.begin_stroke({to.time_s, {to.at_mm}}, state, to.disc_across);
        },
        [&](const order::StrokeMove& to) {
            hand_.move_stroke({to.time_s, {to.at_mm}});
        },
        [&](const order::StrokeUp& to) {
            hand_.end_stroke({to.time_s, {to.at_mm}});
        },
        [&](const order::StrokeCancel& now) { hand_.cancel_stroke(now.time_s); },
        [&](const order::StartHand& on) { hand_.start(on.device, state.stylus); },
        [&](order::StopHand) { hand_.touch().stop(); },
        [&](order::ArmHand) { hand_.touch().arm(); },
        [&](order::DisarmHand) { hand_.touch().disarm(); },
        [&](order::ResetRemoved) { removed_.reset(); },
        [&](order::Undo) { step(true); },
        [&](order::Redo) { step(false); },
        [&](const order::Save& to) { saving_.save(state, to.folder); },
        [&](const order::ExportMeasures& to) { export_measures(state, to.path); },
        [&](const order::ExportLabels& to) { label_export_.begin(state.label, to.path, to.each); },
        [&](const order::ExportMesh& to) { mesh_writing_.begin(to.made, to.path); },
        [&](order::StopMesh) { mesh_writing_.stop(); },
        [&](order::Segment) { segmentation_.begin(state); },
        [&](order::Bound) { segmentation_.bound(state); },
        [&](order::StopSegmenting) { segmentation_.stop(); },
        [&](order::ClearSeeds) { clear_seeds(); },
        [&](order::FillWire) { segmentation_.wire().fill(state); },
        [&](const order::ChangeLabel& by) { mesh_pulling_.change(state, *by.change); },
        [&](order::MakeMesh) { mesh_pulling_.make(state.label); },
        [&](order::ApplyMesh) { mesh_pulling_.apply(); },
        [&](order::DropMesh) { mesh_pulling_.drop(); },
        [&](const order::PullDown& from) {
            if (mesh)
                mesh->hold(from.at_mm, state.own.of<Pulling>().reach);
        },
        [&](const order::PullMove& to) {
            if (mesh)
                mesh->pull(to.at_mm);
        },
        [&](order::PullUp) {
            if (mesh)
                mesh->let_go(true);
        },
        [&](order::PullCancel) {
            if (mesh)
                mesh->let_go(false);
        },
        [&](const order::Tell& told) { tell(told.words); },
    };
    std::visit(each, order);
}

void Work::poll() {
    tell_step();
    segmentation_.poll();
    mesh_pulling_.poll();
    label_export_.poll();
    mesh_writing_.poll();
    saving_.poll();
    tell_locked();
}

Message Work::take_message() {
    std::string refusal = session().take_refusal();
    if (refusal.empty())
        refusal = hand_.touch().take_message();
    return refusal.empty() ? std::exchange(message_, {}) : Message(std::move(refusal));
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

void Work::tell_locked() {
    const EditState now = edited();
    if (std::exchange(met_spared_, now.met_spared) != now.met_spared)
        tell_also(locked_text(now.spared_label));
}

void Work::follow_notes(ViewState& state, bool is_busy) {
    const std::optional<Notes::Bound> before = notes().known().bound;
    notes().follow(state, is_busy || hand_.presses_widget());
    if (notes().known().bound != before)
        segmentation_.follow_bound();
}

void Work::show_as_wanted(ViewState& state) {
    labels_in_3d_ = state.labels_in_3d && state.labels_shown;
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
