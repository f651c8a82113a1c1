#include "apps/view/document/live_surface.h"

#include <algorithm>
#include <utility>

namespace palpate::view {

namespace {

bool has_live(const Scene& scene) {
    return std::any_of(scene.surfaces.begin(), scene.surfaces.end(),
                       [](const SurfaceLayer& layer) { return layer.live_iso.has_value(); });
}

} // namespace

const char* name_of(SeenAs seen) {
    constexpr const char* names[] = {"rays", "surface", "both"};
    return names[static_cast<size_t>(seen)];
}

SeenAs seen_as(const Scene& scene) {
    return !has_live(scene) ? SeenAs::rays : scene.ray_cast ? SeenAs::both : SeenAs::mesh;
}

bool show_as(Scene& scene, SeenAs seen, double iso, std::optional<RayCastLayer>& put_away) {
    if (seen != SeenAs::mesh && !scene.ray_cast && !put_away)
        return false;
    if (seen != SeenAs::rays && !has_live(scene)) {
        if (scene.surfaces.size() >= kMaxSurfaces)
            return false;
        scene.surfaces.emplace_back().live_iso = iso;
    }
    if (seen == SeenAs::rays)
        std::erase_if(scene.surfaces,
                      [](const SurfaceLayer& layer) { return layer.live_iso.has_value(); });
    if (seen == SeenAs::mesh && scene.ray_cast)
        put_away = std::exchange(scene.ray_cast, std::nullopt);
    if (seen != SeenAs::mesh && !scene.ray_cast)
        scene.ray_cast = std::exchange(put_away, std::nullopt);
    return true;
}

} // namespace palpate::view
