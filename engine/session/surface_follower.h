#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <thread>

#include "engine/edit/edit_lag.h"
#include "engine/edit/editor.h"
#include "engine/session/session_sources.h"
#include "engine/surface/block_surface.h"

namespace palpate {

// The mesh of the grey volume's surface, which follows edits, sources and an iso-value: on a thread
// of its own, or in update().
class SurfaceFollower {
 public:
    struct Parts { // all outlive it
        Editor& editor;
        Mailbox<SessionSources>& sources;
        Followers& choices; // woken after a publication of `sources`
        EditLag& lag;
        Wake& done; // woken after each update
    };
    // Without an iso-value there is no mesh, and no thread.
    SurfaceFollower(const Parts& parts, std::optional<float> iso, bool threaded);
    ~SurfaceFollower();

    // The thread of commands.
    void set_iso(float iso);

    // Without a thread: meshes what is newest. False: nothing new.
    bool update();

    // Any thread. Of the newest state that was meshed; empty without one.
    Mesh mesh();
    // Any thread: whether a snapshot of the document, an epoch of the sources and the iso-value are
    // meshed; true, too, where no thread does it.
    bool has_reached(uint64_t snapshot, uint64_t sources) const {
        return !thread_.joinable() ||
               (snapshot_ >= snapshot && sources_epoch_ >= sources && meshed_iso_ == iso_);
    }

 private:
    void run(const std::stop_token& stop);
    void follow(const Volume& volume);

    Parts parts_;
    Editor::Readers::Reader states_;
    Mailbox<SessionSources>::Reader sources_;
    std::atomic<float> iso_; // NaN: no mesh
    std::mutex mutex_;       // of surface_
    std::optional<BlockSurface> surface_;
    // The versions that surface_ has got to.
    std::atomic<uint64_t> snapshot_{0}, sources_epoch_{0};
    std::atomic<float> meshed_iso_{0.0f};
    Wake wake_;
    Followers::Place edits_, choices_;
    std::jthread thread_; // last: ends before the rest goes
};

} // namespace palpate
