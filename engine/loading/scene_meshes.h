#pragma once

#include <map>
#include <memory>
#include <string>

#include "engine/io/scene_data.h"

namespace palpate {

// Makes the meshes that a scene file's surfaces name, into loaded.data.meshes: reads them from
// files, or takes them from the volume (marching cubes, topology classic, closed at the border, so
// that caps are right) and its labels (surface nets, one mesh with shared walls). Live surfaces
// have none, which is null. What readers warn of goes to loaded.warnings. An error names the file,
// or the surface and what it lacks.
//
// `known` holds meshes that are in memory, by the names under which `file` has them.
using KnownMeshes = std::map<std::string, std::shared_ptr<const Mesh>>;
Result<void> make_scene_meshes(const SceneFile& file, LoadedScene& loaded,
                               const KnownMeshes& known = {});

// One of them.
Result<std::shared_ptr<const Mesh>> make_scene_mesh(const SceneFile& file,
                                                    const SurfaceSource& source,
                                                    LoadedScene& loaded);

} // namespace palpate
