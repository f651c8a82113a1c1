#include <unistd.h>

#include <algorithm>
#include <utility>

#include "engine/io/brick_file.h"
#include "engine/session/notes.h"
#include "engine/session/project.h"
#include "engine/session/project_description.h"
#include "engine/session/touch_json.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

Result<void> save_volume(const fs::path& file, const NamedVolume& volume,
                         const std::string& modality) {
    BrickStream stream = stream_of(volume.volume);
    stream.labels = volume.kind == VolumeKind::labels;
    stream.modality = modality.substr(0, 31);
    return save_brick_file(file, stream);
}

} // namespace

Result<void> Project::Opened::add(NamedVolume volume) {
    if (unsaved > 0)
        return fail("{}: expected no unsaved steps, found {}", project.folder_.string(), unsaved);
    PALPATE_TRY(check_volume_name(volume.name));
    std::vector<NamedVolume> volumes = setup.document.volumes;
    volumes.push_back(volume);
    PALPATE_TRY(Document document, make_document(std::move(volumes)));
    document.notes = setup.document.notes;
    const File file{fmt::format("{}-{}.pbv", volume.name, project.save_), std::move(volume)};
    PALPATE_TRY(ProjectDescription description, read_project_description(project.folder_));
    description.volumes.push_back({file.of.name, file.name, file.of.kind});
    PALPATE_TRY(save_volume(project.folder_ / file.name, file.of, ""));
    PALPATE_TRY(write_project_description(project.folder_, description));
    project.files_.push_back(file);
    setup.document = std::move(document);
    return {};
}

// Writes the volumes that are not in `there`, then the file that names them.
Result<std::vector<Project::File>> Project::write(const fs::path& folder, uint64_t save,
                                                  const ProjectContents& contents,
                                                  const std::vector<File>& there) {
    std::vector<File> files;
    ProjectDescription description{.save = save,
                                   .volumes = {},
                                   .grey = contents.grey,
                                   .labels = contents.labels,
                                   .modality = contents.modality,
                                   .scene = contents.scene,
                                   .touch = contents.touch,
                                   .kept = contents.kept,
                                   .notes = contents.document.notes};
    SceneFile& scene = description.scene;
    scene.volume = scene.labels = "";
    for (const NamedVolume& volume : contents.document.volumes) {
        const auto kept = std::find_if(there.begin(), there.end(), [&](const File& file) {
            return file.of.name == volume.name && file.of.kind == volume.kind &&
                   file.of.volume.is_same_as(volume.volume);
        });
        const bool is_kept = kept != there.end();
        const std::string name = is_kept ? kept->name : fmt::format("{}-{}.pbv", volume.name, save);
        if (!is_kept) {
            const bool is_grey = volume.name == contents.grey;
            PALPATE_TRY(save_volume(folder / name, volume, is_grey ? contents.modality : ""));
        }
        files.push_back({name, volume});
        description.volumes.push_back({volume.name, name, volume.kind});
        if (volume.name == contents.grey || scene.volume.empty())
            scene.volume = name;
        if (volume.name == contents.labels)
            scene.labels = name;
    }
    PALPATE_TRY(write_project_description(folder, description));
    return files;
}

