#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "engine/net/net_server.h"
#include "engine/volume/volume.h"

namespace palpate {

// A box of samples: first .. first + size - 1 on each axis.
struct NetBox {
    glm::uvec3 first{0}, size{1};
};

// A server of nnInteractive's protocol, whose lease this holds: a place on the server, given back
// when this is destroyed. A thread says every few seconds that it is alive.
//
// The server is told an image, then hints; after each it answers with the part of the mask that has
// changed. A call that fails changes nothing here. One thread calls.
class InteractiveNet {
 public:
    // Claims a lease and asks what the net can do. No sample is sent.
    static Result<std::unique_ptr<InteractiveNet>> connect(NetServer server,
                                                           const std::stop_token& stop);
    ~InteractiveNet();
    InteractiveNet(const InteractiveNet&) = delete;
    InteractiveNet& operator=(const InteractiveNet&) = delete;

    struct Abilities {
        std::string license; // as the server states it; "": it states none
        std::string version; // inference_session_version; "": not stated
        bool points = true, boxes = true, scribbles = true, lassos = true, start = true;
        bool undo = false;
        double scribble_samples = 0.0; // preferred thickness; 0: not stated
    };
    const Abilities& abilities() const { return abilities_; }

    // Sends the volume; the mask is empty afterwards. Ten minutes of silence are allowed, as the
    // server prepares the whole image.
    Result<void> set_image(const Volume& volume, const std::stop_token& stop);

    // Hints, after set_image(). `include`: the object is there, else it is not. Places lie within
    // the volume.
    Result<void> add_point(glm::uvec3 at, bool include, const std::stop_token& stop);
    Result<void> add_box(const NetBox& box, bool include, const std::stop_token& stop);
    // `samples` are 0 or 1, of the whole volume, x fastest.
    Result<void> add_scribble(std::span<const uint8_t> samples, bool include,
                              const std::stop_token& stop);
    Result<void> add_lasso(std::span<const uint8_t> samples, bool include,
                           const std::stop_token& stop);
    // A mask to begin with, which becomes the mask.
    Result<void> set_start(std::span<const uint8_t> samples, const std::stop_token& stop);
    Result<void> undo(const std::stop_token& stop);        // the newest hint
    Result<void> reset(const std::stop_token& stop);       // all hints; the mask is empty
    Result<double> heartbeat(const std::stop_token& stop); // seconds that are left without a hint

    // The mask of the object, 0 or 1, x fastest; empty before set_image().
    std::span<const uint8_t> mask() const { return mask_; }

 private:
    explicit InteractiveNet(NetServer server) : server_(std::move(server)) {}
    Result<HttpReply> post(const std::string& path, const Json& body, const std::stop_token& stop);
    Result<HttpReply> post_array(const std::string& path, const Json& meta,
                                 std::span<const std::byte> array, const std::stop_token& stop,
                                 std::chrono::milliseconds quiet);
    Result<void> add_mask(const char* path, std::span<const uint8_t> samples, bool include,
                          const std::stop_token& stop);
    Result<void> apply(const HttpReply& reply);

    NetServer server_;
    Abilities abilities_;
    glm::uvec3 size_{0};
    std::vector<uint8_t> mask_;
    std::jthread beats_;
};

} // namespace palpate
