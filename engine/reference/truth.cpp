#include "engine/reference/truth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/reference/cubic.h"
#include "engine/reference/picture.h"
#include "engine/reference/quadrature.h"
#include "engine/scene/least_value.h"
#include "engine/volume/thickness.h"

namespace palpate {

using namespace reference;

namespace {

// One cell's part of a ray: u = 0 at `from`, 1 at `to`, both in mm.
struct CellPiece {
    double from, to;
    Cubic value;
    bool has_data;
    Tint tint;

    double t(double u) const { return from + u * (to - from); }
};

class TruthMarcher {
 public:
    TruthMarcher(const RayCastLayer& layer, const Volume& volume, const Rays& rays,
                 Sampler& sampler)
        : layer_(layer), volume_(volume), rays_(rays), sampler_(sampler) {
        if (!layer.transfer.colors.empty())
            knots_ = knots(layer.transfer);
    }

    Marched operator()(const LocalRay& ray, Stretch t) {
        switch (layer_.mode) {
            case RayMode::mip:
                return mip(ray, t);
            case RayMode::iso:
                return iso(ray, t);
            case RayMode::alpha:
                break;
        }
        return alpha(ray, t);
    }

 private:
    // Distances at which `origin + t * step` passes first + i, for whole i, within the stretch.
    void add_cuts(double origin, double step, double first, Stretch t) {
        if (step == 0.0)
            return;
        const double a = origin + t.from * step - first, b = origin + t.to * step - first;
        for (double i = std::ceil(std::min(a, b)); i <= std::floor(std::max(a, b)); i += 1.0)
            cuts_.push_back(std::clamp((first + i - origin) / step, t.from, t.to));
    }

    // Calls visit(piece) from front to back until it returns false. Pieces end at cell faces and,
    // where there are labels, at the faces of label voxels.
    template <class Visit>
    void for_each_piece(const LocalRay& ray, Stretch t, Visit&& visit) {
        cuts_.assign({t.from, t.to});
        for (int axis = 0; axis < 3; ++axis)
            add_cuts(ray.origin[axis], ray.step[axis], 0.0, t);
        if (sampler_.has_labels()) {
            const glm::dvec3 origin = rays_.label_index(ray.origin_mm);
            const glm::dvec3 step = rays_.label_step(ray.direction);
            for (int axis = 0; axis < 3; ++axis)
                add_cuts(origin[axis], step[axis], 0.5, t);
        }
        std::sort(cuts_.begin(), cuts_.end());
        const glm::dvec3 last_cell = glm::max(rays_.last() - 1.0, glm::dvec3(0.0));
        for (size_t i = 0; i + 1 < cuts_.size(); ++i) {
            CellPiece piece{cuts_[i], cuts_[i + 1], {}, false, {}};
            if (!(piece.from < piece.to))
                continue;
            const double middle = piece.t(0.5);
            const glm::dvec3 low = glm::min(glm::floor(rays_.index_at(ray, middle)), last_cell);
            const auto corners = cell_corners(volume_, glm::uvec3(low));
            const auto in_cell = [&](double at) {
                return glm::clamp(rays_.index_at(ray, at) - low, glm::dvec3(0.0), glm::dvec3(1.0));
            };
            piece.value = cell_cubic(corners, in_cell(piece.from), in_cell(piece.to));
            piece.has_data = std::none_of(corners.begin(), corners.end(),
                                          [](float corner) { return std::isnan(corner); });
            piece.tint = sampler_.tint(ray, middle);
            if (!visit(piece))
                return;
        }
    }

    Marched alpha(const LocalRay& ray, Stretch t) {
        const double tolerance = layer_.shading ? 1e-9 : 1e-13;
        const int halvings = layer_.shading ? 8 : 12;
        Marched result;
        double depth = 0.0;
        for_each_piece(ray, t, [&](const CellPiece& piece) {
            if (!piece.has_data || !piece.tint.visible)
                return true;
            const auto sample = [&](double at) {
                const double value = piece.value((at - piece.from) / (piece.to - piece.from));
                glm::dvec3 color =
                    glm::mix(color_at(layer_.transfer, value), piece.tint.color, piece.tint.weight);
                if (layer_.shading)
                    color = sampler_.lit_at(*layer_.shading, color, ray, at);
                return glm::dvec4(color, tau_per_mm_at(layer_.transfer, value));
            };
            // Smooth between turning points of the cubic and its crossings of knots.
            const MonotonePieces monotone = monotone_pieces(piece.value);
            for (int m = 0; m < monotone.count; ++m) {
                const double a = monotone.ends[m], b = monotone.ends[m + 1];
                for_each_smooth(piece.value, a, b, [&](double from, double to) {
                    if (is_clear(piece.value(0.5 * (from + to))))
                        return;
                    const Emission seen =
                        integrate(sample, piece.t(from), piece.t(to), tolerance, halvings);
                    result.color += std::exp(-depth) * seen.color;
                    depth += seen.depth;
                });
            }
            return depth < 45.0; // less than 3e-20 comes through
        });
        result.transmittance = std::exp(-depth);
        return result;
    }

