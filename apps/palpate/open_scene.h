#pragma once

#include "apps/palpate/interrupt.h"
#include "apps/palpate/read_options.h"
#include "apps/palpate/scene_options.h"

namespace palpate {

// A scene as options ask for it, its volumes loaded and its meshes made.
struct OpenedScene {
    SceneFile file;
    LoadedScene loaded;
    Scene scene;
};

// Loads what the options name, and prints notes and warnings.
Result<OpenedScene> open_scene(const SceneOptions& options, const ReadFlags& read,
                               const std::stop_token& stop);
inline Result<OpenedScene> open_scene(const SceneOptions& options, const ReadFlags& read,
                                      const Interrupt& interrupt) {
    return open_scene(options, read, interrupt.token());
}

} // namespace palpate
