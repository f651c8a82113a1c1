#include "engine/session/project.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "engine/edit/replay.h"
#include "engine/io/brick_file.h"
#include "engine/session/notes.h"
#include "engine/session/project_description.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

// Applies the entries of a journal.
Result<void> replay_all(Document& document, History& history, const Journal::Contents& contents,
                        const fs::path& path, const std::stop_token& stop) {
    for (const JournalEntry& entry : contents.entries)
        if (Result<Replayed> done = replay(document, history, entry, stop); !done)
            return fail("{}: {}", path.string(), done.error().message);
    return {};
}

std::string note_of(const Journal::Contents& contents, const fs::path& path) {
    if (const auto& damage = contents.damage)
        return fmt::format(
            "{}: damaged at byte {}: {}; the {} steps before are done, the {} behind it are left "
            "out{}",
            path.string(), damage->at_byte, damage->what, contents.entries.size(), damage->later,
            damage->kept_as.empty() ? "" : " and kept in " + damage->kept_as.string());
    return contents.cut ? fmt::format("{}: a step that had not ended is dropped", path.string())
                        : std::string();
}

// Adds a way out to the error of a journal that cannot be read.
tl::unexpected<Error> with_way_out(const Error& error, const fs::path& folder) {
    return fail(
        "{}; `palpate project {} --discard` goes back to the last save and keeps the journal",
        error.message, folder.string());
}

// Calls visit(number, path) for the journal of a save and those that later saves began which did
// not end: each goes on from the one before. It returns what the journal holds.
template <class Visit>
Result<void> for_each_journal(const fs::path& folder, uint64_t save, const Visit& visit) {
    for (uint64_t number = save;; ++number) {
        const fs::path path = folder / journal_name(number);
        PALPATE_TRY(const Journal::Contents found, visit(number, path));
        const fs::path next = folder / journal_name(number + 1);
        std::error_code error;
        if (!fs::exists(next, error))
            return {};
        if (found.damage || found.cut)
            return fail(
                "{}: goes on from steps that are lost in {}; remove it to open what there "
                "is before",
                next.string(), path.string());
    }
}

// A name beside the file that is free.
fs::path set_aside_name(const fs::path& path) {
    std::error_code error;
    for (int n = 1;; ++n) {
        fs::path name = path;
        name += n == 1 ? ".set-aside" : fmt::format(".set-aside-{}", n);
        if (!fs::exists(name, error))
            return name;
    }
}

// Told in words of a person, who knows nothing of journals.
Result<void> expect_closed(const fs::path& folder, uint64_t save) {
    std::error_code ignored;
    for (uint64_t number = save; fs::exists(folder / journal_name(number), ignored); ++number)
        if (Journal::is_running(folder / journal_name(number)))
            return fail(
                "{}: the project is open already, in a window or in another program; close it "
                "there first",
                folder.string());
    return {};
}

// Puts the journals of a project aside, the newest first, and an empty one in the place of the
// first: killed at any moment, it leaves a project with some of the steps, in their order.
Result<void> set_journals_aside(const fs::path& folder, uint64_t save) {
    std::vector<fs::path> paths;
    std::error_code error;
    for (uint64_t number = save; fs::exists(folder / journal_name(number), error); ++number)
        paths.push_back(folder / journal_name(number));
    if (paths.empty())
        return fail("{}: no such file", (folder / journal_name(save)).string());
    for (const fs::path& path : paths)
        PALPATE_TRY(Journal::expect_ended(path));
    const Result<Journal::Contents> first = Journal::peek(paths.front());
    while (paths.size() > 1) {
        fs::rename(paths.back(), set_aside_name(paths.back()), error);
        if (error)
            return fail("{}: cannot be renamed: {}", paths.back().string(), error.message());
        paths.pop_back();
    }
    if (first && first->entries.empty() && !first->damage && !first->cut)
        return {};
    fs::copy_file(paths.front(), set_aside_name(paths.front()), error);
    fs::path fresh = paths.front();
    fresh += ".new";
    std::error_code ignored;
    fs::remove(fresh, ignored); // of one who was killed here
    Result<Journal> made = error ? Result<Journal>(fail("{}", error.message()))
                                 : Journal::create(fresh, {.save = save});
    if (made)
        fs::rename(fresh, paths.front(), error);
    if (!made || error)
        return fail("{}: cannot be put aside: {}", paths.front().string(),
                    made ? error.message() : made.error().message);
    return {};
}

