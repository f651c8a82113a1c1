#pragma once

#include <cstdint>

#include "engine/gpu/shader.h"

namespace palpate {

// The choices that select one compiled ray caster.
struct RayCastVariant {
    uint32_t mode = 0; // gpu::kMode...
    bool preintegrated = false, exact = false, shaded = false;
    bool light = false;     // it is not at the eye
    bool occlusion = false; // iso: ambient occlusion
    bool labels = false, slices = false, values = false, no_data = false;
    uint32_t iso_count = 1;
    bool skip = true;     // jump over empty space
    bool count = false;   // count samples
    uint32_t rays = 0;    // gpu::kRays...
    bool atlas = false;   // the volume lies in a brick atlas
    bool by_hand = false; // interpolate in fp32
    bool stored_gradients = false;
    uint32_t layers = 0; // see-through triangles in a ray's way, at most; slices is true then

    bool has_first_hits() const; // leaves and reads them: shaders/lib/first_hits.glsl
    operator Shader() const;
};

} // namespace palpate
