#pragma once

#include <atomic>
#include <memory>
#include <optional>

#include "engine/edit/editor.h"
#include "engine/session/session_sources.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate {

// Publishes what is felt: the volumes of the newest document that were chosen by name, and where an
// algorithm feels a mesh, that of the felt volume, which follows what is edited.
//
// All members are for the thread that publishes, but where another is named.
class FeltPublisher {
 public:
    // All outlive it. `surface`: SessionSetup::felt_surface; null: the mesh of the sources stays.
    FeltPublisher(Editor& editor, const Document& first, Mailbox<SessionSources>& sources,
                  Mailbox<haptics::TouchParameters>& parameters,
                  std::shared_ptr<haptics::TouchSurface> surface);

    // Publishes if the document or the sources are others than before. False: they are not.
    bool publish();

    // For readers; published scenes have versions that rise.
    Mailbox<haptics::TouchScene>& scenes() { return scenes_; }
    // The volume that is felt by the newest parameters; nothing where there is none.
    std::optional<Volume> felt_volume();

    // Any thread: whether a snapshot of the document, and an epoch of the sources, are published.
    bool has_reached(uint64_t snapshot, uint64_t sources) const {
        return snapshot_ >= snapshot && sources_epoch_ >= sources;
    }
    // The snapshot in a scene of this version.
    static uint64_t snapshot_of(uint64_t scene_version) {
        return scene_version & ((uint64_t{1} << kSnapshotBits) - 1);
    }

 private:
    // The version of a scene rises with each publication: algorithms know by it that a tool or a
    // mesh is another. It is the snapshot, and above these bits how often sources were chosen.
    static constexpr int kSnapshotBits = 40;
    static haptics::TouchScene scene_of(const SessionSources& sources, uint64_t chosen,
                                        const Document& document, uint64_t snapshot);

    Mailbox<haptics::TouchScene> scenes_;
    Editor::Readers::Reader states_;
    Mailbox<SessionSources>::Reader sources_;
    Mailbox<haptics::TouchParameters>::Reader parameters_;
    std::shared_ptr<haptics::TouchSurface> surface_;
    std::shared_ptr<const haptics::TouchMesh> mesh_, first_mesh_; // of surface_
    // What scenes_ has got to.
    std::atomic<uint64_t> snapshot_{0}, sources_epoch_{1};
};

} // namespace palpate
