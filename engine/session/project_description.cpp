#include "engine/session/project_description.h"

#include <algorithm>
#include <span>
#include <utility>

#include "engine/base/file.h"
#include "engine/session/notes.h"
#include "engine/session/touch_json.h"

namespace palpate {

namespace fs = std::filesystem;

namespace {
constexpr double kVersion = 1;
constexpr const char* kNotesOfScene[] = {"label_styles", "clip_planes"};
} // namespace

std::string journal_name(uint64_t save) {
    return fmt::format("journal-{}", save);
}

std::string steps_name(uint64_t save) {
    return fmt::format("steps-{}", save);
}

fs::path project_folder(const fs::path& path) {
    return path.filename() == kProjectFile ? path.parent_path() : path;
}

Result<ProjectDescription> read_project_description(const fs::path& folder) {
    const fs::path path = folder / kProjectFile;
    PALPATE_TRY(const std::string text, load_text(path));
    const std::string name = path.string();
    PALPATE_TRY(const Json json, parse_json(text, name));
    JsonErrors errors{name, {}};
    const JsonValue in(json, "", errors);
    ProjectDescription out;
    if (!in.is(Json::Kind::object))
        in.reject("a project");
    else if (const auto version = in.find("project"); !version)
        in.complain("expected a project with \"project\": 1, the version of the format");
    else if (version->number(0, 1e6) != kVersion)
        version->reject("version 1 of the format");
    in.only_keys({"project", "save", "volumes", "grey", "labels", "modality", "scene", "touch",
                  "measures", "label_names", "locked_labels", "bound", "window", "crosshair_mm",
                  "tool_radius_mm", "tool_label", "iso_list"});
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
        ProjectDescription::Entry entry{name_of_volume(*named), file->text(),
                                        read_volume_kind(*kind)};
        if (fs::path(entry.file).filename() != entry.file || entry.file.empty())
            file->reject("the name of a file in the project's folder");
        if (std::any_of(out.volumes.begin(), out.volumes.end(),
                        [&](const auto& other) { return other.name == entry.name; }))
            named->reject("names that differ");
        out.volumes.push_back(std::move(entry));
    }
    for (const auto& [key, member] : {std::pair("grey", &out.grey), {"labels", &out.labels}})
        if (const auto value = in.find(key)) {
            const std::string& chosen = *member = name_of_volume(*value);
            if (std::none_of(out.volumes.begin(), out.volumes.end(),
                             [&](const auto& volume) { return volume.name == chosen; }))
                value->reject("the name of one of the volumes");
        }
    in.take("modality", out.modality);
    if (const auto touch = in.find("touch"))
        out.touch = read_touch_parameters(*touch);
    out.kept = read_kept(in);
    NotePages::Texts notes = pages_of(read_notes(in)).texts();
    for (const char* of_scene : kNotesOfScene)
        notes.erase(of_scene);
    out.notes = NotePages(std::move(notes));
    if (errors.first)
        return tl::unexpected(*errors.first);
    if (const Json* scene = json.find("scene")) {
        PALPATE_TRY(out.scene,
                    parse_scene(json_text(*scene), name + ": scene", path.parent_path()));
    }
    return out;
}

Result<void> write_project_description(const fs::path& folder,
                                       const ProjectDescription& description) {
    const Result<Json> scene = parse_json(write_scene(description.scene), "scene");
    Json volumes = Json::array();
    for (const ProjectDescription::Entry& volume : description.volumes)
        volumes.push_back(
            {{"name", volume.name}, {"kind", name_of(volume.kind)}, {"file", volume.file}});
    Json json{{"project", kVersion}, {"save", description.save}, {"volumes", std::move(volumes)}};
    for (const auto& [key, member] : {std::pair("grey", &description.grey),
                                      {"labels", &description.labels},
                                      {"modality", &description.modality}})
        if (!member->empty())
            json[key] = *member;
    if (scene)
        json["scene"] = *scene;
    json["touch"] = touch_parameters_json(description.touch);
    json.update(kept_json(description.kept));
    for (const auto& [page, text] : description.notes.texts())
        if (std::ranges::find(kNotesOfScene, page) == std::end(kNotesOfScene) && text != "null") {
            PALPATE_TRY(json[page], parse_json(text, page));
        }
    const std::string text = json_text(json);
    return save_bytes(folder / kProjectFile, std::as_bytes(std::span(text)));
}

} // namespace palpate
