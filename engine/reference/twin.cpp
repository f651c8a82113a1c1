#include "engine/reference/twin.h"

#include "engine/reference/exact.h"
#include "engine/reference/picture.h"
#include "engine/volume/thickness.h"

namespace palpate {

using namespace reference;

namespace {

// Calls use(picture) with the twin's picture of a scene.
template <class Use>
auto with_twin_picture(const Scene& scene, SceneData data, int eye, const Use& use) {
    data.volume = thickened(data.volume);
    TransferTable table, slice_table;
    RayCastLayer layer;
    if (scene.ray_cast) {
        layer = *scene.ray_cast;
        if (!layer.transfer.colors.empty())
            table = make_table(layer.transfer);
    }
    if (!scene.slices.empty())
        slice_table = make_table(scene.slice_transfer);
    const double step_mm = step_mm_of(layer, data.volume.grid());
    const auto slice_color = [&](double value) {
        return glm::dvec3(nearest_entry(slice_table, value));
    };
    if (layer.integrator == Integrator::exact) {
        const auto make_marcher = [&](const Rays& rays, Sampler& sampler) {
            return [marcher = ExactMarcher(layer, table, data.volume, rays, sampler)](
                       const LocalRay& ray, Stretch t) mutable { return marcher.march(ray, t); };
        };
        return use(Picture(scene, data, eye, make_marcher, slice_color));
    }
    const auto make_marcher = [&](const Rays&, Sampler& sampler) {
        return [marcher = Marcher(layer, table, step_mm, sampler)](
                   const LocalRay& ray, Stretch t) mutable { return marcher.march(ray, t); };
    };
    return use(Picture(scene, data, eye, make_marcher, slice_color));
}

} // namespace

Image render_twin(const Scene& scene, const SceneData& data, int eye, PixelStride pixels) {
    return with_twin_picture(scene, data, eye,
                             [&](const auto& picture) { return picture.image(pixels); });
}

PixelSample twin_pixel(const Scene& scene, const SceneData& data, glm::dvec2 pixel, int eye) {
    return with_twin_picture(scene, data, eye,
                             [&](const auto& picture) { return picture.pixel(pixel); });
}

} // namespace palpate
