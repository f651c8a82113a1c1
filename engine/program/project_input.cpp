#include "engine/program/project_input.h"

#include <filesystem>

#include "engine/base/log.h"
#include "engine/base/option_name.h"
#include "engine/io/x3d.h"
#include "engine/program/scene_options.h"
#include "engine/session/project_description.h"

namespace palpate {

namespace {

void warn_of_idle_reading(const std::string& path, const ReadOptions& options) {
    if (options.frame || options.series || options.resample_slices)
        log::warning("{}: {}, {} and {} have no effect on a project", path, Option{"frame"},
                     Option{"series"}, Option{"resample-slices"});
}

} // namespace

Result<Project::Seen> look_at_project(const std::string& path, const std::stop_token& stop) {
    PALPATE_TRY(Project::Seen seen, Project::look(path, stop));
    for (const std::string& note : seen.notes)
        log::warning("{}", note);
    if (const size_t steps = seen.in_effect(); steps > 0)
        log::info("{}: with {} step{} since its last save", path, steps, steps == 1 ? "" : "s");
    return seen;
}

Result<LoadedVolume> load_project_volume(const std::string& path, bool labels,
                                         const ReadOptions& options) {
    warn_of_idle_reading(path, options);
    PALPATE_TRY(const Project::Seen seen, look_at_project(path, options.stop));
    const ProjectContents& contents = seen.contents;
    const Volume* volume = contents.document.find(labels ? contents.labels : contents.grey);
    if (!volume && labels)
        return fail("{}: expected a project with labels, found none", path);
    return LoadedVolume{volume ? *volume : contents.document.first(),
                        {},
                        {},
                        labels ? "" : contents.modality,
                        {},
                        {}};
}

Result<SceneFile> scene_file_of(const std::string& input) {
    if (Project::is_one(input)) {
        PALPATE_TRY(ProjectDescription read, read_project_description(project_folder(input)));
        SceneFile file = std::move(read.scene);
        file.volume = std::filesystem::absolute(project_folder(input)).string();
        file.labels = read.labels.empty() ? "" : file.volume;
        return file;
    }
    if (is_scene_file(input))
        return load_scene(input);
    if (is_x3d_file(input))
        return load_x3d_scene(input);
    SceneFile file;
    file.volume = input;
    return file;
}

Result<LoadedScene> load_scene_input(const std::string& input, const SceneFile& file,
                                     const ReadOptions& options) {
    if (!Project::is_one(input))
        return load_scene_data(file, options);
    warn_of_idle_reading(input, options);
    PALPATE_TRY(const Project::Seen seen, look_at_project(input, options.stop));
    const ProjectContents& contents = seen.contents;
    const Volume* grey = contents.document.find(contents.grey);
    LoadedScene scene{{grey ? *grey : contents.document.first(), std::nullopt, {}},
                      contents.modality,
                      {},
                      {},
                      {},
                      {}};
    if (file.labels == file.volume) {
        if (const Volume* labels = contents.document.find(contents.labels))
            scene.data.labels = *labels;
    } else if (!file.labels.empty()) {
        SceneFile labels_alone;
        labels_alone.folder = file.folder;
        labels_alone.volume = file.labels;
        labels_alone.labels = file.labels;
        PALPATE_TRY(LoadedScene loaded, load_scene_data(labels_alone, options));
        scene.notes = std::move(loaded.notes);
        scene.other_series = std::move(loaded.other_series);
        scene.warnings = std::move(loaded.warnings);
        scene.data.labels = std::move(loaded.data.labels);
        scene.label_names = std::move(loaded.label_names);
    }
    return scene;
}

} // namespace palpate
