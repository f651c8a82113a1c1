#include "engine/reference/rays.h"

#include <limits>

#include "engine/base/assert.h"

namespace palpate::reference {

Rays::Rays(const Scene& scene, const SceneData& data, int eye)
    : size_px_(scene.size_px),
      origin_mm_(data.volume.grid().world_from_index[3]),
      last_(glm::dvec3(data.volume.size()) - 1.0),
      index_from_local_(glm::inverse(glm::dmat3(data.volume.grid().world_from_index))) {
    PALPATE_ASSERT(eye == 0 || (eye == 1 && scene.stereo));
    view_ = scene.stereo ? make_stereo_views(scene.camera, scene.stereo->rig, scene.size_px)[eye]
                         : make_view(scene.camera, scene.size_px);
    view_.eye_mm -= origin_mm_;
    for (const ClipPlane& plane : scene.clip_planes)
        clips_.push_back({plane.point_mm - origin_mm_, plane.normal});
    if (data.labels) {
        const glm::dmat4& world_from_label = data.labels->grid().world_from_index;
        label_from_local_ = glm::inverse(glm::dmat3(world_from_label));
        label_offset_ = label_from_local_ * (origin_mm_ - glm::dvec3(world_from_label[3]));
    }
}

LocalRay Rays::through(glm::dvec2 pixel) const {
    const Ray ray = ray_through(view_, pixel, size_px_);
    return {ray.origin_mm, ray.direction, index_from_local_ * ray.origin_mm,
            index_from_local_ * ray.direction};
}

Stretch Rays::inside(const LocalRay& ray) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Stretch t{0.0, kInfinity};
    for (int axis = 0; axis < 3; ++axis) {
        const double origin = ray.origin[axis], step = ray.step[axis];
        if (step == 0.0) { // parallel to the faces: inside for ever or never, and no division
            if (!(origin >= 0.0 && origin <= last_[axis]))
                return {};
            continue;
        }
        const double a = -origin / step, b = (last_[axis] - origin) / step;
        t.from = std::max(t.from, std::min(a, b));
        t.to = std::min(t.to, std::max(a, b));
    }
    for (const HalfSpace& clip : clips_) {
        const double at_start = glm::dot(clip.normal, ray.origin_mm - clip.point_mm);
        const double rate = glm::dot(clip.normal, ray.direction);
        if (rate > 0.0 && -at_start / rate > t.from) {
            t.from = -at_start / rate;
            t.cut = rate / glm::length(clip.normal);
            t.cut_normal = clip.normal;
        } else if (rate > 0.0)
            continue;
        else if (rate < 0.0)
            t.to = std::min(t.to, -at_start / rate);
        else if (at_start < 0.0)
            return {};
    }
    return t;
}

} // namespace palpate::reference
