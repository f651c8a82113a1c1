#include "engine/reference/march.h"

#include <cmath>
#include <limits>

#include "engine/scene/least_value.h"

namespace palpate::reference {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Position in the table: 0 .. 1 from its first to its last entry.
double table_position(const TransferTable& table, double value) {
    return (value - table.low) / (table.high - table.low);
}

glm::dvec4 entry_at(const TransferTable& table, double x) {
    const double last = static_cast<double>(table.entries.size() - 1);
    const double i = std::floor(std::clamp(x, 0.0, 1.0) * last + 0.5);
    return glm::dvec4(table.entries[static_cast<size_t>(i)]);
}

// The running integral over x of (color * tau, tau), linear between entries; beyond the table it
// goes on with the end entry.
glm::dvec4 integral_at(const TransferTable& table, double x) {
    const double last = static_cast<double>(table.entries.size() - 1);
    const double inside = std::clamp(x, 0.0, 1.0);
    const double low = std::min(std::floor(inside * last), last - 1.0);
    const size_t i = static_cast<size_t>(low);
    const glm::dvec4 integral = glm::mix(glm::dvec4(table.integrals[i]),
                                         glm::dvec4(table.integrals[i + 1]), inside * last - low);
    const glm::dvec4 end = entry_at(table, x);
    return integral + (x - inside) * glm::dvec4(glm::dvec3(end) * end.w, end.w);
}

} // namespace

Marched::Marched() : value(kNaN), depth(kNaN) {}

void Marched::then(const Marched& behind) {
    color += transmittance * behind.color;
    transmittance *= behind.transmittance;
    value = std::isnan(value) ? behind.value : value;
    depth = std::isnan(depth) ? behind.depth : depth;
}

size_t level_of(const std::vector<IsoSurface>& isos, double value) {
    size_t level = 0;
    while (level < isos.size() && isos[level].value <= value)
        ++level;
    return level;
}

glm::dvec4 nearest_entry(const TransferTable& table, double value) {
    return entry_at(table, table_position(table, value));
}

glm::dvec4 mean_entry(const TransferTable& table, double a, double b) {
    const double from = table_position(table, a), to = table_position(table, b);
    if (std::abs(to - from) * static_cast<double>(table.entries.size() - 1) < 1.0)
        return entry_at(table, 0.5 * (from + to));
    const glm::dvec4 mean =
        (integral_at(table, to) - integral_at(table, from)) / (to - from); // (color * tau, tau)
    return mean.w > 0.0 ? glm::dvec4(glm::dvec3(mean) / mean.w, mean.w) : glm::dvec4(0.0);
}

Marcher::Marcher(const RayCastLayer& layer, const TransferTable& table, double step_mm,
                 Sampler& sampler)
    : layer_(layer), table_(table), step_mm_(step_mm), sampler_(sampler) {}

template <class Visit>
void Marcher::for_each_segment(Stretch t, Visit&& visit) const {
    const double first = std::floor(t.from / step_mm_);
    const double last = std::ceil(t.to / step_mm_) - 1.0;
    for (double k = first; k <= last; k += 1.0) {
        const double from = std::max(k * step_mm_, t.from);
        const double to = std::min((k + 1.0) * step_mm_, t.to);
        if (from < to && !visit(Segment{from, to, 0.5 * (from + to)}))
            return;
    }
}

