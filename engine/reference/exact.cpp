#include "engine/reference/exact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/reference/table_span.h"
#include "engine/scene/least_value.h"

namespace palpate::reference {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// The faces a ray passes on one axis: whole numbers in index space.
struct Faces {
    double origin, step; // position at distance t: origin + t * step
    double next;         // number of the next face

    double at(double face) const { return (face - origin) / step; }
    double next_at() const { return step == 0.0 ? kNever : at(next); }
    void advance() { next += step < 0.0 ? -1.0 : 1.0; }
    // The first face beyond distance t, whatever rounding says of the place at t.
    void seek(double t) {
        if (step == 0.0)
            return;
        const double way = step < 0.0 ? -1.0 : 1.0;
        const double place = origin + t * step;
        next = step < 0.0 ? std::ceil(place) - 1.0 : std::floor(place) + 1.0;
        if (at(next) <= t)
            next += way;
        else if (at(next - way) > t)
            next -= way;
    }
    // The cell between the last face and the next one.
    double cell() const {
        return step == 0.0 ? std::floor(origin) : step < 0.0 ? next : next - 1.0;
    }
};

} // namespace

struct ExactMarcher::Piece {
    double from, to;
    Cubic value; // u = 0 at `from`, 1 at `to`
    Tint tint;

    double t(double u) const { return from + u * (to - from); }
};

ExactMarcher::ExactMarcher(const RayCastLayer& layer, const TransferTable& table,
                           const Volume& volume, const Rays& rays, Sampler& sampler)
    : layer_(layer),
      table_(table),
      volume_(volume),
      rays_(rays),
      sampler_(sampler),
      detail_(sub_step_detail(layer.transfer)) {}

// Calls visit(piece) from front to back until it returns false; visit(nullptr) stands for a piece
// without data.
template <class Visit>
void ExactMarcher::for_each_piece(const LocalRay& ray, Stretch t, Visit&& visit) {
    std::array<Faces, 6> faces;
    const int axes = sampler_.has_labels() ? 6 : 3;
    for (int axis = 0; axis < 3; ++axis)
        faces[axis] = {ray.origin[axis], ray.step[axis], 0.0};
    if (axes == 6) {
        // Label voxels are centred at whole numbers.
        const glm::dvec3 origin = rays_.label_index(ray.origin_mm) + 0.5;
        const glm::dvec3 step = rays_.label_step(ray.direction);
        for (int axis = 0; axis < 3; ++axis)
            faces[3 + axis] = {origin[axis], step[axis], 0.0};
    }
    for (int i = 0; i < axes; ++i)
        faces[i].seek(t.from);
    const glm::dvec3 last_cell = glm::max(rays_.last() - 1.0, glm::dvec3(0.0));
    for (double from = t.from; from < t.to;) {
        double to = t.to;
        for (int i = 0; i < axes; ++i)
            to = std::min(to, faces[i].next_at());
        if (from < to) {
            const glm::dvec3 low =
                glm::clamp(glm::dvec3(faces[0].cell(), faces[1].cell(), faces[2].cell()),
                           glm::dvec3(0.0), last_cell);
            const auto corners = cell_corners(volume_, glm::uvec3(low));
            const auto in_cell = [&](double at) {
                return glm::clamp(ray.origin + at * ray.step - low, glm::dvec3(0.0),
                                  glm::dvec3(1.0));
            };
            const Piece piece{from, to, cell_cubic(corners, in_cell(from), in_cell(to)),
                              sampler_.tint(ray, 0.5 * (from + to))};
            const bool has_data = std::none_of(corners.begin(), corners.end(),
                                               [](float corner) { return std::isnan(corner); });
            if (!visit(has_data ? &piece : nullptr))
                return;
        }
        for (int i = 0; i < axes; ++i)
            if (faces[i].next_at() <= to)
                faces[i].advance();
        from = to;
    }
}

Marched ExactMarcher::march(const LocalRay& ray, Stretch t) {
    switch (layer_.mode) {
        case RayMode::mip:
            return march_mip(ray, t);
        case RayMode::iso:
            return march_iso(ray, t);
        case RayMode::alpha:
            break;
    }
    return march_alpha(ray, t);
}

// As many as leave each piece within detail / sub_steps^2 of a straight line, but no more than
// sub_steps: a chord leaves a curve by its second derivative over 8 n^2. Where there is shading,
// which turns within a cell however straight the values are, no fewer than a quarter of sub_steps.
double ExactMarcher::pieces_of(const Cubic& cubic) const {
    const double bend =
        std::max(std::abs(2.0 * cubic.c[2]), std::abs(2.0 * cubic.c[2] + 6.0 * cubic.c[3])) / 8.0;
    const double most = layer_.sub_steps;
    const double least = layer_.shading ? std::ceil(0.25 * most) : 1.0;
    return std::clamp(std::ceil(most * std::sqrt(bend / detail_)), least, most);
}

