#include "apps/view/document/work.h"

#include <algorithm>
#include <filesystem>

#include "apps/view/drawing/pick.h"
#include "apps/view/script/dump.h"
#include "apps/view/tools/tool.h"
#include "engine/base/json.h"
#include "engine/scene/scene_names.h"
#include "engine/session/default_scene.h"
#include "engine/session/feel.h"
#include "engine/volume/content_hash.h"

namespace palpate::view {

namespace {

const char* slab_name(SlabMode mode) {
    for (const auto& [name, one] : Names<SlabMode>::list)
        if (one == mode)
            return name;
    return "";
}
Json stereo_json(const ViewState& state) {
    const StereoView& stereo = state.stereo;
    Json json{{"on", stereo.on},
              {"swap_eyes", stereo.swap_eyes},
              {"mirror", stereo.mirror},
              {"separation", stereo.separation},
              {"profile", stereo.profile ? stereo.profile->name : ""}};
    for (const auto& [name, layout] : Names<StereoLayout>::list)
        if (layout == stereo.layout)
            json["layout"] = name;
    if (state.cursor_mm)
        json["cursor_mm"] = json_of(*state.cursor_mm);
    return json;
}
// Half the volume's size along the patient's axes.
glm::dvec3 half_size_mm(const Grid& grid) {
    glm::dvec3 size(0.0);
    for (int axis = 0; axis < 3; ++axis)
        size += glm::abs(glm::dvec3(grid.world_from_index[axis])) * double(grid.size[axis]);
    return 0.5 * size;
}
Json box_json(const Box& box) {
    return {box.low_px.x, box.low_px.y, box.size_px.x, box.size_px.y};
}

} // namespace

Work::Work(Source source, glm::uvec2 window_px, double text_scale, bool threaded)
    : OpenDocument(source, window_px, text_scale, threaded),
      opened_(edited().document),
      figures_(threaded),
      mesh_pulling_(*this),
      touch_(session(), threaded, center_mm(subject().grid), half_size_mm(subject().grid)) {
    if (source.project)
        take_project(std::move(source.project->project));
    said_ = said_of(loaded(), path(), title());
    std::filesystem::path name(title());
    if (name.extension() == ".gz")
        name.replace_extension();
    const std::string stem = name.stem().string();
    new_folder_ = std::filesystem::absolute(
                      stem.empty() || is_synthetic(title()) ? "work.palpate" : stem + ".palpate")
                      .string();
    subject_.path = [this](glm::uvec3 from, glm::uvec3 to, int axis) {
        return wire_path(from, to, axis);
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
        return first_seen(ray, before_press_ ? *before_press_ : grey(), session().scene());
    };
}

// Gives the session what strokes of the left button's tool do.
bool Work::take_tool(const ViewState& state) {
    const Carve carve = state.tool->stroke;
    if (!is_stroke(carve) || (is_on_labels(carve) && !make_labels()))
        return false;
    std::optional<EditSetup> setup = edit_of(carve, TipShape::ball, state);
    return setup && rack_.hold(session(), std::move(*setup));
}

std::optional<EditSetup> Work::edit_of(Carve carve, TipShape shape, const ViewState& state) {
    if (carve == Carve::seed)
        return seed_brush(state, shape);
    EditSetup setup =
        make_tool(carve, shape, state.radius_mm, state.label, state.stylus.rate_per_s, tool_for());
    if (is_on_labels(carve))
        confine(setup, state);
    return setup;
}

void Work::confine(EditSetup& setup, const ViewState& state) {
    setup.operation.over = free_labels(state);
    if (!state.only_values)
        return;
    setup.operation.only_values = {state.only_values->low, state.only_values->high};
    setup.guide = grey_name();
}

void Work::obey(const Order& order, const ViewState& state) {
    using Kind = EditInput::Kind;
    const StrokePose pose{order.time_s, {order.at_mm}};
    switch (order.kind) {
        case Order::Kind::stroke_down:
            if (touch_.running())
                message_ = "a hand is running: stop it to draw with the mouse";
            down_ = !down_ && take_tool(state) && session().stroke(Kind::down, pose);
            last_ = pose;
            break;
        case Order::Kind::stroke_move:
            if (down_ && session().stroke(Kind::move, pose)) // else the sweep leaves no gap
                last_ = pose;
            break;
        case Order::Kind::stroke_up:
        case Order::Kind::stroke_cancel: {
            if (!down_)
                break;
            StrokePose end = order.kind == Order::Kind::stroke_up ? pose : last_;
            end.time_s = std::max(order.time_s, last_.time_s);
            while (!session().stroke(Kind::up, end)) // the ring is full
                session().settle();
            down_ = false;
            if (order.kind == Order::Kind::stroke_cancel)
                session().undo();
            break;
        }
        case Order::Kind::undo:
        case Order::Kind::redo:
            notes().keep(state.notes);
            step_back(order.kind == Order::Kind::undo);
            break;
        case Order::Kind::save:
            if (project_ || !order.path.empty())
                save(state, order.path);
            break;
        case Order::Kind::export_measures:
            export_measures(state, order.path);
            break;
        case Order::Kind::export_labels:
            begin_export(state, order.path);
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
            break;
        case Order::Kind::segment:
            begin_segmenting(state);
            break;
        case Order::Kind::bound:
            begin_bounding(state);
            break;
        case Order::Kind::stop_segmenting:
            if (segmenting_)
                segmenting_->stop();
            break;
        case Order::Kind::clear_seeds:
            session().put({kSeeds, VolumeKind::labels, empty_labels(subject_.grid)}, "clear seeds");
            break;
        case Order::Kind::fill_wire:
            fill_wire(state);
            break;
        case Order::Kind::keep_largest:
        case Order::Kind::fill_holes:
        case Order::Kind::mesh_make:
        case Order::Kind::mesh_apply:
        case Order::Kind::mesh_drop:
        case Order::Kind::pull_down:
        case Order::Kind::pull_move:
        case Order::Kind::pull_up:
        case Order::Kind::pull_cancel:
            mesh_pulling_.obey(order, state);
            break;
        case Order::Kind::tell:
            message_ = order.path;
            break;
        case Order::Kind::hand_start:
        case Order::Kind::hand_stop:
        case Order::Kind::hand_arm:
        case Order::Kind::hand_disarm:
            obey_hand(order, state);
    }
}

std::string Work::take_message() {
    std::string refusal = session().take_refusal();
    if (refusal.empty())
        refusal = touch_.take_message();
    return refusal.empty() ? std::exchange(message_, {}) : refusal;
}

Json Work::dump(const ViewState& state) {
    session().settle();
    const EditState edit = edited();
    Json json;
    json["size"] = {state.size_px.x, state.size_px.y};
    json["layout"] = name_of(state.layout);
    json["alone"] = state.alone ? name_of(*state.alone) : "";
    for (const Places::View& view : places_of(state).views)
        json["panels"][name_of(view.panel)] = box_json(view.box);
    json["tools_open"] = state.tools_open;
    json["help_open"] = state.help_open;
    json["crosshair_mm"] = json_of(state.crosshair_mm);
    if (const auto at = sample_at(subject_.grid, state.crosshair_mm))
        json["crosshair_sample"] = {at->x, at->y, at->z};
    json["at_crosshair"] = text_at(state.crosshair_mm);
    for (const Panel panel : kPanels) {
        if (!is_slice(panel))
            continue;
        const SliceView& slice = state.slices[static_cast<size_t>(panel)];
        json["slices"][name_of(panel)] = {{"right", json_of(slice.right)},
                                          {"up", json_of(slice.up)},
                                          {"towards", json_of(slice.towards)},
                                          {"center_mm", json_of(slice.center_mm)},
                                          {"zoom", slice.zoom},
                                          {"letters", letters_of(slice.right)}};
    }
    json["camera"] = {{"eye_mm", json_of(state.camera.eye_mm)},
                      {"target_mm", json_of(state.camera.target_mm)},
                      {"up", json_of(state.camera.up)},
                      {"view_angle_deg", state.camera.view_angle_deg}};
    json["window"] = {state.window.low, state.window.high};
    json["tool"] = {
        {"hand", state.tool->name}, {"radius_mm", state.radius_mm}, {"label", state.label}};
    if (state.only_values)
        json["tool"]["only_values"] = {state.only_values->low, state.only_values->high};
    json["recovered_steps"] = state.recovered_steps;
    json["labels"] = {{"shown", state.labels_shown}, {"opacity", state.label_opacity}};
    dump_panels(*this, state, json);
    json["slab"] = {{"mm", state.slab_mm}, {"mode", slab_name(state.slab_mode)}};
    json["stereo"] = stereo_json(state);
    json["overlays"] = {{"fusion_opacity", state.fusion_opacity},
                        {"overlay_opacity", state.overlay_opacity},
                        {"outline_px", state.outline_px}};
    json["segment"] = dump_segmenting(state);
    const PulledMesh* mesh = mesh_pulling_.mesh();
    json["mesh"] = {{"vertices", mesh ? mesh->mesh().positions.size() : 0},
                    {"pulled", mesh && mesh->is_pulled()},
                    {"label", mesh ? mesh->label() : 0}};
    json["stroke_is_down"] = down_;
    json["hand"] = dump_hand(state);
    json["seen_as"] = name_of(state.seen_as);
    for (const NamedVolume& volume : edit.document.volumes)
        json["document"][volume.name] = fmt::format("{:016x}", content_hash(volume.volume));
    json["undo_steps"] = edit.undo_steps;
    json["redo_steps"] = edit.redo_steps;
    json["refusal"] = edit.refusal;
    return json;
}

} // namespace palpate::view
