#include "apps/view/document/saving.h"

#include <unistd.h>

#include <filesystem>

#include "apps/view/document/free_name.h"
#include "engine/base/profile.h"

namespace palpate::view {

namespace {

constexpr std::chrono::minutes kAutosave(5); // of the volumes; steps are kept at once

// Beside the volume; in the current folder where nothing can be written there.
std::string folder_beside(const std::string& path, const std::string& title) {
    std::filesystem::path name(title);
    if (name.extension() == ".gz")
        name.replace_extension();
    const std::string stem = name.stem().string();
    const std::string project = stem.empty() || is_synthetic(title) ? "work" : stem;
    std::error_code ignored;
    const std::filesystem::path beside =
        is_synthetic(path) || path.empty()
            ? std::filesystem::path()
            : std::filesystem::absolute(path, ignored).lexically_normal().parent_path();
    const bool is_writable = !beside.empty() && ::access(beside.c_str(), W_OK) == 0;
    return std::filesystem::absolute((is_writable ? beside : ".") / (project + ".palpate"))
        .lexically_normal()
        .string();
}

} // namespace

Saving::Saving(OpenDocument& document, std::optional<Project::Opened> opened)
    : document_(document),
      opened_(document.edited().document),
      new_folder_(folder_beside(document.path(), document.title())) {
    if (opened)
        take(std::move(opened->project));
}

void Saving::take(Project project) {
    project_.emplace(std::move(project));
    project_->autosave_every(kAutosave);
}

std::string Saving::new_folder(bool names_hidden) const {
    const std::filesystem::path folder(new_folder_);
    return free_name(names_hidden ? folder.parent_path() / "work.palpate" : folder).string();
}

bool Saving::leaving_loses_steps() {
    const EditState now = document_.edited();
    if (project_ || now.undo_steps == 0)
        return false;
    Notes were = document_.notes().known();
    const Notes at_first = notes_of(opened_.notes).value_or(Notes());
    were.clip_planes = at_first.clip_planes;
    were.label_styles = at_first.label_styles;
    were.window = at_first.window;
    Document same = now.document;
    same.notes = opened_.notes;
    return document_.steps_file().recovered() > 0 || !same.is_same_as(opened_) || were != at_first;
}

Message Saving::saved_text() const {
    return project_ ? "saved to " + Message::name(project_->folder().string()) : Message();
}

bool Saving::is_saving() const {
    return creation_ || (project_ && project_->is_saving());
}

void Saving::save(const ViewState& state, const std::string& folder) {
    if (!project_ && folder.empty())
        return;
    if (!document_.threaded())
        return document_.tell("a script saves nothing");
    Session& session = document_.session();
    document_.notes().keep(state.notes);
    Scene scene = session.scene();
    scene.camera = state.camera;
    scene.fusion = document_.fusion(); // and not what a segmentation shows for a while
    scene.slice_transfer = grey_of(state);
    session.show(std::move(scene));
    Kept kept = session.kept();
    kept.crosshair_mm = state.crosshair_mm;
    kept.tool_radius_mm = state.radius_mm;
    kept.tool_label = state.label;
    kept.isos = state.iso.list;
    session.keep(kept);
    if (project_) {
        if (Result<void> begun = project_->begin_save(session); !begun)
            document_.tell(Message::why(begun.error()));
        return;
    }
    if (creation_)
        return document_.tell("saving; one save at a time");
    if (std::error_code ignored; std::filesystem::exists(folder, ignored))
        return fail_save(folder, Message::name(folder) + " is there already: choose another name");
    session.settle();
    creating_ = folder;
    creation_.emplace(
        Project::begin_create_from(folder, session, document_.file(), document_.loaded().modality));
}

void Saving::fail_save(std::string folder, Message reason) {
    document_.tell(reason);
    failed_save_ = {std::move(folder), std::move(reason)};
}

void Saving::poll() {
    Session& session = document_.session();
    if (creation_)
        if (std::optional<Result<Project>> made = creation_->poll(session)) {
            creation_.reset();
            if (!*made)
                return fail_save(creating_, Message::why(made->error()));
            take(std::move(**made));
            document_.steps_file().discard(); // it has them
            document_.set_title(project_->folder().filename().string());
            new_project_ = project_->folder().string();
            document_.tell("saved to " + Message::name(new_project_) +
                           "; later steps are kept there as they are done");
        }
    if (!project_)
        return;
    if (const std::optional<Result<void>> ended = project_->poll(session, profile::now_ns()))
        document_.tell(*ended ? saved_text() : Message::why(ended->error()));
}

Result<void> add_maps(Project::Opened& project) {
    if (project.unsaved > 0)
        return {};
    const SessionSetup& setup = project.setup;
    const Volume* grey = setup.document.find(setup.grey);
    const Grid grid = (grey ? *grey : setup.document.first()).grid();
    for (const std::string& name : {setup.labels.empty() ? OpenDocument::kLabels : setup.labels,
                                    std::string(OpenDocument::kSeeds)})
        if (!setup.document.find(name))
            PALPATE_TRY(project.add({name, VolumeKind::labels, empty_labels(grid)}));
    return {};
}

} // namespace palpate::view