Result<std::vector<Project::File>> Project::create_files(const fs::path& folder,
                                                         const ProjectContents& contents) {
    std::error_code error;
    if (fs::exists(folder, error))
        return fail("{}: expected no such file or folder yet, found one", folder.string());
    for (const NamedVolume& volume : contents.document.volumes)
        PALPATE_TRY(check_volume_name(volume.name));
    fs::path made = folder.has_filename() ? folder : folder.parent_path();
    made.replace_filename(fmt::format(".{}.tmp.{}", ::getpid(), made.filename().string()));
    const auto given_up = [&](const std::string& why) {
        fs::remove_all(made, error);
        return fail("{}", why);
    };
    if (!fs::create_directory(made, error))
        return fail("{}: cannot be made: {}", folder.string(), error.message());
    if (Result<Journal> journal = Journal::create(made / journal_name(1), {.save = 1}); !journal)
        return given_up(journal.error().message);
    Result<std::vector<File>> files = write(made, 1, contents, {});
    if (!files)
        return given_up(files.error().message);
    fs::rename(made, folder, error);
    if (error)
        return given_up(fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
    return files;
}

Result<void> Project::create(const fs::path& folder, const ProjectContents& contents) {
    PALPATE_TRY(create_files(folder, contents));
    return {};
}

Project::Creation::Creation(Project project, ProjectContents contents, Limit limit)
    : project_(std::move(project)),
      contents_(std::move(contents)),
      limit_(limit),
      writing_(std::async(std::launch::async, [folder = project_.folder_, contents = contents_] {
          return create_files(folder, contents);
      })) {}

Result<Project> Project::Creation::give_up(const std::string& why) const {
    std::error_code ignored;
    fs::remove_all(project_.folder_, ignored);
    return fail("{}", why);
}

std::optional<Result<Project>> Project::Creation::poll(Session& session) {
    const auto is_ready = [](const auto& future) {
        return future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    };
    if (writing_.valid()) {
        if (!is_ready(writing_))
            return {};
        Result<std::vector<File>> files = writing_.get();
        if (!files)
            return Result<Project>(pass_on(files));
        project_.files_ = std::move(*files);
        // All that was done since `contents_` is the first step of the journal.
        Result<Journal::Found> found =
            Journal::open(project_.folder_ / journal_name(1), {.save = 1});
        if (!found)
            return give_up(found.error().message);
        Result<JournalChange> change =
            session.change_journal(std::move(found->journal), contents_.document);
        if (!change)
            return give_up(change.error().message);
        changing_ = std::async(
            std::launch::async, [change = std::move(*change), limit = limit_,
                                 from = contents_.document, folder = project_.folder_]() mutable {
                Result<Document> reached = change.wait(limit);
                if (reached && reached->is_same_as(from)) // else the journal begins elsewhere
                    write_steps(folder, 1, change.take_steps());
                return reached;
            });
    }
    if (!changing_.valid() || !is_ready(changing_))
        return {};
    if (const Result<Document> reached = changing_.get(); !reached)
        return give_up(reached.error().message);
    return Result<Project>(std::move(project_));
}

Result<Project> Project::Creation::wait(Session& session) {
    if (writing_.valid())
        writing_.wait();
    if (std::optional<Result<Project>> done = poll(session))
        return std::move(*done);
    changing_.wait();
    return *poll(session);
}

Project::Creation Project::begin_create_from(const fs::path& folder, Session& session,
                                             const SceneFile& scene, const std::string& modality,
                                             Limit limit) {
    Project project(folder, 1);
    project.journal_ = 1;
    project.scene_ = scene;
    project.modality_ = modality;
    ProjectContents contents = project.contents_of(session);
    project.settings_ = settings_text(contents);
    return {std::move(project), std::move(contents), limit};
}

Result<Project> Project::create_from(const fs::path& folder, Session& session,
                                     const SceneFile& scene, const std::string& modality,
                                     Limit limit) {
    return begin_create_from(folder, session, scene, modality, limit).wait(session);
}

Result<void> Project::begin_save_as(const fs::path& folder, Session& session, Limit limit) {
    if (is_saving())
        return fail("expected no save under way, found one");
    moving_ =
        std::make_unique<Creation>(begin_create_from(folder, session, scene_, modality_, limit));
    return {};
}

Result<void> Project::end_move(Result<Project> made) {
    moving_.reset();
    if (!made)
        return pass_on(made);
    made->every_ = every_;
    *this = std::move(*made);
    return {};
}

Result<void> Project::save_as(const fs::path& folder, Session& session, Limit limit) {
    if (moving_)
        (void)end_move(moving_->wait(session)); // that one comes first
    if (saving_.valid())
        (void)end_save(); // of the old folder, which stays as it is then
    if (Result<void> begun = begin_save_as(folder, session, limit); !begun)
        return begun;
    return end_move(moving_->wait(session));
}

ProjectContents Project::contents_of(Session& session) const {
    ProjectContents contents{session.state().document,
                             session.sources().grey,
                             session.sources().labels,
                             scene_,
                             session.parameters(),
                             modality_,
                             session.kept()};
    SceneFile& scene = contents.scene;
    scene.scene = session.scene();
    (void)show_pages(contents.document.notes, scene.scene); // of pages that are none, nothing
    scene.scene.surfaces.resize(std::min(scene.scene.surfaces.size(), scene.surfaces.size()));
    scene.surfaces.resize(scene.scene.surfaces.size());
    scene.framing.reset();
    scene.centered_slices.clear();
    scene.centered_clips.clear();
    for (std::string* name : {&contents.grey, &contents.labels})
        if (!contents.document.find(*name))
            name->clear();
    return contents;
}

std::string Project::settings_text(const ProjectContents& contents) {
    SceneFile scene = contents.scene;
    scene.volume = contents.grey;
    scene.labels = contents.labels;
    scene.framing.reset();
    scene.centered_slices.clear();
    scene.centered_clips.clear();
    std::string notes;
    for (const auto& [page, text] : contents.document.notes.texts())
        notes += "\n" + page + text;
    return write_scene(scene) + json_line(touch_parameters_json(contents.touch)) +
           json_line(kept_json(contents.kept)) + notes;
}

bool Project::is_saved(Session& session) const {
    const ProjectContents contents = contents_of(session);
    return std::equal(files_.begin(), files_.end(), contents.document.volumes.begin(),
                      contents.document.volumes.end(),
                      [](const File& file, const NamedVolume& volume) {
                          return file.of.name == volume.name && file.of.kind == volume.kind &&
                                 file.of.volume.is_same_as(volume.volume);
                      }) &&
           settings_text(contents) == settings_;
}

Result<void> Project::begin_save(Session& session, Limit limit) {
    if (is_saving())
        return fail("expected no save under way, found one");
    const uint64_t next = journal_ + 1;
    const fs::path path = folder_ / journal_name(next);
    PALPATE_TRY(Journal journal, Journal::create(path, {.save = next}));
    Result<JournalChange> change = session.change_journal(std::move(journal));
    if (!change) {
        std::error_code ignored;
        fs::remove(path, ignored);
        return pass_on(change);
    }
    saving_ = std::async(std::launch::async,
                         [folder = folder_, path, next, limit, change = std::move(*change),
                          contents = contents_of(session), there = files_]() mutable {
                             Saved saved{.result = {}, .save = next, .files = {}, .settings = {}};
                             Result<Document> document = change.wait(limit);
                             if (!document) {
                                 std::error_code ignored;
                                 fs::remove(path, ignored);
                                 saved.result = pass_on(document);
                                 return saved;
                             }
                             saved.has_journal = true;
                             contents.document = std::move(*document);
                             (void)show_pages(contents.document.notes, contents.scene.scene);
                             for (std::string* name : {&contents.grey, &contents.labels})
                                 if (!contents.document.find(*name))
                                     name->clear();
                             saved.settings = settings_text(contents);
                             write_steps(folder, next, change.take_steps());
                             Result<std::vector<File>> files = write(folder, next, contents, there);
                             if (!files) {
                                 saved.result = pass_on(files);
                                 return saved;
                             }
                             remove_idle(folder, next, there, *files);
                             saved.files = std::move(*files);
                             return saved;
                         });
    return {};
}

// A step is a change of a journal that nobody goes on with. Where it cannot be written, undo goes
// back to the save.
void Project::write_steps(const fs::path& folder, uint64_t save,
                          std::vector<History::PackedStep> steps) {
    if (steps.empty())
        return;
    std::vector<JournalEntry> entries;
    for (History::PackedStep& step : steps)
        entries.push_back(
            {.kind = JournalEntry::Kind::change,
             .change = {std::move(step.title), Json::object(), std::move(step.packed), true}});
    const fs::path path = folder / steps_name(save);
    Result<Journal> made = Journal::create(path, {.save = save});
    if (made && !made->append(entries))
        made->remove();
}

// How many there are: all that were written, or none.
size_t Project::read_steps(const fs::path& folder, uint64_t save, History& history) {
    std::error_code ignored;
    const fs::path path = folder / steps_name(save);
    if (!fs::exists(path, ignored))
        return 0;
    Result<Journal::Contents> found = Journal::peek(path);
    if (!found || found->cut || found->damage)
        return 0;
    for (auto entry = found->entries.rbegin(); entry != found->entries.rend(); ++entry)
        history.add_before({std::move(entry->change.title), std::move(entry->change.packed)});
    return found->entries.size();
}

Result<void> Project::end_save() {
    Saved saved = saving_.get();
    if (saved.has_journal)
        journal_ = saved.save;
    if (saved.result) {
        save_ = saved.save;
        files_ = std::move(saved.files);
        settings_ = std::move(saved.settings);
    }
    return saved.result;
}

Result<void> Project::save(Session& session, Limit limit) {
    if (moving_)
        (void)end_move(moving_->wait(session)); // and this one is of where that led
    if (saving_.valid())
        (void)end_save(); // this one comes after it
    PALPATE_TRY(begin_save(session, limit));
    return end_save();
}

std::optional<Result<void>> Project::poll(Session& session, int64_t now_ns) {
    using std::chrono::nanoseconds;
    if (moving_) {
        std::optional<Result<Project>> made = moving_->poll(session);
        if (!made)
            return {};
        waits_since_ns_ = now_ns;
        return end_move(std::move(*made));
    }
    if (saving_.valid()) {
        if (saving_.wait_for(nanoseconds(0)) != std::future_status::ready)
            return {};
        waits_since_ns_ = now_ns;
        return end_save();
    }
    if (!every_ || !waits_since_ns_)
        waits_since_ns_ = now_ns;
    if (!every_ || now_ns - *waits_since_ns_ < nanoseconds(*every_).count())
        return {};
    waits_since_ns_ = now_ns;
    if (is_saved(session))
        return {};
    PALPATE_TRY(begin_save(session));
    return {};
}

// Removes what earlier saves wrote, and what a save that was cut left: journals before this save,
// and files NAME-3.pbv of volumes of the project.
void Project::remove_idle(const fs::path& folder, uint64_t save, const std::vector<File>& before,
                          const std::vector<File>& now) {
    const auto number_in = [](std::string_view name, const std::string& start,
                              std::string_view end) -> std::optional<uint64_t> {
        if (!name.starts_with(start) || !name.ends_with(end) ||
            name.size() <= start.size() + end.size() ||
            name.size() > start.size() + end.size() + 18)
            return {};
        const std::string digits(
            name.substr(start.size(), name.size() - start.size() - end.size()));
        if (digits.find_first_not_of("0123456789") != digits.npos)
            return {};
        return std::stoull(digits);
    };
    std::error_code error;
    std::vector<fs::path> idle;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
        const std::string name = it->path().filename().string();
        bool is_idle = number_in(name, "journal-", "").value_or(save) < save ||
                       number_in(name, "steps-", "").value_or(save) < save;
        for (const auto* files : {&before, &now})
            for (const File& file : *files)
                is_idle |= number_in(name, file.of.name + "-", ".pbv").value_or(~0ull) <= save;
        for (const File& file : now)
            is_idle &= file.name != name;
        if (is_idle)
            idle.push_back(it->path());
    }
    for (const fs::path& path : idle)
        fs::remove(path, error);
}

} // namespace palpate
