#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>
#include <span>

#include "engine/reference/march.h"
#include "engine/reference/slices.h"
#include "engine/reference/surfaces.h"
#include "engine/reference/twin.h"

namespace palpate::reference {

// The common part of twin and truth: one eye's pixels, ray by ray; slices, meshes and ray casting
// put together.
//
// `make_marcher(rays, sampler)` makes, once per row, what turns a ray and a stretch into a Marched;
// `slice_color` is the colour of a slice's value. All references must outlive the picture.
template <class MakeMarcher>
class Picture {
 public:
    Picture(const Scene& scene, const SceneData& data, int eye, MakeMarcher make_marcher,
            std::function<glm::dvec3(double)> slice_color)
        : scene_(scene),
          data_(data),
          eye_(eye),
          rays_(scene, data, eye),
          surfaces_(scene, data, rays_),
          make_marcher_(std::move(make_marcher)),
          slice_color_(std::move(slice_color)) {}

    PixelSample pixel(glm::dvec2 at) const {
        PixelSample sample;
        trace(
            1, [&](uint32_t) { return at; }, [&](uint32_t, PixelSample s) { sample = s; });
        return sample;
    }

    // Threaded by pixels.
    std::vector<PixelSample> pixels(std::span<const glm::uvec2> places) const {
        std::vector<PixelSample> samples(places.size());
        tbb::parallel_for(tbb::blocked_range<size_t>(0, places.size()),
                          [&](const tbb::blocked_range<size_t>& range) {
                              trace(
                                  static_cast<uint32_t>(range.size()),
                                  [&](uint32_t i) { return glm::dvec2(places[range.begin() + i]); },
                                  [&](uint32_t i, const PixelSample& sample) {
                                      samples[range.begin() + i] = sample;
                                  });
                          });
        return samples;
    }

    // Threaded by rows; rows do not depend on each other, so neither do the bits on the threads.
    Image image(PixelStride pixels) const {
        std::vector<std::string> channels{"R", "G", "B", "A"};
        if (scene_.value_and_depth)
            channels.insert(channels.end(), {"value", "depth"});
        Image image = make_image(pixels.size(scene_.size_px), channels);
        const auto draw_row = [&](uint32_t y) {
            trace(
                image.size_px.x,
                [&](uint32_t x) {
                    return glm::dvec2(pixels.offset + pixels.step * glm::uvec2(x, y));
                },
                [&](uint32_t x, const PixelSample& sample) {
                    for (int c = 0; c < 4; ++c)
                        image.at(x, y, c) = static_cast<float>(sample.rgba[c]);
                    if (scene_.value_and_depth) {
                        image.at(x, y, 4) = static_cast<float>(sample.value);
                        image.at(x, y, 5) = static_cast<float>(sample.depth);
                    }
                });
        };
        tbb::parallel_for(tbb::blocked_range<uint32_t>(0, image.size_px.y),
                          [&](const tbb::blocked_range<uint32_t>& rows) {
                              for (uint32_t y = rows.begin(); y != rows.end(); ++y)
                                  draw_row(y);
                          });
        return image;
    }

