#pragma once

#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/edit/history.h"
#include "engine/edit/journal.h"
#include "engine/scene/scene_file.h"
#include "engine/session/session.h"

namespace palpate {

struct ProjectDescription;

// The contents of a project beside its strokes.
struct ProjectContents {
    Document document;        // with its notes (notes.h)
    std::string grey, labels; // names of the volumes that are seen and felt; empty: none
    SceneFile scene;          // its `volume` and `labels` are the project's files, and not read
    haptics::TouchParameters touch;
    std::string modality = ""; // of the grey volume, "CT" say; empty where unknown
    Kept kept{};
};

// A document, how it is seen and how it feels, in a folder (docs/reference/project.md):
//
//     project.json      names, kinds and files of the volumes, scene, haptic parameters; the save
//     NAME-3.pbv        a volume, as it was at the third save
//     journal-5         the steps since the fifth save
//     steps-5           the steps that led to it, for undo
//
// While a project is open each step of its session is on disk before it counts (journal.h), so that
// a process that ends without a word loses no stroke that had ended. A save writes the volumes that
// have changed and begins a new journal. It replaces project.json as its last step, so that one who
// is killed at any moment leaves the project before the save or after it, with all its strokes.
//
// One process has a project open: the lock is that of its journal. All members are for one thread,
// the session's interface.
class Project {
 public:
    using Limit = std::chrono::milliseconds;
    // How long a save waits for the end of a stroke under way before it fails.
    static constexpr Limit kStrokeLimit{10'000};

    // Whether a path names a project: its folder, or its project.json.
    static bool is_one(const std::filesystem::path& path);

    ~Project(); // waits for a save under way
    Project(Project&& other) noexcept;
    Project& operator=(Project&& other) noexcept;

    // A new one, in a folder that is not there. It appears whole or not at all.
    static Result<void> create(const std::filesystem::path& folder,
                               const ProjectContents& contents);

    // The same of the present state of a session, whose later steps are kept there from then on.
    // `scene` has the sources of its surfaces. Where it fails, the session keeps the journal that
    // it has, and there is no folder.
    static Result<Project> create_from(const std::filesystem::path& folder, Session& session,
                                       const SceneFile& scene = {},
                                       const std::string& modality = "",
                                       Limit limit = kStrokeLimit);
    // The same with a thread of its own that writes the volumes.
    class Creation;
    static Creation begin_create_from(const std::filesystem::path& folder, Session& session,
                                      const SceneFile& scene = {}, const std::string& modality = "",
                                      Limit limit = kStrokeLimit);

    // A step since the last save: a stroke, or another change.
    struct Step {
        JournalEntry entry;
        bool in_effect = true; // false: it was undone, and not done again
        std::string why_idle;  // of a stroke that changed no sample: the reason; else empty
    };

    // A project as it is now, its unsaved steps applied. Changes nothing and needs no lock: for
    // those who only read it, and to offer its unsaved steps before it is opened. Another process
    // may work on it and save it meanwhile: what is seen is how it was at one moment.
    struct Seen {
        ProjectContents contents;
        uint64_t saves = 0;
        std::vector<Step> unsaved;      // the oldest first; undo and redo are not among them
        std::vector<std::string> notes; // sentences about damage found

        size_t in_effect() const; // how many of the unsaved steps are
    };
    static Result<Seen> look(const std::filesystem::path& folder, const std::stop_token& stop = {});
    struct Opening;
    static Result<Seen> look(const std::filesystem::path& folder, const Opening& opening);

    // Opens one and applies what its journals hold. An error names the file, what was expected and
    // what was found.
    struct Opening {
        // False: opens it as it was saved last. The steps since then are kept beside it, in
        // journal-N.set-aside.
        bool unsaved = true;
        std::stop_token stop;
    };
    struct Opened;
    static Result<Opened> open(const std::filesystem::path& folder, const Opening& opening);
    static Result<Opened> open(const std::filesystem::path& folder);

    // Saves the session's state between two strokes, and how it is seen and felt. Waits for the end
    // of a stroke under way (without threads a stroke under way is an error); a session with
    // threads goes on meanwhile. Where it fails (a full disk, the limit), the project is as before,
    // and goes on.
    Result<void> save(Session& session, Limit limit = kStrokeLimit);

    // The same in a thread of its own, whose result poll() gives.
    Result<void> begin_save(Session& session, Limit limit = kStrokeLimit);
    bool is_saving() const { return saving_.valid() || moving_; }

    // Moves the session to a new project in another folder, which this is from then on. The old one
    // keeps its unsaved steps. See create_from().
    Result<void> save_as(const std::filesystem::path& folder, Session& session,
                         Limit limit = kStrokeLimit);
    // The same in a thread of its own, whose result poll() gives. Until then steps are kept in the
    // old one.
    Result<void> begin_save_as(const std::filesystem::path& folder, Session& session,
                               Limit limit = kStrokeLimit);

    // Saves by begin_save() every so often, where is_saved() is false; nothing: never.
    void autosave_every(std::optional<std::chrono::milliseconds> interval) { every_ = interval; }
    // Call it between frames, on a clock that goes on: begins a save that is due. The result of a
    // save of begin_save() or begin_save_as() that has ended since the last call, once.
    std::optional<Result<void>> poll(Session& session, int64_t now_ns);

    // Whether the last save holds all that the session is now. (Strokes are safe without it.)
    bool is_saved(Session& session) const;

    const std::filesystem::path& folder() const { return folder_; }
    const std::string& modality() const { return modality_; } // of the grey volume
    uint64_t saves() const { return save_; }

 private:
    struct File { // that holds a volume
        std::string name;
        NamedVolume of;
    };
    struct Saved { // the outcome of a save
        Result<void> result;
        bool has_journal = false; // the session has gone on to the new journal
        uint64_t save = 0;
        std::vector<File> files;
        std::string settings;
    };
    Project(std::filesystem::path folder, uint64_t save);
    static Result<std::vector<File>> create_files(const std::filesystem::path& folder,
                                                  const ProjectContents& contents);
    static Result<std::vector<File>> write(const std::filesystem::path& folder, uint64_t save,
                                           const ProjectContents& contents,
                                           const std::vector<File>& there);
    static void remove_idle(const std::filesystem::path& folder, uint64_t save,
                            const std::vector<File>& before, const std::vector<File>& now);
    static Result<std::vector<File>> open_volumes(const std::filesystem::path& folder,
                                                  const ProjectDescription& description);
    struct Snapshot; // of its files, for look()
    static Result<Snapshot> read_files(const std::filesystem::path& folder, bool unsaved);
    ProjectContents contents_of(Session& session) const; // its document: of now
    static std::string settings_text(const ProjectContents& contents);
    static void write_steps(const std::filesystem::path& folder, uint64_t save,
                            std::vector<History::PackedStep> steps);
    static size_t read_steps(const std::filesystem::path& folder, uint64_t save, History& history);
    Result<void> end_save(); // waits for it
    Result<void> end_move(Result<Project> made);

    std::filesystem::path folder_;
    uint64_t save_;        // of project.json
    uint64_t journal_ = 0; // the newest; above save_ where a save was cut or failed
    std::string modality_;
    SceneFile scene_; // of the sources of its surfaces
    std::vector<File> files_;
    std::string settings_; // scene and haptic parameters as they are saved
    std::optional<std::chrono::milliseconds> every_;
    std::optional<int64_t> waits_since_ns_; // for the next autosave
    std::future<Saved> saving_;             // last: its thread ends before the rest goes
    std::unique_ptr<Creation> moving_;      // likewise: of begin_save_as()
};

// A project that is being made of a session. Where it goes before that is done, the folder may
// stay, as a whole project without the session's later steps.
class Project::Creation {
 public:
    // Call it between frames, from the session's thread. Once: the project, or why there is none.
    std::optional<Result<Project>> poll(Session& session);
    Result<Project> wait(Session& session); // until it is done

 private:
    friend class Project;
    Creation(Project project, ProjectContents contents, Limit limit);
    Result<Project> give_up(const std::string& why) const;

    Project project_;
    ProjectContents contents_; // when it began
    Limit limit_;
    std::future<Result<std::vector<File>>> writing_; // then
    std::future<Result<Document>> changing_;         // the session's journal
};

struct Project::Opened {
    Project project;
    SessionSetup setup;             // of a session on it, with its journal and history
    std::vector<std::string> notes; // sentences about damage found
    size_t unsaved = 0;             // steps since the last save, done already; undo takes them back

    // A volume that the document lacks is in the project from the last save on: it is no step. Not
    // where steps are unsaved, which may bring or remove one of its name.
    Result<void> add(NamedVolume volume);
};

} // namespace palpate