    // The parts of the monotone piece [a, b] between neighbouring knots.
    template <class Visit>
    void for_each_smooth(const Cubic& cubic, double a, double b, Visit&& visit) const {
        const double at_a = cubic(a), at_b = cubic(b);
        const auto first = std::upper_bound(knots_.begin(), knots_.end(), std::min(at_a, at_b));
        const auto last = std::lower_bound(first, knots_.end(), std::max(at_a, at_b));
        double from = a;
        const auto step_to = [&](double to) {
            if (from < to)
                visit(from, to);
            from = std::max(from, to);
        };
        if (at_a < at_b)
            for (auto knot = first; knot != last; ++knot)
                step_to(root_between(cubic, *knot, a, b));
        else
            for (auto knot = last; knot != first; --knot)
                step_to(root_between(cubic, *(knot - 1), a, b));
        step_to(b);
    }

    // No opacity anywhere between the knots round this value.
    bool is_clear(double value) const {
        const auto above = std::upper_bound(knots_.begin(), knots_.end(), value);
        if (opacity_at(layer_.transfer, value) > 0.0)
            return false;
        if (above == knots_.begin() || above == knots_.end())
            return true;
        return opacity_at(layer_.transfer, 0.5 * (*above + *(above - 1))) == 0.0;
    }

    Marched mip(const LocalRay& ray, Stretch t) {
        const double sign = shows_least_value(layer_.transfer) ? -1.0 : 1.0;
        double maximum = -std::numeric_limits<double>::infinity(); // of sign * value
        for_each_piece(ray, t, [&](const CellPiece& piece) {
            if (piece.has_data && piece.tint.visible) {
                const MonotonePieces monotone = monotone_pieces(piece.value);
                for (int m = 0; m <= monotone.count; ++m)
                    maximum = std::max(maximum, sign * piece.value(monotone.ends[m]));
            }
            return true;
        });
        Marched result;
        if (std::isinf(maximum))
            return result;
        result.value = sign * maximum;
        const double depth =
            tau_per_mm_at(layer_.transfer, result.value) * layer_.transfer.opacity_unit_mm;
        result.add(color_at(layer_.transfer, result.value), -std::expm1(-depth));
        return result;
    }

    Marched iso(const LocalRay& ray, Stretch t) {
        const Shading shading = layer_.shading.value_or(Shading{});
        Marched result;
        constexpr size_t kUnknown = ~size_t{0}; // at the start and behind missing data
        size_t level = kUnknown;
        for_each_piece(ray, t, [&](const CellPiece& piece) {
            if (!piece.has_data) {
                level = kUnknown;
                return true;
            }
            if (level == kUnknown)
                level = level_of(layer_.isos, piece.value(0.0));
            const MonotonePieces monotone = monotone_pieces(piece.value);
            for (int m = 0; m < monotone.count; ++m) {
                const double a = monotone.ends[m], b = monotone.ends[m + 1];
                // The level is carried from piece to piece, so that a surface on a cell's face is
                // met once.
                const size_t level_now = level_of(layer_.isos, piece.value(b));
                while (level != level_now) {
                    const bool rising = level_now > level;
                    const IsoSurface& surface = layer_.isos[rising ? level : level - 1];
                    const double hit = piece.t(root_between(piece.value, surface.value, a, b));
                    level = rising ? level + 1 : level - 1;
                    if (!piece.tint.visible)
                        continue;
                    const glm::dvec3 color =
                        glm::mix(surface.color, piece.tint.color, piece.tint.weight);
                    result.add(sampler_.lit_surface(shading, color, ray, hit, surface.value),
                               surface.opacity);
                    if (std::isnan(result.depth)) {
                        result.depth = hit;
                        result.value = surface.value;
                    }
                }
            }
            return result.transmittance > 0.0;
        });
        return result;
    }

    const RayCastLayer& layer_;
    const Volume& volume_;
    const Rays& rays_;
    Sampler& sampler_;
    std::vector<double> knots_;
    std::vector<double> cuts_;
};

// Calls use(picture) with the true picture of a scene.
template <class Use>
auto with_picture(const Scene& scene, SceneData data, int eye, const Use& use) {
    data.volume = thickened(data.volume);
    const RayCastLayer layer = scene.ray_cast.value_or(RayCastLayer{});
    const auto make_marcher = [&](const Rays& rays, Sampler& sampler) {
        return TruthMarcher(layer, data.volume, rays, sampler);
    };
    const auto slice_color = [&](double value) { return color_at(scene.slice_transfer, value); };
    return use(Picture(scene, data, eye, make_marcher, slice_color));
}

} // namespace

Image render_truth(const Scene& scene, const SceneData& data, int eye, PixelStride pixels) {
    return with_picture(scene, data, eye,
                        [&](const auto& picture) { return picture.image(pixels); });
}

std::vector<PixelSample> truth_pixels(const Scene& scene, const SceneData& data,
                                      std::span<const glm::uvec2> pixels) {
    return with_picture(scene, data, 0,
                        [&](const auto& picture) { return picture.pixels(pixels); });
}

PixelSample truth_pixel(const Scene& scene, const SceneData& data, glm::dvec2 pixel, int eye) {
    return with_picture(scene, data, eye,
                        [&](const auto& picture) { return picture.pixel(pixel); });
}

} // namespace palpate