 private:
    // Pixels pixel_at(0) .. pixel_at(count - 1), each handed to put(i, sample).
    template <class PixelAt, class Put>
    void trace(uint32_t count, const PixelAt& pixel_at, const Put& put) const {
        Sampler sampler(scene_, data_, rays_);
        Slices slices(scene_, data_, rays_, sampler, slice_color_);
        auto march = make_marcher_(rays_, sampler);
        for (uint32_t i = 0; i < count; ++i) {
            const glm::dvec2 pixel = pixel_at(i);
            const LocalRay ray = rays_.through(pixel);
            const std::optional<SliceHit> slice = slices.hit(ray, pixel);
            const SurfaceHits met = surfaces_.along(ray);
            const bool meets_mesh = met.opaque && (!slice || met.opaque->t <= slice->t);
            const double end = meets_mesh ? met.opaque->t
                               : slice    ? slice->t
                                          : std::numeric_limits<double>::infinity();
            Stretch t = rays_.inside(ray);
            t.to = std::min(t.to, end);
            Marched seen;
            double from = t.from;
            // Marches on to a distance, from where the last march has ended.
            const auto march_to = [&](double to) {
                const Stretch part{from, std::min(to, t.to), from == t.from ? t.cut : 0.0,
                                   t.cut_normal};
                from = std::max(from, to);
                if (scene_.ray_cast && !part.empty() && seen.transmittance > 0.0)
                    seen.then(marched(sampler, march, ray, part, jitter_mm(pixel)));
            };
            for (const SurfaceHit& layer : met.see_through)
                if (layer.t < end) {
                    march_to(layer.t);
                    seen.then(layer.marched());
                }
            march_to(t.to);
            const bool stops = meets_mesh || slice;
            const glm::dvec3 behind = meets_mesh ? met.opaque->color
                                      : slice    ? slice->color
                                                 : scene_.background;
            PixelSample sample{glm::dvec4(seen.color + seen.transmittance * behind,
                                          stops ? 1.0 : 1.0 - seen.transmittance),
                               seen.value, seen.depth};
            if (stops && std::isnan(seen.value) && (meets_mesh || !scene_.ray_cast))
                sample.value = meets_mesh ? met.opaque->value : slice->value;
            if (stops && std::isnan(seen.depth))
                sample.depth = end;
            put(i, sample);
        }
    }

    // One stretch of a ray, with its cap. Distances are counted from where the lattice begins,
    // `before` millimetres before the ray's start.
    template <class March>
    Marched marched(Sampler& sampler, March& march, const LocalRay& ray, Stretch t,
                    double before) const {
        const LocalRay moved{ray.origin_mm - before * ray.direction, ray.direction,
                             ray.origin - before * ray.step, ray.step};
        t = {t.from + before, t.to + before, t.cut, t.cut_normal};
        Marched seen = cap(sampler, moved, t);
        if (seen.transmittance > 0.0)
            seen.then(march(moved, t));
        seen.depth -= before;
        return seen;
    }

    double jitter_mm(glm::dvec2 pixel) const {
        if (!scene_.ray_cast)
            return 0.0;
        const RayCastLayer& layer = *scene_.ray_cast;
        if (!layer.jitter_seed || layer.integrator == Integrator::exact)
            return 0.0;
        return jitter_share(*layer.jitter_seed, glm::uvec2(pixel), static_cast<uint32_t>(eye_)) *
               step_mm_of(layer, data_.volume.grid());
    }

    // If a clip plane cuts into the inside of an iso-surface, a cap closes the cut: in the colour
    // of the innermost surface about it, and lit by the plane's normal.
    Marched cap(Sampler& sampler, const LocalRay& ray, Stretch t) const {
        const RayCastLayer& layer = *scene_.ray_cast;
        Marched seen;
        if (layer.mode != RayMode::iso || t.cut == 0.0)
            return seen;
        const size_t level = level_of(layer.isos, sampler.value(ray, t.from));
        const Tint tint = sampler.tint(ray, t.from);
        if (level == 0 || !tint.visible)
            return seen;
        const IsoSurface& surface = layer.isos[level - 1];
        const glm::dvec3 color = glm::mix(surface.color, tint.color, tint.weight);
        seen.add(sampler.lit_cut(layer.shading.value_or(Shading{}), color, ray, t),
                 surface.opacity);
        seen.value = surface.value;
        seen.depth = t.from;
        return seen;
    }

    const Scene& scene_;
    const SceneData& data_;
    int eye_;
    Rays rays_;
    Surfaces surfaces_;
    MakeMarcher make_marcher_;
    std::function<glm::dvec3(double)> slice_color_;
};

} // namespace palpate::reference
