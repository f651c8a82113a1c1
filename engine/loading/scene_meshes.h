#pragma once

#include "engine/io/scene_data.h"

namespace palpate {

// Makes the meshes that a scene file's surfaces name, into loaded.data.meshes: reads them from
// files, or takes them from the volume (marching cubes, topology classic, closed at the border, so
// that caps are right) and its labels (surface nets, one mesh with shared walls). Live surfaces
// have none, which is null. What readers warn of goes to loaded.warnings. An error names the file,
// or the surface and what it lacks.
Result<void> make_scene_meshes(const SceneFile& file, LoadedScene& loaded);

// One of them.
Result<std::shared_ptr<const Mesh>> make_scene_mesh(const SceneFile& file,
                                                    const SurfaceSource& source,
                                                    LoadedScene& loaded);

} // namespace palpate