Marched Marcher::march(const LocalRay& ray, Stretch t) {
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

glm::dvec4 Marcher::mean_of(const LocalRay& ray, const Segment& segment) {
    if (layer_.integrator == Integrator::fast) {
        const double value = sampler_.value(ray, segment.middle);
        return std::isnan(value) ? glm::dvec4(0.0) : nearest_entry(table_, value);
    }
    const double a = sampler_.value(ray, segment.from), b = sampler_.value(ray, segment.to);
    return std::isnan(a) || std::isnan(b) ? glm::dvec4(0.0) : mean_entry(table_, a, b);
}

Marched Marcher::march_alpha(const LocalRay& ray, Stretch t) {
    Marched result;
    for_each_segment(t, [&](const Segment& segment) {
        const glm::dvec4 mean = mean_of(ray, segment);
        const double depth = mean.w * segment.length();
        if (!(depth > 0.0))
            return true;
        const Tint tint = sampler_.tint(ray, segment.middle);
        if (!tint.visible)
            return true;
        glm::dvec3 color = glm::mix(glm::dvec3(mean), tint.color, tint.weight);
        if (layer_.shading)
            color = sampler_.lit_at(*layer_.shading, color, ray, segment.middle);
        result.color += result.transmittance * -std::expm1(-depth) * color;
        result.transmittance *= std::exp(-depth);
        return result.transmittance >= layer_.min_transmittance;
    });
    return result;
}

Marched Marcher::march_mip(const LocalRay& ray, Stretch t) {
    const double sign = shows_least_value(layer_.transfer) ? -1.0 : 1.0;
    double maximum = -std::numeric_limits<double>::infinity(); // of sign * value
    for_each_segment(t, [&](const Segment& segment) {
        const double value = sign * sampler_.value(ray, segment.middle);
        if (value > maximum && sampler_.tint(ray, segment.middle).visible) // false for no-data
            maximum = value;
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

// Finds the place where the value is `iso` between two samples (t, value), by false position.
double Marcher::crossing(const LocalRay& ray, glm::dvec2 a, glm::dvec2 b, double iso) {
    a.y -= iso;
    b.y -= iso;
    const auto guess = [&] { return a.x - a.y * (b.x - a.x) / (b.y - a.y); };
    for (int i = 0; i < 4; ++i) {
        const glm::dvec2 m(guess(), sampler_.value(ray, guess()) - iso);
        if (std::isnan(m.y)) // a gap in the data: no better place is known
            return m.x;
        ((m.y >= 0.0) == (a.y >= 0.0) ? a : b) = m;
    }
    return guess();
}

Marched Marcher::march_iso(const LocalRay& ray, Stretch t) {
    const Shading shading = layer_.shading.value_or(Shading{});
    Marched result;
    glm::dvec2 before(t.from, sampler_.value(ray, t.from));
    size_t level = level_of(layer_.isos, before.y);
    // Takes the next sample; false when the ray is opaque.
    const auto advance = [&](double at) {
        const glm::dvec2 now(at, sampler_.value(ray, at));
        if (std::isnan(now.y) || std::isnan(before.y)) { // nothing crosses beside missing data
            level = level_of(layer_.isos, now.y);
            before = now;
            return true;
        }
        const size_t level_now = level_of(layer_.isos, now.y);
        while (level != level_now) {
            const bool rising = level_now > level;
            const IsoSurface& iso = layer_.isos[rising ? level : level - 1];
            const double hit = crossing(ray, before, now, iso.value);
            const Tint tint = sampler_.tint(ray, hit);
            if (tint.visible) {
                const glm::dvec3 color = glm::mix(iso.color, tint.color, tint.weight);
                result.add(sampler_.lit_surface(shading, color, ray, hit, iso.value), iso.opacity);
                if (std::isnan(result.depth)) {
                    result.depth = hit;
                    result.value = iso.value;
                }
                if (result.transmittance < layer_.min_transmittance)
                    return false;
            }
            level = rising ? level + 1 : level - 1;
            before = {hit, iso.value};
        }
        before = now;
        return true;
    };
    // After the start: the middle of each segment of the lattice that lies within, then the end.
    bool open = true;
    for (double k = std::floor(t.from / step_mm_ - 0.5); open; k += 1.0) {
        const double middle = (k + 0.5) * step_mm_;
        if (middle >= t.to)
            break;
        if (middle > t.from)
            open = advance(middle);
    }
    if (open)
        advance(t.to);
    return result;
}

} // namespace palpate::reference
