#include "engine/render/ray_cast_variant.h"

#include "shaders/shared/ray_cast.h"
#include "spirv/ray_cast.h"
#include "spirv/ray_cast_layers.h"

namespace palpate {

bool RayCastVariant::has_first_hits() const {
    return mode == gpu::kModeIso && !exact && layers == 0;
}

RayCastVariant::operator Shader() const {
    const auto filled = [&](auto shader) {
        shader.is_iso = mode == gpu::kModeIso;
        shader.has_labels = labels;
        shader.has_values = values;
        shader.is_exact = exact;
        shader.has_atlas = atlas;
        shader.mode = mode;
        shader.preintegrated = preintegrated;
        shader.shaded = shaded;
        shader.light = light;
        shader.occlusion = occlusion;
        shader.has_no_data = no_data;
        shader.iso_count = iso_count;
        shader.skip = skip;
        shader.count = count;
        shader.rays = rays;
        shader.manual = by_hand;
        shader.stored = stored_gradients;
        return shader;
    };
    if (layers > 0)
        return filled(spirv::RayCastLayers{.layer_count = layers});
    return filled(spirv::RayCast{.has_slices = slices});
}

} // namespace palpate
