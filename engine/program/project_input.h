#pragma once

#include <string>

#include "engine/io/scene_data.h"
#include "engine/session/project.h"

// A project's folder where a command takes a volume or a scene. It is read as it is now, with its
// unsaved steps, and is not changed.
namespace palpate {

// Prints the project's notes as warnings, and how many unsaved steps are applied.
Result<Project::Seen> look_at_project(const std::string& path, const std::stop_token& stop);

// A volume of a project by its kind: the labels that are seen, or the values. An error where it has
// none. Options of reading have no effect, which is said.
Result<LoadedVolume> load_project_volume(const std::string& path, bool labels,
                                         const ReadOptions& options);

// The scene file that SCENE means: a scene file, a project, or a volume, which it names alone.
Result<SceneFile> scene_file_of(const std::string& input);

// The voxels of a scene that scene_file_of() gave, with `labels` in the place of its own.
Result<LoadedScene> load_scene_input(const std::string& input, const SceneFile& file,
                                     const ReadOptions& options);

} // namespace palpate
