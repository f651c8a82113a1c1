#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/scene/scene_file.h"
#include "engine/session/session.h"

namespace palpate {

// The contents of project.json (docs/reference/project.md).
struct ProjectDescription {
    struct Entry {
        std::string name, file;
        VolumeKind kind = VolumeKind::grey;
    };
    uint64_t save = 0;
    std::vector<Entry> volumes;
    std::string grey, labels, modality;
    SceneFile scene;
    haptics::TouchParameters touch;
    Kept kept;
    NotePages notes; // but for those that the scene has
};

inline constexpr const char* kProjectFile = "project.json";
std::string journal_name(uint64_t save); // of the journal that belongs to a save
std::string steps_name(uint64_t save);   // of the steps that led to it
// The folder of a project that is named by it or by its project.json.
std::filesystem::path project_folder(const std::filesystem::path& path);

Result<ProjectDescription> read_project_description(const std::filesystem::path& folder);

// Replaces the file as a whole.
Result<void> write_project_description(const std::filesystem::path& folder,
                                       const ProjectDescription& description);

} // namespace palpate