// Tells one state of a project's files from another: its last save, and which journals there are,
// with the lengths of those that have ended.
std::string files_text(const fs::path& folder) {
    const Result<ProjectDescription> read = read_project_description(folder);
    if (!read)
        return read.error().message;
    std::string text = std::to_string(read->save);
    std::error_code error;
    for (uint64_t number = read->save; fs::exists(folder / journal_name(number + 1), error);
         ++number)
        text += fmt::format(" {}", fs::file_size(folder / journal_name(number), error));
    return text;
}

template <class Files>
Result<Document> document_of(const fs::path& folder, const Files& files) {
    std::vector<NamedVolume> volumes;
    for (const auto& file : files)
        volumes.push_back(file.of);
    Result<Document> made = make_document(std::move(volumes));
    if (!made)
        return fail("{}: {}", folder.string(), made.error().message);
    return made;
}

} // namespace

Project::Project(fs::path folder, uint64_t save) : folder_(std::move(folder)), save_(save) {}
Project::~Project() = default;
Project::Project(Project&&) noexcept = default;
Project& Project::operator=(Project&&) noexcept = default;

bool Project::is_one(const fs::path& path) {
    std::error_code error;
    return path.filename() == kProjectFile || fs::is_regular_file(path / kProjectFile, error);
}

Result<std::vector<Project::File>> Project::open_volumes(const fs::path& folder,
                                                         const ProjectDescription& description) {
    std::vector<File> files;
    for (const ProjectDescription::Entry& entry : description.volumes) {
        PALPATE_TRY(BrickFile file, open_brick_file(folder / entry.file));
        files.push_back({entry.file, {entry.name, entry.kind, std::move(file.volume)}});
    }
    return files;
}

struct Project::Snapshot {
    struct Steps {
        fs::path path;
        Journal::Contents contents;
    };
    ProjectDescription description;
    std::vector<File> files;
    std::vector<Steps> journals;
};

Result<Project::Snapshot> Project::read_files(const fs::path& folder, bool unsaved) {
    Snapshot snapshot;
    PALPATE_TRY(snapshot.description, read_project_description(folder));
    PALPATE_TRY(snapshot.files, open_volumes(folder, snapshot.description));
    const auto visit = [&](uint64_t, const fs::path& name) -> Result<Journal::Contents> {
        Result<Journal::Contents> found = Journal::peek(name);
        if (!found)
            return with_way_out(found.error(), folder);
        snapshot.journals.push_back({name, *found});
        return found;
    };
    if (unsaved)
        PALPATE_TRY(for_each_journal(folder, snapshot.description.save, visit));
    return snapshot;
}

size_t Project::Seen::in_effect() const {
    return static_cast<size_t>(
        std::count_if(unsaved.begin(), unsaved.end(), [](const Step& s) { return s.in_effect; }));
}

Result<Project::Seen> Project::look(const fs::path& path, const std::stop_token& stop) {
    return look(path, Opening{.unsaved = true, .stop = stop});
}

