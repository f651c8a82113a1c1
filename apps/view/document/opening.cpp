#include "apps/view/document/opening.h"

#include <algorithm>

#include "apps/view/document/open_document.h"
#include "engine/session/default_scene.h"
#include "engine/session/feel.h"
#include "engine/volume/builder.h"
#include "engine/volume/extent.h"

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
    for (size_t i = 0; i < std::min(scene.surfaces.size(), opened.file.surfaces.size()); ++i)
        if (opened.file.surfaces[i].labels && scene.surfaces[i].label_styles.empty())
            scene.surfaces[i].live_labels = true; // a person may change them
    return scene;
}

GreyWindow window_of(const TransferFunction& function, ValueRange range) {
    if (!function.colors.empty() && function.colors.front().value < function.colors.back().value)
        return {function.colors.front().value, function.colors.back().value};
    return range.min < range.max ? GreyWindow{range.min, range.max}
                                 : limited({range.min, range.min + 1.0}, range);
}

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
            setup.labels = OpenDocument::kLabels; // that a person may draw
        std::optional<LabelLayer> of_seeds = std::move(setup.scene.overlay);
        setup.scene = base_of(opened);
        if (!setup.scene.overlay)
            setup.scene.overlay = std::move(of_seeds);
        setup.edit.threaded = threaded;
        return setup;
    }
    SessionSetup setup{
        .document = source.steps ? std::move(source.steps->document) : fresh_document(data),
        .grey = OpenDocument::kGrey,
        .labels = OpenDocument::kLabels,
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

// Whether values may be those of a CT in HU: from air to bone at least.
bool seems_hu(const ValueRange& range) {
    return range.min <= -900.0f && range.max >= 300.0f;
}

// 1 .. 9. What is a CT by its modality, or may be one by its values where no file says what they
// are, has the same windows under the same keys, and the default one after them if it is none of
// them. Others have the default window and all values. Of equal windows one is listed.
void add_windows(Subject& subject, const LoadedScene& loaded) {
    const auto add = [&](const std::string& name, const GreyWindow& window) {
        if (std::ranges::find(subject.windows, window) != subject.windows.end())
            return;
        subject.windows.push_back(window);
        subject.window_names.push_back(name);
    };
    const GreyWindow all = window_of({}, subject.range);
    const GreyWindow usual = window_of(default_slice_transfer(loaded), subject.range);
    if (loaded.modality == "CT" || (loaded.modality.empty() && seems_hu(subject.range))) {
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
            add(w.name, {zero + w.level - 0.5 * w.width, zero + w.level + 0.5 * w.width});
        add("all values", all);
    } else if (usual == all) {
        return add("all values", all);
    }
    add("default", usual);
    add("all values", all);
}

// Takes back all steps that came with a document, and does them again; the grey values between.
Volume grey_before_steps(SessionSetup& setup) {
    History& history = *setup.edit.begun;
    size_t back = 0;
    for (;; ++back) {
        const Result<std::optional<Document>> before = history.undo(setup.document);
        if (!before || !*before)
            break;
        setup.document = **before;
    }
    const Volume first = *setup.document.find(setup.grey);
    for (; back > 0; --back)
        setup.document = history.redo(setup.document).value().value();
    return first;
}

} // namespace

SessionSetup setup_of(Source& source, bool threaded) {
    SessionSetup setup = bare_setup_of(source, threaded);
    if (setup.edit.begun)
        source.first_grey = grey_before_steps(setup);
    setup.document.notes = all_notes(setup, source.scene.loaded);
    return setup;
}

Subject subject_of(const OpenedScene& opened, const Session& session, const Notes& notes) {
    const Volume& volume = opened.loaded.data.volume;
    Subject subject;
    subject.grid = volume.grid();
    subject.range = volume.range();
    add_windows(subject, opened.loaded);
    ViewState& home = subject.home;
    home.slices = slice_views(subject.grid);
    move_crosshair(home, subject.grid,
                   session.kept().crosshair_mm.value_or(center_mm(subject.grid)));
    home.camera = session.scene().camera;
    home.change_label_mm = std::max(home.change_label_mm, largest_spacing_mm(subject.grid));
    home.stereo = stereo_view_of(opened.scene, home.camera);
    if (!opened.scene.slices.empty()) {
        home.slab_mm = opened.scene.slices.front().slab_mm;
        home.slab_mode = opened.scene.slices.front().slab_mode;
    }
    if (opened.scene.fusion)
        home.fusion_opacity = opened.scene.fusion->opacity;
    if (const auto& overlay = session.scene().overlay)
        home.overlay_opacity = overlay->slice_opacity;
    if (opened.scene.labels) {
        home.outline_px = opened.scene.labels->outline_px;
        home.label_edges = opened.scene.labels->edges;
    }
    home.seen_as = seen_as(session.scene());
    for (size_t i = 0; i < std::min(opened.scene.surfaces.size(), opened.file.surfaces.size()); ++i)
        if (opened.file.surfaces[i].labels && !opened.scene.surfaces[i].label_styles.empty())
            home.labels_in_3d = false; // the scene has their mesh, in colours of its own
    home.notes = notes;
    if (const std::optional<Notes::Window>& window = home.notes.window) { // it always is
        home.window = {window->low, window->high};
        home.window_inverted = window->is_inverted;
    }
    home.radius_mm = std::clamp(session.kept().tool_radius_mm.value_or(home.radius_mm), 0.1, 100.0);
    home.label = session.kept().tool_label.value_or(home.label);
    home.iso.list = session.kept().isos;
    return subject;
}

Volume empty_labels(const Grid& grid) {
    return VolumeBuilder(grid, ScalarType::u8).finish();
}

} // namespace palpate::view
