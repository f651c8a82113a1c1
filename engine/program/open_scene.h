#pragma once

#include <map>
#include <string>

#include "engine/loading/scene_meshes.h"
#include "engine/program/interrupt.h"
#include "engine/program/read_options.h"
#include "engine/program/scene_options.h"

namespace palpate {

// A scene as options ask for it, its volumes loaded and its meshes made.
struct OpenedScene {
    SceneFile file;
    LoadedScene loaded;
    Scene scene;
};

// Volumes and meshes that a caller has in memory, by the names under which SceneOptions name them.
// Where the input is one of them, so are labels, fused volume and overlay.
struct InMemory {
    std::map<std::string, LoadedVolume> volumes;
    KnownMeshes meshes;
};

// Loads what the options name, and prints notes and warnings: those of readers, and of labels,
// fused volume and overlay that lie beside the volume. They are in OpenedScene::loaded, too.
Result<OpenedScene> open_scene(const SceneOptions& options, const ReadFlags& read,
                               const std::stop_token& stop, const InMemory& memory = {});
inline Result<OpenedScene> open_scene(const SceneOptions& options, const ReadFlags& read,
                                      const Interrupt& interrupt) {
    return open_scene(options, read, interrupt.token());
}

} // namespace palpate
