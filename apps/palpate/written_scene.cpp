#include "apps/palpate/written_scene.h"

#include <filesystem>

#include "engine/session/default_scene.h"

namespace palpate {

namespace {

namespace fs = std::filesystem;

// `name` as a scene in `folder` names it; "" and what is no file stay as they are.
std::string named_from(const fs::path& folder, const SceneFile& scene, const std::string& name) {
    if (name.empty() || is_synthetic(name))
        return name;
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(volume_path(scene, name), error);
    if (error || !fs::exists(whole, error))
        return name;
    const fs::path relative = whole.lexically_relative(folder);
    const bool is_far = std::distance(relative.begin(), relative.end()) > 1 &&
                        *relative.begin() == ".." && *std::next(relative.begin()) == "..";
    return relative.empty() || is_far ? whole.string() : relative.string();
}

} // namespace

SceneFile scene_to_write(const SceneFile& drawn, const SceneFile& opened,
                         const SceneOptions& options, const std::string& path) {
    SceneFile out = drawn;
    const Camera& camera = drawn.scene.camera;
    if (options.camera.empty() && !options.view.empty()) {
        const std::optional<ViewDirection> view = view_direction(options.view);
        out.framing = Framing{view->towards, view->up, options.fill.value_or(0.8),
                              camera.view_angle_deg, camera.projection};
    } else if (options.camera.empty() && has_scene(options.input) && opened.framing) {
        out.framing = opened.framing;
        out.framing->fill = options.fill.value_or(out.framing->fill);
        out.framing->view_angle_deg = camera.view_angle_deg;
        out.framing->projection = camera.projection;
    }
    if (path == "-")
        return out;
    std::error_code ignored;
    const fs::path folder = fs::weakly_canonical(fs::absolute(path).parent_path(), ignored);
    for (std::string* name : {&out.volume, &out.labels, &out.fused, &out.overlay})
        *name = named_from(folder, drawn, *name);
    for (SurfaceSource& surface : out.surfaces)
        surface.mesh = named_from(folder, drawn, surface.mesh);
    return out;
}

} // namespace palpate