Result<Project::Seen> Project::look(const fs::path& path, const Opening& opening) {
    const fs::path folder = project_folder(path);
    // A save that goes on meanwhile replaces the files one after the other. A step that is being
    // written looks like one that was cut.
    constexpr int kLooks = 100, kLooksAtCut = 5;
    constexpr std::chrono::milliseconds kNap(10);
    Result<Snapshot> read = fail("");
    for (int looks = 1; looks <= kLooks; ++looks) {
        const std::string before = files_text(folder);
        read = read_files(folder, opening.unsaved);
        const bool is_cut = read && !read->journals.empty() && read->journals.back().contents.cut;
        if (files_text(folder) == before && !(is_cut && looks < kLooksAtCut))
            break;
        std::this_thread::sleep_for(kNap);
    }
    if (!read)
        return pass_on(read);
    PALPATE_TRY(Document document, document_of(folder, read->files));
    const ProjectDescription& description = read->description;
    document.notes = description.notes;
    Seen seen{.contents = {.document = std::move(document),
                           .grey = description.grey,
                           .labels = description.labels,
                           .scene = description.scene,
                           .touch = description.touch,
                           .modality = description.modality,
                           .kept = description.kept},
              .saves = description.save,
              .unsaved = {},
              .notes = {}};
    History history;
    std::vector<size_t> done, undone; // steps, the newest last
    const auto move_last = [&](std::vector<size_t>& from, std::vector<size_t>& to, bool in_effect) {
        if (from.empty())
            return; // a step before the save
        seen.unsaved[from.back()].in_effect = in_effect;
        to.push_back(from.back());
        from.pop_back();
    };
    for (const Snapshot::Steps& steps : read->journals) {
        for (const JournalEntry& entry : steps.contents.entries) {
            Result<Replayed> replayed =
                replay(seen.contents.document, history, entry, opening.stop);
            if (!replayed)
                return fail("{}: {}", steps.path.string(), replayed.error().message);
            if (entry.kind == JournalEntry::Kind::undo) {
                move_last(done, undone, false);
            } else if (entry.kind == JournalEntry::Kind::redo) {
                move_last(undone, done, true);
            } else if (entry.is_step()) {
                undone.clear();
                done.push_back(seen.unsaved.size());
                seen.unsaved.push_back({entry, true, std::move(replayed->why_idle)});
            }
        }
        if (std::string note = note_of(steps.contents, steps.path); !note.empty())
            seen.notes.push_back(std::move(note));
    }
    SceneFile& scene = seen.contents.scene;
    if (seen.contents.document.notes.texts().contains("clip_planes"))
        scene.centered_clips.clear();
    PALPATE_TRY(show_pages(seen.contents.document.notes, scene.scene));
    return seen;
}

Result<Project::Opened> Project::open(const fs::path& folder) {
    return open(folder, {});
}

Result<Project::Opened> Project::open(const fs::path& path, const Opening& opening) {
    const fs::path folder = project_folder(path);
    PALPATE_TRY(const ProjectDescription read, read_project_description(folder));
    PALPATE_TRY(expect_closed(folder, read.save));
    Project project(folder, read.save);
    PALPATE_TRY(project.files_, open_volumes(folder, read));
    if (!opening.unsaved)
        PALPATE_TRY(set_journals_aside(folder, read.save));
    PALPATE_TRY(Document document, document_of(folder, project.files_));
    const Volume* seen = document.find(read.grey.empty() ? read.labels : read.grey);
    Scene scene = resolved_scene(read.scene, (seen ? *seen : document.first()).grid());
    PALPATE_TRY(document.notes, with_notes_of_scene(read.notes, scene));
    const NotePages notes_saved = document.notes;
    auto history = std::make_unique<History>();
    const size_t before_journal = read_steps(folder, read.save, *history);
    std::vector<std::string> notes;
    std::optional<Journal> journal;
    size_t unsaved = 0;
    const auto visit = [&](uint64_t number, const fs::path& name) -> Result<Journal::Contents> {
        Result<Journal::Found> found = Journal::open(name, {.save = number});
        if (!found)
            return with_way_out(found.error(), folder);
        PALPATE_TRY(replay_all(document, *history, *found, name, opening.stop));
        if (std::string note = note_of(*found, name); !note.empty())
            notes.push_back(std::move(note));
        using Kind = JournalEntry::Kind;
        for (const JournalEntry& entry : found->entries)
            unsaved += entry.is_step() || entry.kind != Kind::change;
        project.journal_ = number;
        journal.emplace(std::move(found->journal));
        return std::move(*found);
    };
    PALPATE_TRY(for_each_journal(folder, read.save, visit));
    project.modality_ = read.modality;
    project.scene_ = read.scene;
    ProjectContents as_saved{document,   read.grey,     read.labels, read.scene,
                             read.touch, read.modality, read.kept};
    as_saved.document.notes = notes_saved;
    as_saved.scene.scene = scene;
    project.settings_ = settings_text(as_saved);
    PALPATE_TRY(show_pages(document.notes, scene));
    SessionSetup setup{.document = std::move(document),
                       .grey = read.grey,
                       .labels = read.labels,
                       .scene = std::move(scene),
                       .touch = {},
                       .parameters = read.touch,
                       .kept = read.kept,
                       .mesh_iso = {},
                       .edit = {}};
    setup.edit.begun = std::move(history);
    setup.edit.before_journal = before_journal;
    setup.edit.journal.emplace(std::move(*journal));
    return Opened{std::move(project), std::move(setup), std::move(notes), unsaved};
}

} // namespace palpate
