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

// The scene behind the views: rays or meshes in 3D, colours for labels that a person may draw.
Scene base_of(const OpenedScene& opened) {
    Scene scene = opened.scene;
    if (!scene.ray_cast && scene.surfaces.empty()) {
        scene.slices.clear();
        scene.ray_cast = default_ray_cast(RayMode::alpha, opened.loaded);
        scene.camera = default_camera(scene, opened.loaded.data);
    }
    if (!scene.labels)
        scene.labels = LabelLayer{};
    return scene;
}

GreyWindow window_of(const TransferFunction& function, ValueRange range);

// The slices' transfer function that a scene has, or the default one.
TransferFunction shown_grey(const Scene& scene, const LoadedScene& loaded) {
    return scene.slice_transfer.colors.empty() ? default_slice_transfer(loaded)
                                               : scene.slice_transfer;
}

// All pages of the document's notes: those that it has, and else what files say.
NotePages all_notes(const SessionSetup& setup, const LoadedScene& loaded) {
    Notes notes;
    take_from_scene(notes, setup.scene);
    notes.label_names = loaded.label_names;
    const TransferFunction grey = shown_grey(setup.scene, loaded);
    const GreyWindow window = window_of(grey, loaded.data.volume.range());
    notes.window = {
        window.low, window.high,
        !grey.colors.empty() && grey.colors.front().color.x > grey.colors.back().color.x};
    NotePages::Texts there = setup.document.notes.texts();
    std::erase_if(there, [](const auto& page) { // a project has its own names
        return page.second == "null" && (page.first == "window" || page.first == "label_names");
    });
    return pages_of(notes).with(there);
}

SessionSetup bare_setup_of(Source& source, bool threaded) {
    const OpenedScene& opened = source.scene;
    const SceneData& data = opened.loaded.data;
    if (source.project) {
        SessionSetup setup = std::move(source.project->setup);
        if (setup.grey.empty())
            setup.grey = setup.document.volumes.front().name;
        if (setup.labels.empty())
            setup.labels = Work::kLabels; // that a person may draw
        std::optional<LabelLayer> of_seeds = std::move(setup.scene.overlay);
        setup.scene = base_of(opened);
        if (!setup.scene.overlay)
            setup.scene.overlay = std::move(of_seeds);
        setup.edit.threaded = threaded;
        return setup;
    }
    SessionSetup setup{
        .document = source.steps ? std::move(source.steps->document) : fresh_document(data),
        .grey = Work::kGrey,
        .labels = Work::kLabels,
        .scene = base_of(opened)};
    setup.parameters.iso = default_iso(opened.loaded); // where the walls of cuts are smooth
    setup.edit.threaded = threaded;
    if (source.steps && source.steps->journal) {
        setup.edit.journal.emplace(std::move(*source.steps->journal));
        setup.edit.journal_may_end = true;
        setup.edit.begun = std::move(source.steps->history);
    }
    return setup;
}

SessionSetup setup_of(Source& source, bool threaded) {
    SessionSetup setup = bare_setup_of(source, threaded);
    setup.document.notes = all_notes(setup, source.scene.loaded);
    return setup;
}

GreyWindow window_of(const TransferFunction& function, ValueRange range) {
    if (!function.colors.empty() && function.colors.front().value < function.colors.back().value)
        return {function.colors.front().value, function.colors.back().value};
    return range.min < range.max ? GreyWindow{range.min, range.max}
                                 : limited({range.min, range.min + 1.0}, range);
}

std::string title_of(const SceneFile& file) {
    return is_synthetic(file.volume) ? file.volume
                                     : std::filesystem::path(file.volume).filename().string();
}

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

// Whether values may be those of a CT in HU: from air to bone at least.
bool seems_hu(const ValueRange& range) {
    return range.min <= -900.0f && range.max >= 300.0f;
}

} // namespace

