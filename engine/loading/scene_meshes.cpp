#include "engine/loading/scene_meshes.h"

#include "engine/base/profile.h"
#include "engine/io/mesh_io.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/surface_nets.h"
#include "engine/volume/thickness.h"

namespace palpate {

namespace {

// Passes that take the steps of voxels off walls between labels, as far as their bound allows.
constexpr uint32_t kLabelSmoothing = 10;

} // namespace

Result<std::shared_ptr<const Mesh>> make_scene_mesh(const SceneFile& file,
                                                    const SurfaceSource& source,
                                                    LoadedScene& loaded) {
    if (source.iso)
        return std::make_shared<const Mesh>(marching_cubes(thickened(loaded.data.volume),
                                                           static_cast<float>(*source.iso),
                                                           {.closed_at_border = true}));
    if (source.labels)
        return std::make_shared<const Mesh>(
            surface_nets(*loaded.data.labels, {.passes = kLabelSmoothing}));
    const std::filesystem::path path = volume_path(file, source.mesh);
    PALPATE_TRY(LoadedMesh mesh, load_mesh(path));
    loaded.warnings.insert(loaded.warnings.end(), mesh.warnings.begin(), mesh.warnings.end());
    return std::make_shared<const Mesh>(std::move(mesh.mesh));
}

Result<void> make_scene_meshes(const SceneFile& file, LoadedScene& loaded,
                               const KnownMeshes& known) {
    const profile::Scope scope("make meshes");
    loaded.data.meshes.clear();
    for (size_t i = 0; i < file.surfaces.size(); ++i) {
        if (i < file.scene.surfaces.size() &&
            (file.scene.surfaces[i].live_iso || file.scene.surfaces[i].live_labels)) {
            loaded.data.meshes.push_back(nullptr);
            continue;
        }
        if (const auto found = known.find(file.surfaces[i].mesh); found != known.end()) {
            loaded.data.meshes.push_back(found->second);
            continue;
        }
        PALPATE_TRY(std::shared_ptr<const Mesh> mesh,
                    make_scene_mesh(file, file.surfaces[i], loaded));
        loaded.data.meshes.push_back(std::move(mesh));
    }
    return {};
}

} // namespace palpate
