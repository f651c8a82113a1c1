#pragma once

#include "engine/image/image.h"
#include "engine/scene/scene.h"

namespace palpate {

// Some pixels of a picture: column offset.x + i * step, row offset.y + j * step, as many as fit.
struct PixelStride {
    uint32_t step = 1;     // >= 1
    glm::uvec2 offset{0u}; // below the picture's size

    glm::uvec2 size(glm::uvec2 size_px) const { return (size_px - offset + step - 1u) / step; }
};

// One pixel before it is rounded to float.
struct PixelSample {
    glm::dvec4 rgba{0.0};
    double value = 0.0, depth = 0.0; // as Scene::value_and_depth says; NaN where there is none
};

// The picture that the ray caster and the slice pass must draw, in double on the CPU: same scene,
// same lattice of samples, same tables, same order of operations, none of the speed. Channels R, G,
// B, A, and "value", "depth" where the scene asks for them: with a ray-cast layer the value is its
// own, else the slice's; the depth is that of the first iso-surface, else the slice's.
// `eye` is 0, or 1 for the right eye of a stereo scene. Threaded; the same bits on any number of
// threads.
Image render_twin(const Scene& scene, const SceneData& data, int eye = 0, PixelStride pixels = {});

// One pixel of it; `pixel` may be fractional and outside the picture.
PixelSample twin_pixel(const Scene& scene, const SceneData& data, glm::dvec2 pixel, int eye = 0);

} // namespace palpate