void add_windows(Subject& subject, const LoadedScene& loaded) {
    const auto add = [&](const std::string& name, double low, double high) {
        subject.windows.push_back({low, high});
        subject.window_names.push_back(name);
    };
    const auto add_all = [&] {
        const GreyWindow all = window_of({}, subject.range);
        add("all values", all.low, all.high);
    };
    const auto usual = window_of(default_slice_transfer(loaded), subject.range);
    const auto add_usual = [&](const std::string& before) {
        const double zero = zero_hu(loaded);
        struct Usual {
            const char* name;
            double level, width;
        };
        for (const Usual& w : {Usual{"soft tissue", 40, 400},
                               {"lung", -600, 1500},
                               {"liver", 90, 150},
                               {"bone", 480, 2500},
                               {"brain", 40, 80}})
            add(before + w.name, zero + w.level - 0.5 * w.width, zero + w.level + 0.5 * w.width);
    };
    if (loaded.modality == "CT") {
        add_usual("");
        add_all();
    } else {
        add("default", usual.low, usual.high);
        add_all();
        if (loaded.modality.empty() && seems_hu(subject.range))
            add_usual("CT ");
    }
}

Work::Work(Source source, glm::uvec2 window_px, double text_scale, bool threaded)
    : threaded_(threaded),
      title_(source.project ? source.project->project.folder().filename().string()
                            : title_of(source.scene.file)),
      file_(source.scene.file),
      loaded_(source.scene.loaded),
      unit_(value_unit(loaded_)),
      zero_hu_(palpate::zero_hu(loaded_)),
      series_(series_in(loaded_.notes)),
      steps_file_(source.steps ? source.steps->path : std::filesystem::path()),
      recovered_steps_(source.steps ? source.steps->recovered : 0),
      session_(setup_of(source, threaded)),
      noted_(session_),
      opened_(session_.state().document),
      figures_(threaded),
      touch_(session_, threaded, center_mm(loaded_.data.volume.grid()),
             half_size_mm(loaded_.data.volume.grid())) {
    grey_ = session_.sources().grey;
    labels_ = session_.sources().labels;
    if (source.project) {
        for (const std::string& text : source.project->notes)
            tell_also(text);
        if (const size_t steps = source.project->unsaved)
            tell_also(fmt::format("{} step{} since the last save {} there", steps,
                                  steps == 1 ? "" : "s", steps == 1 ? "is" : "are"));
        take_project(std::move(source.project->project));
    }
    if (source.steps)
        tell_also(source.steps->note);
    said_ = said_of(loaded_, path(), title_);
    tell_also(said_);
    std::filesystem::path name(title_);
    if (name.extension() == ".gz")
        name.replace_extension();
    const std::string stem = name.stem().string();
    new_folder_ = std::filesystem::absolute(
                      stem.empty() || is_synthetic(title_) ? "work.palpate" : stem + ".palpate")
                      .string();
    const Volume& volume = loaded_.data.volume;
    subject_.grid = volume.grid();
    subject_.range = volume.range();
    add_windows(subject_, loaded_);
    ViewState& home = subject_.home;
    home.size_px = window_px;
    home.text_scale = text_scale;
    home.slices = slice_views(subject_.grid);
    move_crosshair(home, subject_.grid,
                   session_.kept().crosshair_mm.value_or(center_mm(subject_.grid)));
    home.camera = session_.scene().camera;
    home.stereo = stereo_view_of(source.scene.scene, home.camera);
    const Scene& opened = source.scene.scene;
    if (!opened.slices.empty()) {
        home.slab_mm = opened.slices.front().slab_mm;
        home.slab_mode = opened.slices.front().slab_mode;
    }
    fusion_ = opened.fusion;
    if (opened.fusion)
        home.fusion_opacity = opened.fusion->opacity;
    if (const auto& overlay = session_.scene().overlay)
        home.overlay_opacity = overlay->slice_opacity;
    if (opened.labels)
        home.outline_px = opened.labels->outline_px;
    home.seen_as = seen_as(session_.scene());
    home.notes = noted_.known();
    if (const std::optional<Notes::Window>& window = home.notes.window) { // it always is
        home.window = {window->low, window->high};
        home.window_inverted = window->is_inverted;
    }
    home.radius_mm =
        std::clamp(session_.kept().tool_radius_mm.value_or(home.radius_mm), 0.1, 100.0);
    home.label = session_.kept().tool_label.value_or(home.label);
    subject_.path = [this](glm::uvec3 from, glm::uvec3 to, int axis) {
        return wire_path(from, to, axis);
    };
    subject_.value_at = [this](glm::dvec3 point_mm) -> std::optional<double> {
        const float value = value_at(grey_, point_mm).value_or(NAN);
        return std::isnan(value) ? std::nullopt : std::optional<double>(value);
    };
    subject_.label_at = [this](glm::dvec3 point_mm) {
        return static_cast<uint16_t>(value_at(labels_, point_mm).value_or(0.0f));
    };
    subject_.mesh_met = [this](const Ray& ray) { return mesh_ ? mesh_->met(ray) : std::nullopt; };
    subject_.mesh_near = [this](glm::dvec3 point_mm, double within_mm) {
        return mesh_ ? mesh_->near(point_mm, within_mm) : std::nullopt;
    };
    subject_.pick = [this](const Ray& ray) {
        const EditState state = session_.state();
        return first_seen(ray, before_press_ ? *before_press_ : *state.document.find(grey_),
                          session_.scene());
    };
}