Marched ExactMarcher::march_alpha(const LocalRay& ray, Stretch t) {
    Marched result;
    const double tolerance = span_tolerance(layer_.sub_steps);
    const double least = std::max(layer_.min_transmittance, kLeastTransmittance);
    for_each_piece(ray, t, [&](const Piece* piece) {
        if (!piece || !piece->tint.visible)
            return true;
        const Cubic& value = piece->value;
        const double n = pieces_of(value);
        const double length_mm = piece->to - piece->from;
        // Sub-step [i, i + width] of n, halved where its error is too large.
        double i = 0.0, width = 1.0;
        TablePoint before = table_point(table_, value(0.0));
        while (i < n && result.transmittance > least) {
            const double next = std::min(i + width, n);
            const TablePoint now = table_point(table_, value(next / n));
            const double share = (next - i) / n;
            const double middle = i / n + 0.5 * share;
            const double bend =
                (2.0 * value.c[2] + 6.0 * value.c[3] * middle) * -0.125 * share * share;
            const TableSpan span =
                table_span(before, now, bend * entries_per_value(table_), length_mm * share);
            const double error = result.transmittance * span.error;
            if (error > tolerance && width > kLeastSpan) {
                width *= error > 8.0 * tolerance ? 0.25 : 0.5;
                continue;
            }
            glm::dvec3 color = glm::mix(span.color, piece->tint.color, piece->tint.weight);
            if (layer_.shading && span.opacity > 0.0)
                color = sampler_.lit_at(*layer_.shading, color, ray,
                                        piece->t(i / n + share * span.seen_at));
            result.add(color, span.opacity);
            if (error < tolerance / 16.0)
                width = std::min(2.0 * width, 1.0);
            i = next;
            before = now;
        }
        return result.transmittance >= layer_.min_transmittance;
    });
    return result;
}

Marched ExactMarcher::march_mip(const LocalRay& ray, Stretch t) {
    const double sign = shows_least_value(layer_.transfer) ? -1.0 : 1.0;
    double maximum = -std::numeric_limits<double>::infinity(); // of sign * value
    for_each_piece(ray, t, [&](const Piece* piece) {
        if (piece && piece->tint.visible) {
            const MonotonePieces monotone = monotone_pieces(piece->value);
            for (int m = 0; m <= monotone.count; ++m)
                maximum = std::max(maximum, sign * piece->value(monotone.ends[m]));
        }
        return true;
    });
    Marched result;
    if (std::isinf(maximum))
        return result;
    result.value = sign * maximum;
    const glm::dvec4 entry = nearest_entry(table_, result.value);
    result.add(glm::dvec3(entry), -std::expm1(-entry.w * layer_.transfer.opacity_unit_mm));
    return result;
}

Marched ExactMarcher::march_iso(const LocalRay& ray, Stretch t) {
    const Shading shading = layer_.shading.value_or(Shading{});
    Marched result;
    constexpr size_t kUnknown = ~size_t{0}; // at the start and behind missing data
    size_t level = kUnknown;
    for_each_piece(ray, t, [&](const Piece* piece) {
        if (!piece) {
            level = kUnknown;
            return true;
        }
        if (level == kUnknown)
            level = level_of(layer_.isos, piece->value(0.0));
        const MonotonePieces monotone = monotone_pieces(piece->value);
        for (int m = 0; m < monotone.count; ++m) {
            const double a = monotone.ends[m], b = monotone.ends[m + 1];
            // Carried from piece to piece, so that a surface on a cell's face is met once.
            const size_t level_now = level_of(layer_.isos, piece->value(b));
            while (level != level_now) {
                const bool rising = level_now > level;
                const IsoSurface& surface = layer_.isos[rising ? level : level - 1];
                level = rising ? level + 1 : level - 1;
                if (!piece->tint.visible)
                    continue;
                const double hit = piece->t(root_between(piece->value, surface.value, a, b));
                result.add(
                    sampler_.lit_surface(
                        shading, glm::mix(surface.color, piece->tint.color, piece->tint.weight),
                        ray, hit, surface.value),
                    surface.opacity);
                if (std::isnan(result.depth)) {
                    result.depth = hit;
                    result.value = surface.value;
                }
                if (result.transmittance < layer_.min_transmittance)
                    return false;
            }
        }
        return true;
    });
    return result;
}

} // namespace palpate::reference
