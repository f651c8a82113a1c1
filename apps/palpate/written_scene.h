#pragma once

#include <string>

#include "engine/program/scene_options.h"
#include "engine/scene/scene_file.h"

namespace palpate {

// The scene that --write-scene writes for what is drawn, to `path` ("-" is standard output). Files
// in the folder of `path`, below it, or below the folder that holds it are named relative to it, so
// that the folder can move; others by their whole path. A camera that the volume decides, as --view
// names it or a scene file's direction does, stays one, so that the scene serves another volume.
SceneFile scene_to_write(const SceneFile& drawn, const SceneFile& opened,
                         const SceneOptions& options, const std::string& path);

} // namespace palpate
