#include "engine/session/project.h"

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "engine/base/file.h"
#include "engine/edit/replay.h"
#include "engine/io/brick_file.h"
#include "engine/session/touch_json.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {

constexpr const char* kFile = "project.json";
constexpr double kVersion = 1;

std::string journal_name(uint64_t save) {
    return fmt::format("journal-{}", save);
}

// project.json, read.
struct Description {
    uint64_t save = 0;
    struct Entry {
        std::string name, file;
        VolumeKind kind = VolumeKind::grey;
    };
    std::vector<Entry> volumes;
    std::string grey, labels;
    SceneFile scene;
    haptics::TouchParameters touch;
};

Result<Description> read_description(const fs::path& path) {
    Result<std::string> text = load_text(path);
    if (!text)
        return pass_on(text);
    const std::string name = path.string();
    Result<Json> json = parse_json(*text, name);
    if (!json)
        return pass_on(json);
    JsonErrors errors{name, {}};
    const JsonValue in(*json, "", errors);
    Description out;
    if (!in.is(Json::Kind::object))
        in.reject("a project");
    else if (const auto version = in.find("project"); !version)
        in.complain("expected a project with \"project\": 1, the version of the format");
    else if (version->number(0, 1e6) != kVersion)
        version->reject("version 1 of the format");
    in.only_keys({"project", "save", "volumes", "grey", "labels", "scene", "touch"});
    const auto save = in.find("save"), volumes = in.find("volumes");
    if (!save || !volumes)
        in.complain("expected \"save\" and \"volumes\"");
    else
        out.save = static_cast<uint64_t>(save->whole_number(1, 1u << 31));
    const auto name_of_volume = [&](const JsonValue& value) {
        std::string text_of = value.text();
        if (const Result<void> good = check_volume_name(text_of); !good)
            value.complain(good.error().message);
        return text_of;
    };
    for (const JsonValue& volume : volumes ? volumes->items(1, 4096) : std::vector<JsonValue>()) {
        volume.only_keys({"name", "kind", "file"});
        const auto named = volume.find("name"), kind = volume.find("kind"),
                   file = volume.find("file");
        if (!named || !kind || !file) {
            volume.complain("expected a volume with \"name\", \"kind\" and \"file\"");
            break;
        }
        Description::Entry entry{name_of_volume(*named), file->text(), read_volume_kind(*kind)};
        if (fs::path(entry.file).filename() != entry.file || entry.file.empty())
            file->reject("the name of a file in the project's folder");
        if (std::any_of(out.volumes.begin(), out.volumes.end(),
                        [&](const auto& other) { return other.name == entry.name; }))
            named->reject("names that differ");
        out.volumes.push_back(std::move(entry));
    }
    for (const auto& [key, member] : {std::pair("grey", &out.grey), {"labels", &out.labels}})
        if (const auto value = in.find(key)) {
            *member = name_of_volume(*value);
            if (std::none_of(out.volumes.begin(), out.volumes.end(),
                             [&](const auto& volume) { return volume.name == *member; }))
                value->reject("the name of one of the volumes");
        }
    if (const auto touch = in.find("touch"))
        out.touch = read_touch_parameters(*touch);
    if (errors.first)
        return tl::unexpected(*errors.first);
    if (const Json* scene = json->find("scene")) {
        Result<SceneFile> read =
            parse_scene(json_text(*scene), name + ": scene", path.parent_path());
        if (!read)
            return pass_on(read);
        out.scene = std::move(*read);
    }
    return out;
}

Json description_json(const ProjectContents& contents, uint64_t save, const Json& volumes,
                      const SceneFile& scene) {
    const Result<Json> scene_json = parse_json(write_scene(scene), "scene");
    Json out = Json::object({{"project", Json::of(kVersion)},
                             {"save", Json::of(static_cast<double>(save))},
                             {"volumes", volumes}});
    if (!contents.grey.empty())
        out.members.emplace_back("grey", Json::of(contents.grey));
    if (!contents.labels.empty())
        out.members.emplace_back("labels", Json::of(contents.labels));
    if (scene_json)
        out.members.emplace_back("scene", *scene_json);
    out.members.emplace_back("touch", touch_parameters_json(contents.touch));
    return out;
}

// Done on the document: the entries of a journal.
Result<void> replay_all(Document& document, History& history, const Journal::Contents& contents,
                        const fs::path& path, const std::stop_token& stop) {
    for (const JournalEntry& entry : contents.entries)
        if (Result<Replayed> done = replay(document, history, entry, stop); !done)
            return fail("{}: {}", path.string(), done.error().message);
    return {};
}

std::string what_was_found(const Journal::Contents& contents, const fs::path& path) {
    if (const auto& damage = contents.damage)
        return fmt::format(
            "{}: damaged at byte {}: {}; the {} steps before are done, the {} behind it are left "
            "out and kept in {}",
            path.string(), damage->at_byte, damage->what, contents.entries.size(), damage->later,
            damage->kept_as.string());
    return contents.cut ? fmt::format("{}: a step that had not ended is dropped", path.string())
                        : std::string();
}

} // namespace

