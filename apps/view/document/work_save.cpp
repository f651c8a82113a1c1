// The part of a document's work that keeps it in a project.

#include <filesystem>

#include "apps/view/document/free_name.h"
#include "apps/view/document/work.h"
#include "engine/base/profile.h"

namespace palpate::view {

namespace {
constexpr std::chrono::minutes kAutosave(5); // of the volumes; steps are kept at once
} // namespace

Result<void> add_maps(Project::Opened& project) {
    if (project.unsaved > 0)
        return {};
    const SessionSetup& setup = project.setup;
    const Volume* grey = setup.document.find(setup.grey);
    const Grid grid = (grey ? *grey : setup.document.first()).grid();
    for (const std::string& name :
         {setup.labels.empty() ? Work::kLabels : setup.labels, std::string(Work::kSeeds)})
        if (!setup.document.find(name))
            PALPATE_TRY(project.add({name, VolumeKind::labels, empty_labels(grid)}));
    return {};
}

void Work::take_project(Project project) {
    project_.emplace(std::move(project));
    project_->autosave_every(kAutosave);
}

std::string Work::new_folder(bool names_hidden) const {
    const std::filesystem::path folder(new_folder_);
    return free_name(names_hidden ? folder.parent_path() / "work.palpate" : folder).string();
}

std::string Work::without_names(std::string message) const {
    message = without_name(std::move(message), said_, "(notes about the files are hidden)");
    // The longest come first: a path holds the name of its file.
    for (const std::string& name :
         {project_ ? project_->folder().string() : "", path(), new_folder_, title()})
        message = without_name(std::move(message), name, "(name hidden)");
    return message;
}

bool Work::leaving_loses_edits() {
    if (mesh_pulling_.is_pulled())
        return true;
    const EditState now = edited();
    if (project_ || now.undo_steps == 0)
        return false;
    Notes were = notes().known();
    const Notes at_first = notes_of(opened_.notes).value_or(Notes());
    were.clip_planes = at_first.clip_planes;
    were.label_styles = at_first.label_styles;
    were.window = at_first.window;
    Document same = now.document;
    same.notes = opened_.notes;
    return steps_file().recovered() > 0 || !same.is_same_as(opened_) || were != at_first;
}

bool Work::is_saving() const {
    return creation_ || (project_ && project_->is_saving());
}

void Work::save(const ViewState& state, const std::string& folder) {
    if (!threaded()) {
        message_ = "a script saves nothing";
        return;
    }
    notes().keep(state.notes);
    Scene scene = session().scene();
    scene.camera = state.camera;
    scene.fusion = fusion(); // and not what a segmentation shows for a while
    scene.slice_transfer = grey_of(state);
    session().show(std::move(scene));
    Kept kept = session().kept();
    kept.crosshair_mm = state.crosshair_mm;
    kept.tool_radius_mm = state.radius_mm;
    kept.tool_label = state.label;
    session().keep(kept);
    if (project_) {
        if (Result<void> begun = project_->begin_save(session()); !begun)
            message_ = begun.error().message;
        return;
    }
    if (creation_) {
        message_ = "saving; one save at a time";
        return;
    }
    if (std::error_code ignored; std::filesystem::exists(folder, ignored)) {
        message_ = fmt::format("{} is there already: choose another name", folder);
        failed_save_ = {folder, message_};
        return;
    }
    session().settle();
    creating_ = folder;
    creation_.emplace(Project::begin_create_from(folder, session(), file(), loaded().modality));
}

void Work::begin_export(const ViewState& state, const std::string& path) {
    if (!threaded()) {
        message_ = "a script saves nothing";
        return;
    }
    if (exporting_) {
        message_ = "writing; one file at a time";
        return;
    }
    session().settle(); // strokes under way are in it
    const EditState now = edited();
    const Volume* labels = now.document.find(labels_name());
    if (!labels) {
        message_ = "there are no labels to write: draw or segment first";
        return;
    }
    std::error_code ignored;
    const auto file = std::filesystem::absolute(free_name(path), ignored);
    exporting_ = std::make_unique<LabelExport>();
    exporting_->done = std::async(std::launch::async, [labels = *labels, label = state.label, file,
                                                       stop = exporting_->stop.get_token()] {
        return export_labels(labels, label, file, stop);
    });
    message_ = fmt::format("writing {} ..", file.string());
}

void Work::poll_export() {
    if (!exporting_ ||
        exporting_->done.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
        return;
    const Result<std::string> done = exporting_->done.get();
    exporting_.reset();
    message_ = done ? *done : done.error().message;
}

void Work::poll() {
    tell_step();
    poll_segmenting();
    mesh_pulling_.poll();
    poll_export();
    if (creation_)
        if (std::optional<Result<Project>> made = creation_->poll(session())) {
            creation_.reset();
            if (!*made) {
                message_ = made->error().message;
                failed_save_ = {creating_, message_};
                return;
            }
            take_project(std::move(**made));
            steps_file().discard(); // it has them
            set_title(project_->folder().filename().string());
            new_project_ = project_->folder().string();
            message_ = fmt::format("saved to {}; later steps are kept there as they are done",
                                   project_->folder().string());
        }
    if (!project_)
        return;
    if (const std::optional<Result<void>> ended = project_->poll(session(), profile::now_ns()))
        message_ = *ended ? fmt::format("saved to {}", project_->folder().string())
                          : ended->error().message;
}

} // namespace palpate::view
