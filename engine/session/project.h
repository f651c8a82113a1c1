#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "engine/scene/scene_file.h"
#include "engine/session/session.h"

namespace palpate {

// What a project holds beside its strokes.
struct ProjectContents {
    Document document;
    std::string grey, labels; // names of the volumes that are seen and felt; empty: none
    SceneFile scene;          // its `volume` and `labels` are the project's files, and not read
    haptics::TouchParameters touch;
};

// A document, how it is seen and how it feels, in a folder (docs/reference/project.md):
//
//     project.json      names, kinds and files of the volumes, scene, haptic parameters; the save
//     NAME-3.pbv        a volume, as it was at the third save
//     journal-5         what was done since the fifth
//
// While a project is open each step of its session is on disk before it counts (journal.h), so that
// a process that ends without a word loses no stroke that had ended. A save writes the volumes that
// have changed and begins a new journal. It replaces project.json as its last step, so that one who
// is killed at any moment leaves the project before the save or after it, with all its strokes.
//
// One process has a project open: the lock is that of its journal.
class Project {
 public:
    // A new one, in a folder that is not there. It appears whole or not at all.
    static Result<void> create(const std::filesystem::path& folder,
                               const ProjectContents& contents);

    // Opens one and does what its journals hold. An error names the file, what was expected and
    // what was found.
    struct Opened;
    static Result<Opened> open(const std::filesystem::path& folder, std::stop_token stop = {});

    // Saves what the session is between two strokes, and how it is seen and felt: waits for the end
    // of a stroke under way (without threads: is refused). For one thread, the session's interface;
    // a session with threads goes on meanwhile. Where it fails (a full disk), the project is as
    // before, and goes on.
    Result<void> save(Session& session);

    const std::filesystem::path& folder() const { return folder_; }
    uint64_t saves() const { return save_; }

 private:
    struct File { // that holds a volume
        std::string name;
        NamedVolume of;
    };
    Project(std::filesystem::path folder, uint64_t save)
        : folder_(std::move(folder)), save_(save) {}
    static Result<std::vector<File>> write(const std::filesystem::path& folder, uint64_t save,
                                           const ProjectContents& contents,
                                           const std::vector<File>& there);
    void remove_what_is_idle(const std::vector<File>& before) const;

    std::filesystem::path folder_;
    uint64_t save_;        // of project.json
    uint64_t journal_ = 0; // the newest; above save_ where a save was cut or failed
    std::string grey_, labels_;
    SceneFile scene_; // of the sources of its surfaces
    std::vector<File> files_;
};

struct Project::Opened {
    Project project;
    SessionSetup setup;             // what a session on it begins with, its journal and history
    std::vector<std::string> notes; // what was found that a person should know
};

} // namespace palpate
