#include "engine/net/interactive_net.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <mutex>

#include "engine/base/assert.h"
#include "engine/base/printable.h"
#include "engine/net/bytes.h"
#include "engine/net/net_array.h"

namespace palpate {

namespace {

using namespace std::chrono_literals;

constexpr auto kPrepares = 600'000ms; // silence after an image was sent
constexpr auto kReleases = 5'000ms;
constexpr std::chrono::milliseconds kLeastPause = 250ms; // between two signs of life

NetServer with_quiet(const NetServer& server, std::chrono::milliseconds quiet) {
    NetServer other = server;
    other.limits.quiet = quiet;
    return other;
}

// The server counts z, y, x.
Json place(glm::uvec3 at) {
    return Json::array({at.z, at.y, at.x});
}

std::array<int64_t, 3> shape_of(glm::uvec3 size) {
    return {size.z, size.y, size.x};
}

// The box [[z, end], [y, end], [x, end]] of an answer.
Result<NetBox> box_of(const std::string& url, const Json& json, glm::uvec3 size) {
    const auto wrong = [&] {
        return fail("{}: expected the box of an answer within {} x {} x {}, found {}", url, size.x,
                    size.y, size.z, printable(json_line(json).substr(0, 200)));
    };
    if (json.items.size() != 3)
        return wrong();
    NetBox box;
    for (int axis = 0; axis < 3; ++axis) {
        const std::vector<double> ends = json.items[size_t(2 - axis)].numbers();
        if (json.items[size_t(2 - axis)].items.size() != 2 || ends.size() != 2 ||
            !(ends[0] >= 0 && ends[0] < ends[1] && ends[1] <= double(size[axis])) ||
            ends[0] != std::floor(ends[0]) || ends[1] != std::floor(ends[1]))
            return wrong();
        box.first[axis] = uint32_t(ends[0]);
        box.size[axis] = uint32_t(ends[1] - ends[0]);
    }
    return box;
}

std::string text_in(const Json& json, const char* key) {
    const Json* found = json.find(key);
    if (found == nullptr || found->is_null())
        return "";
    return printable(
        (found->kind == Json::Kind::string ? found->string : json_line(*found)).substr(0, 300));
}

double number_in(const Json& json, const char* key) {
    const Json* found = json.find(key);
    return found && found->kind == Json::Kind::number && std::isfinite(found->number)
               ? found->number
               : 0.0;
}

// Whether a hint is among those that the server names; one that it does not name is tried.
bool can(const Json& interactions, const char* name) {
    const Json* found = interactions.find(name);
    return found == nullptr || found->kind != Json::Kind::boolean || found->boolean;
}

InteractiveNet::Abilities abilities_of(const Json& json) {
    InteractiveNet::Abilities abilities;
    abilities.license = text_in(json, "license");
    if (abilities.license == "!!MISSING!!") // the server's word for none
        abilities.license.clear();
    abilities.version = text_in(json, "inference_session_version");
    const Json& interactions = json["supported_interactions"];
    abilities.points = can(interactions, "points");
    abilities.boxes = can(interactions, "bbox2d") || can(interactions, "bbox3d");
    abilities.scribbles = can(interactions, "scribble");
    abilities.lassos = can(interactions, "lasso");
    const Json* start = json.find("supports_initial_label");
    abilities.start = start == nullptr || start->boolean;
    const Json* undo = json.find("supports_undo");
    abilities.undo = undo != nullptr && undo->boolean;
    abilities.scribble_samples = number_in(json, "preferred_scribble_thickness");
    return abilities;
}

} // namespace

Result<std::unique_ptr<InteractiveNet>> InteractiveNet::connect(NetServer server,
                                                                const std::stop_token& stop) {
    std::unique_ptr<InteractiveNet> net(new InteractiveNet(std::move(server)));
    PALPATE_TRY(const HttpReply claimed, ask(net->server_, {"POST", "/claim"}, stop));
    PALPATE_TRY(const Json claim, json_of(net->server_, claimed));
    const Json& token = claim["lease_token"];
    const bool is_token = token.kind == Json::Kind::string && !token.string.empty() &&
                          token.string.size() <= 256 &&
                          std::all_of(token.string.begin(), token.string.end(),
                                      [](char c) { return c > ' ' && c < 127; });
    if (!is_token)
        return fail("{}: expected a lease, found none: is it a server of nnInteractive?",
                    net->server_.url);
    net->server_.lease = token.string;
    PALPATE_TRY(const HttpReply told, ask(net->server_, {"GET", "/capabilities"}, stop));
    PALPATE_TRY(const Json capabilities, json_of(net->server_, told));
    net->abilities_ = abilities_of(capabilities);
    // Twice in the time after which the server believes that this program has died.
    const double alive_s = std::clamp(number_in(claim, "liveness_timeout_seconds"), 0.0, 3600.0);
    if (alive_s > 0.0) {
        const auto pause = std::max(kLeastPause, std::chrono::milliseconds(int64_t(alive_s * 500)));
        net->beats_ = std::jthread([server = net->server_, pause](const std::stop_token& ended) {
            std::mutex mutex;
            std::condition_variable_any wake;
            std::unique_lock lock(mutex);
            while (!wake.wait_for(lock, ended, pause, [] { return false; }) &&
                   !ended.stop_requested()) {
                int status = 0; // a beat that is lost is no failure, an ended lease needs no more
                (void)ask(server, {"POST", "/heartbeat"}, ended, &status);
                if (status == 410)
                    return;
            }
        });
    }
    return net;
}

InteractiveNet::~InteractiveNet() {
    beats_ = {};
    if (server_.lease.empty())
        return;
    // A server that does not hear it frees the place by itself.
    server_.limits.quiet = server_.limits.whole = server_.limits.connect = kReleases;
    (void)ask(server_, {"POST", "/release"}, {});
}

Result<HttpReply> InteractiveNet::post(const std::string& path, const Json& body,
                                       const std::stop_token& stop) {
    const std::string text = json_line(body);
    NetServer server = server_;
    server.limits.reply_bytes = mask_.size() + (4 << 20);
    return ask(server, {"POST", path, "application/json", bytes_of(text)}, stop);
}

Result<HttpReply> InteractiveNet::post_array(const std::string& path, const Json& meta,
                                             std::span<const std::byte> array,
                                             const std::stop_token& stop,
                                             std::chrono::milliseconds quiet) {
    NetServer server = with_quiet(server_, quiet);
    server.limits.reply_bytes = mask_.size() + (4 << 20);
    return ask(server, {"POST", path, "application/octet-stream", array, json_line(meta)}, stop);
}

Result<void> InteractiveNet::set_image(const Volume& volume, const std::stop_token& stop) {
    const glm::uvec3 size = volume.size();
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const Json meta{
        {"image_properties", Json{{"spacing", Json::array({spacing.z, spacing.y, spacing.x})}}}};
    const std::vector<std::byte> image = write_net_image(volume);
    PALPATE_TRY(
        post_array("/set_image", meta, image, stop, std::max(kPrepares, server_.limits.quiet)));
    const Json buffer{{"shape", place(size)}, {"dtype", "uint8"}};
    PALPATE_TRY(post("/set_target_buffer", buffer, stop));
    size_ = size;
    mask_.assign(sample_count(volume.grid()), 0);
    return {};
}

Result<void> InteractiveNet::apply(const HttpReply& reply) {
    const auto meta_text = reply.headers.find("x-meta");
    if (meta_text == reply.headers.end())
        return fail("{}: expected an answer with the header X-Meta, found none", server_.url);
    PALPATE_TRY(const Json meta, parse_json(meta_text->second, server_.url + " X-Meta"));
    const Json& box_json = meta["bbox"];
    if (box_json.is_null())
        return {}; // nothing has changed
    PALPATE_TRY(const NetBox box, box_of(server_.url, box_json, size_));
    const std::array<int64_t, 3> shape = shape_of(box.size);
    const Result<std::vector<uint8_t>> part = read_net_array(reply.body, shape);
    if (!part)
        return fail("{}: {}", server_.url, part.error().message);
    auto from = part->begin();
    for (uint32_t z = 0; z < box.size.z; ++z)
        for (uint32_t y = 0; y < box.size.y; ++y)
            for (uint32_t x = 0; x < box.size.x; ++x, ++from) {
                const glm::uvec3 at = box.first + glm::uvec3(x, y, z);
                mask_[at.x + size_.x * (at.y + size_t{size_.y} * at.z)] = *from != 0;
            }
    return {};
}

Result<void> InteractiveNet::add_point(glm::uvec3 at, bool include, const std::stop_token& stop) {
    PALPATE_ASSERT(glm::all(glm::lessThan(at, size_)));
    const Json body{
        {"coordinates", place(at)}, {"include_interaction", include}, {"run_prediction", true}};
    PALPATE_TRY(const HttpReply reply, post("/add_point_interaction", body, stop));
    return apply(reply);
}

Result<void> InteractiveNet::add_box(const NetBox& box, bool include, const std::stop_token& stop) {
    PALPATE_ASSERT(glm::all(glm::lessThanEqual(box.first + box.size, size_)));
    Json ends = Json::array();
    for (int axis = 2; axis >= 0; --axis)
        ends.push_back(Json::array({box.first[axis], box.first[axis] + box.size[axis]}));
    const Json body{
        {"bbox_coords", ends}, {"include_interaction", include}, {"run_prediction", true}};
    PALPATE_TRY(const HttpReply reply, post("/add_bbox_interaction", body, stop));
    return apply(reply);
}

// Sends the box about the samples that are set, and where it lies.
Result<void> InteractiveNet::add_mask(const char* path, std::span<const uint8_t> samples,
                                      bool include, const std::stop_token& stop) {
    PALPATE_ASSERT_CMP(samples.size(), ==, mask_.size());
    glm::uvec3 low = size_, high{0};
    size_t i = 0;
    for (uint32_t z = 0; z < size_.z; ++z)
        for (uint32_t y = 0; y < size_.y; ++y)
            for (uint32_t x = 0; x < size_.x; ++x, ++i)
                if (samples[i] != 0) {
                    low = glm::min(low, glm::uvec3(x, y, z));
                    high = glm::max(high, glm::uvec3(x, y, z) + 1u);
                }
    if (high.x == 0)
        return fail("expected a hint with samples, found none");
    const glm::uvec3 size = high - low;
    std::vector<uint8_t> part;
    part.reserve(size_t{size.x} * size.y * size.z);
    for (uint32_t z = low.z; z < high.z; ++z)
        for (uint32_t y = low.y; y < high.y; ++y) {
            const auto row = samples.subspan(low.x + size_.x * (y + size_t{size_.y} * z), size.x);
            part.insert(part.end(), row.begin(), row.end());
        }
    Json ends = Json::array();
    for (int axis = 2; axis >= 0; --axis)
        ends.push_back(Json::array({low[axis], high[axis]}));
    const Json meta{
        {"include_interaction", include}, {"run_prediction", true}, {"interaction_bbox", ends}};
    const std::array<int64_t, 3> shape = shape_of(size);
    const std::vector<std::byte> array = write_net_array(part, shape);
    PALPATE_TRY(const HttpReply reply, post_array(path, meta, array, stop, server_.limits.quiet));
    return apply(reply);
}

Result<void> InteractiveNet::add_scribble(std::span<const uint8_t> samples, bool include,
                                          const std::stop_token& stop) {
    return add_mask("/add_scribble_interaction", samples, include, stop);
}

Result<void> InteractiveNet::add_lasso(std::span<const uint8_t> samples, bool include,
                                       const std::stop_token& stop) {
    return add_mask("/add_lasso_interaction", samples, include, stop);
}

Result<void> InteractiveNet::set_start(std::span<const uint8_t> samples,
                                       const std::stop_token& stop) {
    PALPATE_ASSERT_CMP(samples.size(), ==, mask_.size());
    const std::array<int64_t, 3> shape = shape_of(size_);
    const std::vector<std::byte> array = write_net_array(samples, shape);
    PALPATE_TRY(const HttpReply reply,
                post_array("/add_initial_seg_interaction", Json{{"run_prediction", false}}, array,
                           stop, server_.limits.quiet));
    PALPATE_TRY(apply(reply));
    mask_.assign(samples.begin(), samples.end());
    return {};
}

Result<void> InteractiveNet::undo(const std::stop_token& stop) {
    PALPATE_TRY(const HttpReply reply, post("/undo", Json::object(), stop));
    return apply(reply);
}

Result<void> InteractiveNet::reset(const std::stop_token& stop) {
    PALPATE_TRY(post("/reset_interactions", Json::object(), stop));
    std::fill(mask_.begin(), mask_.end(), uint8_t{0});
    return {};
}

Result<double> InteractiveNet::heartbeat(const std::stop_token& stop) {
    PALPATE_TRY(const HttpReply reply, ask(server_, {"POST", "/heartbeat"}, stop));
    PALPATE_TRY(const Json json, json_of(server_, reply));
    return number_in(json, "remaining_seconds");
}

} // namespace palpate
