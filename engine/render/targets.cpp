#include "engine/render/targets.h"

#include <limits>

#include "shaders/shared/tiles.h"

namespace palpate {

namespace {

// Which images a scene needs.
struct Wanted {
    Wanted(const Scene& scene, bool see_through)
        : behind(!scene.surfaces.empty() || (!scene.slices.empty() && scene.ray_cast.has_value())),
          values(scene.value_and_depth || (!scene.slices.empty() && !behind)),
          layers(scene.ray_cast && see_through ? scene.surface_depth * eye_count(scene) : 0) {}
    bool behind, values;
    uint32_t layers;
};

const glm::vec4 kNoValue(std::numeric_limits<float>::quiet_NaN());

} // namespace

glm::vec4 color_of_nothing(const Scene& scene) {
    return glm::vec4(glm::vec3(scene.background), 0.0f);
}

uint32_t eye_count(const Scene& scene) {
    return scene.stereo ? 2 : 1;
}

uint32_t all_eyes(const Scene& scene) {
    return (1u << eye_count(scene)) - 1u;
}

std::vector<View> views_of(const Scene& scene) {
    if (!scene.stereo)
        return {make_view(scene.camera, scene.size_px)};
    const auto pair = make_stereo_views(scene.camera, scene.stereo->rig, scene.size_px);
    return {pair.begin(), pair.end()};
}

glm::uvec2 tile_count(glm::uvec2 rays) {
    return (rays + (gpu::kTileSide - 1)) / gpu::kTileSide;
}

Targets::Targets(GpuDevice& device, const Scene& scene, bool see_through)
    : size_px(scene.size_px), eyes(eye_count(scene)), return_values(scene.value_and_depth) {
    const Wanted wanted(scene, see_through);
    const auto make = [&](std::optional<GpuImage>& image, const char* name, VkFormat format,
                          uint32_t layer_count) {
        image.emplace(
            device, name,
            ImageShape{
                .format = format, .size = {size_px, 1}, .layers = layer_count, .storage = true});
    };
    make(color, "picture", VK_FORMAT_R32G32B32A32_SFLOAT, eyes);
    if (wanted.values)
        make(values, "value and depth", VK_FORMAT_R32G32_SFLOAT, eyes);
    const bool surfaces = !scene.surfaces.empty();
    if (wanted.behind) {
        make(behind, surfaces ? "behind all rays" : "slices", VK_FORMAT_R32G32B32A32_SFLOAT, eyes);
        make(behind_values,
             surfaces ? "value and depth behind all rays" : "slices' value and depth",
             VK_FORMAT_R32G32_SFLOAT, eyes);
    }
    if (wanted.layers > 0)
        make(layers, "see-through layers", VK_FORMAT_R32G32B32A32_UINT, wanted.layers);
}

bool Targets::suit(const Scene& scene, bool see_through) const {
    const Wanted wanted(scene, see_through);
    return size_px == scene.size_px && eyes == eye_count(scene) &&
           return_values == scene.value_and_depth && values.has_value() == wanted.values &&
           behind.has_value() == wanted.behind &&
           (layers ? layers->shape().layers : 0) == wanted.layers;
}

void Targets::clear_behind(const Scene& scene, Commands& commands) {
    commands.clear(*behind, color_of_nothing(scene));
    commands.clear(*behind_values, kNoValue);
}

void Targets::record_background(const Scene& scene, Commands& commands) {
    commands.begin_pass("background");
    if (behind)
        commands.copy(*behind, *color);
    else
        commands.clear(*color, color_of_nothing(scene));
    if (return_values && behind_values)
        commands.copy(*behind_values, *values);
    else if (return_values)
        commands.clear(*values, kNoValue);
    commands.end_pass();
}

} // namespace palpate