// Writes the volumes that are not in `there`, then what names them.
Result<std::vector<Project::File>> Project::write(const fs::path& folder, uint64_t save,
                                                  const ProjectContents& contents,
                                                  const std::vector<File>& there) {
    std::vector<File> files;
    Json list = Json::array();
    SceneFile scene = contents.scene;
    scene.volume = scene.labels = "";
    for (const NamedVolume& volume : contents.document.volumes) {
        const auto kept = std::find_if(there.begin(), there.end(), [&](const File& file) {
            return file.of.name == volume.name && file.of.kind == volume.kind &&
                   file.of.volume.is_same_as(volume.volume);
        });
        files.push_back(
            {kept != there.end() ? kept->name : fmt::format("{}-{}.pbv", volume.name, save),
             volume});
        if (kept == there.end()) {
            BrickStream stream = stream_of(volume.volume);
            stream.labels = volume.kind == VolumeKind::labels;
            if (Result<void> saved = save_brick_file(folder / files.back().name, stream); !saved)
                return pass_on(saved);
        }
        list.items.push_back(Json::object({{"name", Json::of(volume.name)},
                                           {"kind", Json::of(name_of(volume.kind))},
                                           {"file", Json::of(files.back().name)}}));
        if (volume.name == contents.grey || scene.volume.empty())
            scene.volume = files.back().name;
        if (volume.name == contents.labels)
            scene.labels = files.back().name;
    }
    const std::string text = json_text(description_json(contents, save, list, scene));
    if (Result<void> saved = save_bytes(folder / kFile, std::as_bytes(std::span(text))); !saved)
        return pass_on(saved);
    return files;
}

Result<void> Project::create(const fs::path& folder, const ProjectContents& contents) {
    std::error_code error;
    if (fs::exists(folder, error))
        return fail("{}: expected no such file or folder yet, found one", folder.string());
    for (const NamedVolume& volume : contents.document.volumes)
        if (Result<void> named = check_volume_name(volume.name); !named)
            return named;
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
    if (const Result<std::vector<File>> files = write(made, 1, contents, {}); !files)
        return given_up(files.error().message);
    fs::rename(made, folder, error);
    if (error)
        return given_up(fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
    return {};
}

Result<Project::Opened> Project::open(const fs::path& folder, std::stop_token stop) {
    Result<Description> read = read_description(folder / kFile);
    if (!read)
        return pass_on(read);
    Project project(folder, read->save);
    std::vector<NamedVolume> volumes;
    for (const Description::Entry& entry : read->volumes) {
        Result<BrickFile> file = open_brick_file(folder / entry.file);
        if (!file)
            return pass_on(file);
        volumes.push_back({entry.name, entry.kind, std::move(file->volume)});
        project.files_.push_back({entry.file, volumes.back()});
    }
    Document document(std::move(volumes));
    auto history = std::make_unique<History>();
    std::vector<std::string> notes;
    // A save that was cut leaves a later journal, which goes on from where the one before ended.
    std::optional<Journal> journal;
    for (project.journal_ = read->save;; ++project.journal_) {
        const fs::path path = folder / journal_name(project.journal_);
        Result<Journal::Found> found = Journal::open(path, {.save = project.journal_});
        if (!found)
            return pass_on(found);
        if (Result<void> done = replay_all(document, *history, *found, path, stop); !done)
            return pass_on(done);
        if (std::string note = what_was_found(*found, path); !note.empty())
            notes.push_back(std::move(note));
        journal.emplace(std::move(found->journal));
        const fs::path next = folder / journal_name(project.journal_ + 1);
        std::error_code error;
        if (!fs::exists(next, error))
            break;
        if (found->damage || found->cut)
            return fail(
                "{}: goes on from steps that are lost in {}; remove it to open what there "
                "is before",
                next.string(), path.string());
    }
    project.grey_ = read->grey;
    project.labels_ = read->labels;
    project.scene_ = read->scene;
    const Volume* seen = document.find(read->grey.empty() ? read->labels : read->grey);
    const Grid grid = (seen ? *seen : document.first()).grid();
    SessionSetup setup{.document = std::move(document),
                       .grey = read->grey,
                       .labels = read->labels,
                       .scene = resolved_scene(read->scene, grid),
                       .touch = {},
                       .parameters = read->touch,
                       .mesh_iso = {},
                       .edit = {}};
    setup.edit.begun = std::move(history);
    setup.edit.journal.emplace(std::move(*journal));
    return Opened{std::move(project), std::move(setup), std::move(notes)};
}

Result<void> Project::save(Session& session) {
    const uint64_t next = journal_ + 1;
    const fs::path path = folder_ / journal_name(next);
    Result<Journal> journal = Journal::create(path, {.save = next});
    if (!journal)
        return pass_on(journal);
    Result<Document> document = session.change_journal(std::move(*journal));
    if (!document) {
        std::error_code ignored;
        fs::remove(path, ignored);
        return pass_on(document);
    }
    journal_ = next;
    ProjectContents contents{std::move(*document), grey_, labels_, scene_, session.parameters()};
    contents.scene.scene = session.scene();
    contents.scene.framing.reset();
    contents.scene.centered_slices.clear();
    contents.scene.centered_clips.clear();
    for (std::string* name : {&contents.grey, &contents.labels})
        if (!contents.document.find(*name))
            name->clear();
    Result<std::vector<File>> files = write(folder_, next, contents, files_);
    if (!files)
        return pass_on(files);
    const std::vector<File> before = std::exchange(files_, std::move(*files));
    save_ = next;
    remove_what_is_idle(before);
    return {};
}

// What earlier saves wrote, and what a save that was cut left: journals before this save, and files
// NAME-3.pbv of volumes of the project.
void Project::remove_what_is_idle(const std::vector<File>& before) const {
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
    for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
        const std::string name = it->path().filename().string();
        bool is_idle = number_in(name, "journal-", "").value_or(save_) < save_;
        for (const auto* files : {&before, &files_})
            for (const File& file : *files)
                is_idle |= number_in(name, file.of.name + "-", ".pbv").value_or(~0ull) <= save_;
        for (const File& file : files_)
            is_idle &= file.name != name;
        if (is_idle)
            idle.push_back(it->path());
    }
    for (const fs::path& path : idle)
        fs::remove(path, error);
}

} // namespace palpate
