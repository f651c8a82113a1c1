#include "engine/net/monai_label.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>

#include "engine/base/printable.h"
#include "engine/io/volume_io.h"
#include "engine/net/bytes.h"
#include "engine/net/multipart.h"
#include "engine/net/nifti_body.h"

namespace palpate {

namespace {

constexpr size_t kMostModels = 1000;
constexpr std::chrono::milliseconds kBrief{5'000}; // for what is asked when all is over

std::string text_member(const Json& json, const char* key) {
    const Json* found = json.find(key);
    return found && found->kind == Json::Kind::string ? printable(found->string.substr(0, 300))
                                                      : "";
}

// A name as it may stand in a path.
std::string escaped(std::string_view name) {
    std::string made;
    for (const char c : name)
        made += std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '.'
                    ? std::string(1, c)
                    : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    return made;
}

// {"liver": 1, ..}, or a list of names, whose numbers count from 1.
std::map<std::string, uint16_t> labels_of(const Json& json) {
    std::map<std::string, uint16_t> labels;
    for (const auto& [name, value] : json.members)
        if (value.kind == Json::Kind::number && value.number >= 1 && value.number <= 65535)
            labels[name] = uint16_t(value.number);
    uint16_t next = 1;
    for (const Json& name : json.items)
        if (name.kind == Json::Kind::string && name.string != "background" && next < 65535)
            labels[name.string] = next++;
    return labels;
}

// A folder that only this user reads, gone with everything in it when this is.
class PrivateFolder {
 public:
    static Result<PrivateFolder> make() {
        std::error_code error;
        const auto folder = std::filesystem::temp_directory_path(error);
        std::string name = ((error ? "/tmp" : folder) / "palpate.net.XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr)
            return fail("{}: expected to make a folder, found no right to", name);
        return PrivateFolder(name);
    }
    PrivateFolder(PrivateFolder&& other) noexcept : path_(std::move(other.path_)) {
        other.path_.clear();
    }
    PrivateFolder& operator=(PrivateFolder&& other) noexcept {
        std::swap(path_, other.path_);
        return *this;
    }
    ~PrivateFolder() {
        std::error_code error;
        if (!path_.empty())
            std::filesystem::remove_all(path_, error);
    }
    std::filesystem::path file(const char* name) const { return path_ / name; }

 private:
    explicit PrivateFolder(std::filesystem::path path) : path_(std::move(path)) {}
    std::filesystem::path path_;
};

Json places(const std::vector<glm::uvec3>& points) {
    Json list = Json::array();
    for (const glm::uvec3 at : points)
        list.push_back(Json::array({at.x, at.y, at.z}));
    return list;
}

// A label's points as a model is told them. deepgrow knows one object, deepedit calls it by name.
Json params_of(const MonaiModel& model, uint16_t label, const MonaiPoints& points) {
    std::string name = "foreground";
    if (model.type == "deepedit")
        for (const auto& [known, number] : model.labels)
            if (number == label)
                name = known;
    return Json{{name, places(points.inside)}, {"background", places(points.outside)}};
}

// The bytes of the label map in an answer: a part "image" of several, or the whole body.
Result<std::span<const std::byte>> image_of(const NetServer& server, const HttpReply& reply) {
    const auto type = reply.headers.find("content-type");
    const std::string content_type = type == reply.headers.end() ? "" : type->second;
    if (content_type.starts_with("application/json"))
        return fail("{}: expected a label map, found an answer without one", server.url);
    if (!content_type.starts_with("multipart/"))
        return std::span<const std::byte>(reply.body);
    const Result<std::vector<Part>> parts = read_multipart(content_type, reply.body);
    if (!parts)
        return fail("{}: {}", server.url, parts.error().message);
    for (const Part& part : *parts)
        if (part.name == "image")
            return part.bytes;
    return fail("{}: expected a label map in the part \"image\" of an answer, found none",
                server.url);
}

// Reads the label map of an answer, which lies on the grid of the volume: NIfTI holds places in
// f32, so corners may differ by a hundredth of a sample.
Result<Volume> labels_in(const NetServer& server, std::span<const std::byte> bytes,
                         const PrivateFolder& folder, const Grid& grid,
                         const std::stop_token& stop) {
    const bool is_packed =
        bytes.size() >= 2 && bytes[0] == std::byte{0x1f} && bytes[1] == std::byte{0x8b};
    const auto path = folder.file(is_packed ? "labels.nii.gz" : "labels.nii");
    // Not by save_bytes(): files of a command that take their names at its end are another matter.
    std::ofstream file(path, std::ios::binary);
    file.write(text_of(bytes).data(), std::streamsize(bytes.size()));
    file.close();
    if (!file)
        return fail("{}: expected to write {} bytes, found no room", path.string(), bytes.size());
    ReadOptions options; // room for labels of eight bytes twice, and a file's head
    options.max_memory_bytes = 16 * sample_count(grid) + (64 << 20);
    options.stop = stop;
    Result<LoadedVolume> loaded = load_labels(path, options);
    if (!loaded)
        return fail("{}: the label map of the answer is not read: {}", server.url,
                    loaded.error().message);
    const Grid& found = loaded->volume.grid();
    if (found.size != grid.size)
        return fail("{}: expected labels of {} x {} x {} samples, found {} x {} x {}", server.url,
                    grid.size.x, grid.size.y, grid.size.z, found.size.x, found.size.y,
                    found.size.z);
    const glm::dvec3 spacing = spacing_mm(grid);
    const double near_mm = 0.01 * std::min({spacing.x, spacing.y, spacing.z});
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index = glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2 & 1) *
                                 (glm::dvec3(grid.size) - 1.0);
        if (glm::distance(world_point(found, index), world_point(grid, index)) > near_mm)
            return fail("{}: expected labels where the volume lies, found them elsewhere",
                        server.url);
    }
    return loaded->volume;
}

struct Session {
    std::string id; // "": the server has none
};

// A stop waits a moment for the answer, without which the volume could not be taken off the server.
Result<Session> open_session(NetServer server, std::span<const std::byte> image,
                             const std::stop_token& stop) {
    server.limits.after_stop = kBrief;
    const MultipartBody body =
        write_multipart(std::vector<Part>{{"files", "volume.nii.gz", "application/gzip", image}});
    int status = 0;
    const Result<HttpReply> reply =
        ask(server, {"PUT", "/session/", body.content_type, body.bytes}, stop, &status);
    if (!reply && (status == 406 || status == 404 || status == 405))
        return Session{}; // its sessions are off
    if (!reply && status == 0 && stop.stop_requested())
        return fail("{}; {} may keep the volume", reply.error().message, server.url);
    if (!reply)
        return fail("{}", reply.error().message);
    PALPATE_TRY(const Json json, json_of(server, *reply));
    const std::string id = text_member(json, "session_id");
    if (id.empty())
        return fail("{}: expected a session_id, found none", server.url);
    return Session{escaped(id)};
}

} // namespace

Result<std::vector<MonaiModel>> monai_models(const NetServer& server, const std::stop_token& stop) {
    PALPATE_TRY(const HttpReply reply, ask(server, {"GET", "/info/"}, stop));
    PALPATE_TRY(const Json json, json_of(server, reply));
    const Json& models = json["models"];
    if (models.kind != Json::Kind::object || models.members.size() > kMostModels)
        return fail("{}: expected models, found none: is it a server of MONAI Label?", server.url);
    std::vector<MonaiModel> list;
    for (const auto& [name, model] : models.members) {
        std::string license = text_member(model, "license");
        if (license.empty())
            license = text_member(model["config"], "license");
        list.push_back({name, text_member(model, "type"), labels_of(model["labels"]), license});
    }
    return list;
}

Result<std::vector<Volume>> monai_infer(const NetServer& server, const MonaiModel& model,
                                        const Volume& volume,
                                        const std::map<uint16_t, MonaiPoints>& points,
                                        const std::stop_token& stop) {
    PALPATE_TRY(const PrivateFolder folder, PrivateFolder::make());
    PALPATE_TRY(const std::vector<std::byte> image, nifti_body(volume, stop));
    NetServer large = server; // a whole volume goes, is worked on, and comes back
    large.limits.quiet = std::max(large.limits.quiet, std::chrono::milliseconds(600'000));
    large.limits.reply_bytes = 4 * sample_count(volume.grid()) + (4 << 20);
    PALPATE_TRY(const Session session, open_session(large, image, stop));
    const std::string query =
        session.id.empty() ? "?output=all" : "?session_id=" + session.id + "&output=all";
    std::vector<std::string> all_params;
    for (const auto& [label, of_label] : points)
        all_params.push_back(json_line(params_of(model, label, of_label)));
    if (points.empty())
        all_params.emplace_back("{}");
    const auto infer = [&](const std::string& params) -> Result<Volume> {
        std::vector<Part> parts{{"params", "", "", bytes_of(params)}};
        if (session.id.empty())
            parts.push_back({"file", "volume.nii.gz", "application/gzip", image});
        const MultipartBody body = write_multipart(parts);
        PALPATE_TRY(const HttpReply reply, ask(large,
                                               {"POST", "/infer/" + escaped(model.name) + query,
                                                body.content_type, body.bytes},
                                               stop));
        PALPATE_TRY(const std::span<const std::byte> labels, image_of(server, reply));
        return labels_in(server, labels, folder, volume.grid(), stop);
    };
    std::vector<Volume> made;
    std::optional<Error> failure;
    for (const std::string& params : all_params) {
        Result<Volume> labels = infer(params);
        if (!labels) {
            failure = labels.error();
            break;
        }
        made.push_back(std::move(*labels));
    }
    if (!session.id.empty()) { // also after a failure or a stop
        NetServer brief = server;
        brief.limits.quiet = brief.limits.whole = brief.limits.connect = kBrief;
        (void)ask(brief, {"DELETE", "/session/" + session.id}, {});
    }
    if (failure)
        return tl::unexpected<Error>(*failure);
    return made;
}

} // namespace palpate
