#include "apps/palpate/touch_strokes.h"

#include <utility>

namespace palpate {

namespace fs = std::filesystem;

Result<std::optional<Journal>> begin_journal(const TouchedStrokes& strokes,
                                             const Document& document) {
    if (!strokes.in_journal())
        return std::optional<Journal>();
    std::error_code error;
    if (fs::exists(strokes.journal(), error))
        return fail(
            "{}: holds strokes of an interrupted touch or edit, or of --journal; `palpate edit "
            "SCENE --recover -o {}` applies them; remove the file to start again",
            strokes.journal().string(), strokes.output);
    PALPATE_TRY(Journal made, Journal::create(strokes.journal(), Journal::base_of(document)));
    return std::optional<Journal>(std::move(made));
}

Result<std::optional<Project::Opened>> open_project(const TouchedStrokes& strokes,
                                                    const std::stop_token& stop) {
    if (!strokes.in_project())
        return std::optional<Project::Opened>();
    if (!strokes.labels.empty())
        return fail(
            "--labels: a tool that edits a project changes the project's own labels; leave out "
            "--labels");
    PALPATE_TRY(Project::Opened opened,
                Project::open(strokes.scene, {.unsaved = true, .stop = stop}));
    return std::optional<Project::Opened>(std::move(opened));
}

SessionSetup setup_in_project(SessionSetup project, SessionSetup felt, EditSetup& edit) {
    const bool on_labels = edit.operation.on_labels();
    if (project.grey.empty())
        project.grey = project.document.volumes.front().name;
    if (project.labels.empty() && !felt.labels.empty())
        project.labels = project.grey; // a label map stands for both
    edit.on = on_labels ? project.labels : project.grey;
    edit.guide = on_labels ? project.grey : project.labels;
    project.touch = std::move(felt.touch);
    project.parameters = felt.parameters;
    project.felt_surface = std::move(felt.felt_surface);
    return project;
}

Result<void> end_journal(const TouchedStrokes& strokes, Result<void> done) {
    const Result<Journal::Contents> kept = Journal::peek(strokes.journal());
    const bool empty = kept && kept->entries.empty();
    std::error_code ignored;
    if (done ? !strokes.keep_journal : empty)
        fs::remove(strokes.journal(), ignored);
    if (done || empty)
        return done;
    return fail(
        "{}; the finished strokes are in {}, and `palpate edit SCENE --recover -o {}` applies them",
        done.error().message, strokes.journal().string(), strokes.output);
}

} // namespace palpate