// Gives the session what strokes of the left button's tool do.
bool Work::take_tool(const ViewState& state) {
    const Carve carve = state.tool->stroke;
    if (!is_stroke(carve) || (is_on_labels(carve) && !put_labels()))
        return false;
    std::optional<EditSetup> setup = edit_of(carve, TipShape::ball, state);
    return setup && rack_.hold(session_, std::move(*setup));
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
    setup.guide = grey_;
}

void Work::obey(const Order& order, const ViewState& state) {
    using Kind = EditInput::Kind;
    const StrokePose pose{order.time_s, {order.at_mm}};
    switch (order.kind) {
        case Order::Kind::stroke_down:
            if (touch_.running())
                message_ = "a hand is running: stop it to draw with the mouse";
            down_ = !down_ && take_tool(state) && session_.stroke(Kind::down, pose);
            last_ = pose;
            break;
        case Order::Kind::stroke_move:
            if (down_ && session_.stroke(Kind::move, pose)) // else the sweep leaves no gap
                last_ = pose;
            break;
        case Order::Kind::stroke_up:
        case Order::Kind::stroke_cancel: {
            if (!down_)
                break;
            StrokePose end = order.kind == Order::Kind::stroke_up ? pose : last_;
            end.time_s = std::max(order.time_s, last_.time_s);
            while (!session_.stroke(Kind::up, end)) // the ring is full
                session_.settle();
            down_ = false;
            if (order.kind == Order::Kind::stroke_cancel)
                session_.undo();
            break;
        }
        case Order::Kind::undo:
        case Order::Kind::redo:
            noted_.keep(state.notes);
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
            session_.put({kSeeds, VolumeKind::labels, empty_labels(subject_.grid)}, "clear seeds");
            break;
        case Order::Kind::fill_wire:
            fill_wire(state);
            break;
        case Order::Kind::keep_largest:
        case Order::Kind::fill_holes:
            clean_label(order, state);
            break;
        case Order::Kind::mesh_make:
        case Order::Kind::mesh_apply:
        case Order::Kind::mesh_drop:
        case Order::Kind::pull_down:
        case Order::Kind::pull_move:
        case Order::Kind::pull_up:
        case Order::Kind::pull_cancel:
            obey_mesh(order, state);
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

void Work::tell_also(const std::string& message) {
    message_ += (message_.empty() || message.empty() ? "" : "; ") + message;
}

std::string Work::take_message() {
    std::string refusal = session_.take_refusal();
    if (refusal.empty())
        refusal = touch_.take_message();
    return refusal.empty() ? std::exchange(message_, {}) : refusal;
}

std::optional<float> Work::value_at(const std::string& volume, glm::dvec3 point_mm) {
    const EditState state = edited();
    const Volume* in = state.document.find(volume);
    const auto sample = in ? sample_at(in->grid(), point_mm) : std::nullopt;
    return sample ? std::optional(in->value(*sample)) : std::nullopt;
}

std::string Work::text_at(glm::dvec3 point_mm) {
    const auto sample = sample_at(subject_.grid, point_mm);
    if (!sample)
        return "";
    const float value = value_at(grey_, point_mm).value();
    std::string text = fmt::format("({}, {}, {})  ", sample->x, sample->y, sample->z);
    text += std::isnan(value) ? "no data" : fmt::format("{:g}", value);
    if (const std::string u = unit(); !u.empty() && !std::isnan(value))
        text += " " + u;
    if (const auto label = subject_.label_at(point_mm))
        text += fmt::format("  label {}", name_of_label(label));
    return text;
}

Json Work::dump(const ViewState& state) {
    session_.settle();
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
    json["mesh"] = {{"vertices", mesh_ ? mesh_->mesh().positions.size() : 0},
                    {"pulled", mesh_is_pulled()},
                    {"label", mesh_ ? mesh_->label() : 0}};
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
