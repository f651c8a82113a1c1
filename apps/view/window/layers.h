#pragma once

#include <string>
#include <vector>

#include "engine/io/volume_io.h"
#include "engine/program/scene_options.h"

namespace palpate::view {

// Files that are opened over the volume of a scene, each by what it holds: numbers of labels become
// the label map, and the overlay where there is one; other values the volume in colour over the
// slices. At most one each. An error names the file.
Result<void> take_layers(const std::vector<std::string>& files, const ReadOptions& how,
                         SceneOptions& scene);

} // namespace palpate::view
