#include "haptics/papers/papers.h"

#include <algorithm>

#include "engine/volume/extent.h"
#include "haptics/field/coupling.h"
#include "haptics/field/samples.h"
#include "haptics/field/sphere_samples.h"

namespace palpate::haptics {

double unilateral(double d, double yield_mm) {
    return d > 0.0 ? d : -std::max(std::abs(d) - yield_mm, 0.0);
}
double unilateral_as_printed(double d, double yield_mm) {
    return d > 0.0 ? d : std::max(std::abs(d) - yield_mm, 0.0);
}
double bilateral(double d, double yield_mm) {
    return std::copysign(std::max(std::abs(d) - yield_mm, 0.0), d);
}
double directed(double d, double pull_mm) {
    return pull_mm + d;
}

namespace {

using glm::dvec3;

// The felt volume, and how grey values or labels say "solid" in these papers.
struct Source {
    const Volume* volume;
    double iso;
};
Source source_of(const TickInput& input) {
    const TouchParameters& parameters = *input.parameters;
    const bool labels = parameters.source == TouchSource::labels;
    const std::optional<Volume>& volume = labels ? input.scene->labels : input.scene->grey;
    return {volume ? &*volume : nullptr, labels ? 0.5 : parameters.iso};
}

// Value and gradient of the trilinear interpolant; free and flat where there is no data.
double value_at(const Source& source, const glm::dmat4& index_from_world_mm, dvec3 mm) {
    const double v =
        resident_trilinear(*source.volume, dvec3(index_from_world_mm * glm::dvec4(mm, 1.0)));
    return v == v ? v : -INFINITY;
}
dvec3 gradient_at(const Source& source, const glm::dmat4& index_from_world_mm, dvec3 mm) {
    const dvec3 g =
        resident_gradient(*source.volume, dvec3(index_from_world_mm * glm::dvec4(mm, 1.0)));
    return is_finite(g) ? glm::transpose(glm::dmat3(index_from_world_mm)) * g : dvec3(0.0);
}

TickOutput output_of(const TickInput& input, dvec3 proxy, dvec3 last_proxy, dvec3 normal) {
    const TouchParameters& p = *input.parameters;
    TickOutput output;
    output.proxy = input.tool;
    output.proxy.position_mm = proxy;
    output.normal = normal;
    output.depth_mm = glm::distance(proxy, input.tool.position_mm);
    output.force_n = coupling_n(p.stiffness_n_per_m, p.damping_n_s_per_m, input.tool.position_mm,
                                proxy, input.velocity_mm_per_s, (proxy - last_proxy) / input.dt_s);
    return output;
}

// How far the coupling's spring gives under a force: no farther than 10 m, for the prints divide by
// a stiffness that may be 0.
double give_mm(double force_n, const TouchParameters& parameters) {
    constexpr double kMost_mm = 1e4;
    const double k = 1e-3 * parameters.stiffness_n_per_m; // N/mm
    if (force_n == 0.0)
        return 0.0;
    return std::abs(force_n) < kMost_mm * k ? force_n / k : std::copysign(kMost_mm, force_n);
}

// ---- Vidholm & Agmund 2004 ------------------------------------------------------------------

class Vidholm2004 final : public Algorithm {
 public:
    void reset(const TickInput& input) noexcept override {
        has_proxy_ = is_place(input.tool.position_mm);
        proxy_ = has_proxy_ ? input.tool.position_mm : dvec3(0.0);
    }

    TickOutput tick(const TickInput& input) noexcept override {
        const Source source = source_of(input);
        if (!is_sane(input) || !source.volume)
            return unknown_output(proxy_);
        const TouchParameters& parameters = *input.parameters;
        const dvec3 x = input.tool.position_mm;
        if (!has_proxy_)
            proxy_ = x;
        has_proxy_ = true;
        const dvec3 last = proxy_, d = x - proxy_;
        const glm::dmat4 to_index = index_from_world(source.volume->grid());

        dvec3 sum(0.0);
        uint32_t touching = 0;
        for (const dvec3& t : samples_.directions(parameters.tool_samples)) {
            const dvec3 index =
                dvec3(to_index * glm::dvec4(proxy_ + parameters.tool_radius_mm * t, 1.0));
            if (glm::any(glm::greaterThan(glm::abs(index), dvec3(1e6))))
                continue;
            const float s = resident_sample(*source.volume, glm::ivec3(glm::round(index)));
            if (double{s} >= source.iso) {
                sum += t;
                ++touching;
            }
        }
        dvec3 normal(0.0);
        if (touching == 0) {
            proxy_ = x;
        } else {
            const double yield_mm =
                parameters.yield_n > 0.0 ? give_mm(parameters.yield_n, parameters) : INFINITY;
            // The print divides by the length without a word on 0: no normal, no constraint.
            normal = unit_or_zero(-sum);
            const double d0 = glm::dot(d, normal);
            const dvec3 across = d - d0 * normal;
            const double d1 = glm::length(across);
            const double held = std::max(d1 - parameters.friction_dynamic * std::abs(d0), 0.0);
            proxy_ += unilateral(d0, yield_mm) * normal + held * unit_or_zero(across);
        }
        TickOutput output = output_of(input, proxy_, last, normal);
        output.contacts = touching;
        output.contact = touching == 0                         ? Contact::free
                         : normal == dvec3(0.0)                ? Contact::submerged
                         : touching == parameters.tool_samples ? Contact::submerged
                                                               : Contact::touching;
        return output;
    }
    std::vector<std::span<const std::byte>> memory() const override { return memory_of(*this); }

 private:
    dvec3 proxy_{0.0};
    bool has_proxy_ = false;
    SphereSamples samples_;
};

// ---- WISH 2008 ------------------------------------------------------------------------------

struct WishState {
    dvec3 proxy{0.0};
    bool has_proxy = false;
};

enum class WishMode { surface, surface_literal, viscosity, potential, vector };

template <WishMode kMode>
TickOutput wish_tick(WishState& state, const TickInput& input) noexcept {
    const TouchScene& scene = *input.scene;
    if (!is_sane(input) || !scene.grey)
        return unknown_output(state.proxy);
    const TouchParameters& parameters = *input.parameters;
    const Source source{&*scene.grey, parameters.iso};
    const dvec3 x = input.tool.position_mm;
    if (!state.has_proxy)
        state.proxy = x;
    state.has_proxy = true;
    const dvec3 last = state.proxy, d = x - last;
    const glm::dmat4 to_index = index_from_world(source.volume->grid());
    const double intensity = value_at(source, to_index, last);

    dvec3 e0 = -unit_or_zero(gradient_at(source, to_index, last));
    if constexpr (kMode == WishMode::potential)
        e0 = -e0; // towards where the potential rises
    if constexpr (kMode == WishMode::vector) {
        if (scene.field[0] && scene.field[1] && scene.field[2]) {
            dvec3 v(0.0);
            for (int axis = 0; axis < 3; ++axis) {
                const Volume& component = *scene.field[static_cast<size_t>(axis)];
                v[axis] = resident_trilinear(component, index_point(component.grid(), last));
            }
            e0 = is_finite(v) ? unit_or_zero(v) : dvec3(0.0);
        } else {
            e0 = -e0;
        }
    }
    if (e0 == dvec3(0.0) || !std::isfinite(intensity)) {
        // The print says nothing of a frame without direction: nothing is felt.
        state.proxy = x;
        return output_of(input, x, last, {});
    }
    const double d0 = glm::dot(d, e0);
    const dvec3 across = d - d0 * e0;
    const dvec3 e1 = unit_or_zero(across);
    const double d1 = glm::length(across);
    const auto reach = [&](size_t axis) {
        return give_mm(strength_n(parameters.transfer[axis], intensity), parameters);
    };
    switch (kMode) {
        case WishMode::surface:
            state.proxy += unilateral(d0, reach(0)) * e0 + bilateral(d1, reach(1)) * e1;
            break;
        case WishMode::surface_literal:
            state.proxy += unilateral_as_printed(d0, reach(0)) * e0 + bilateral(d1, reach(1)) * e1;
            break;
        case WishMode::viscosity:
            state.proxy += bilateral(d0, reach(0)) * e0 + bilateral(d1, reach(1)) * e1;
            break;
        case WishMode::potential:
        case WishMode::vector:
            state.proxy += directed(d0, reach(0)) * e0 + d1 * e1;
            break;
    }
    TickOutput output = output_of(input, state.proxy, last, e0);
    output.contact = output.depth_mm > 1e-9 ? Contact::touching : Contact::free;
    output.contacts = output.contact == Contact::touching;
    return output;
}

// ---- Eriksson, Dixon & Wikander 2006 ----------------------------------------------------------

struct ErikssonState {
    dvec3 proxy{0.0};
    bool has_proxy = false;
    uint64_t random = 1;
};

template <bool kLiteral>
TickOutput eriksson_tick(ErikssonState& state, const TickInput& input) noexcept {
    const Source source = source_of(input);
    if (!is_sane(input) || !source.volume)
        return unknown_output(state.proxy);
    const TouchParameters& parameters = *input.parameters;
    const dvec3 x = input.tool.position_mm;
    const glm::dmat4 to_index = index_from_world(source.volume->grid());
    if (!state.has_proxy)
        state.proxy = x;
    state.has_proxy = true;
    const dvec3 last = state.proxy;
    if (value_at(source, to_index, x) < source.iso) {
        state.proxy = x;
        TickOutput output = output_of(input, x, last, {});
        output.force_n = dvec3(0.0);
        return output;
    }
    // Gradients point into the material here; the print's normal does, too.
    const dvec3 n1 = unit_or_zero(gradient_at(source, to_index, last));
    const dvec3 a = x - last;
    const double a1 = glm::dot(a, n1);
    const dvec3 n2 = a - a1 * n1;
    const double a3 = std::max(glm::length(n2) - parameters.friction_dynamic * std::abs(a1), 0.0);
    dvec3 p = last + a3 * unit_or_zero(n2);

    // Steps of 0.1 samples, at most 20, until the surface is crossed; then the line between the
    // last two. The print says +n inside, where its gradient leads deeper: towards lower density is
    // meant.
    const double iso = source.iso;
    double value = value_at(source, to_index, p);
    const dvec3 n3 = unit_or_zero(gradient_at(source, to_index, p));
    const bool was_inside = value >= iso;
    const dvec3 step =
        0.1 * smallest_spacing_mm(source.volume->grid()) * (was_inside != kLiteral ? -n3 : n3);
    uint32_t iterations = 0;
    for (; iterations < 20; ++iterations) {
        const dvec3 next = p + step;
        const double next_value = value_at(source, to_index, next);
        if ((next_value >= iso) != was_inside) {
            const double share = (iso - value) / (next_value - value);
            p += (std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 0.0) * step;
            break;
        }
        p = next;
        value = next_value;
    }
    state.proxy = p;
    const dvec3 out = -unit_or_zero(gradient_at(source, to_index, p));
    TickOutput output = output_of(input, p + parameters.tool_radius_mm * out, last, out);
    if (input.removal > 0.0 && parameters.vibration_n > 0.0)
        for (int axis = 0; axis < 3; ++axis)
            output.force_n[axis] +=
                input.removal * parameters.vibration_n * next_signed(state.random);
    output.contact = Contact::touching;
    output.contacts = 1;
    output.iterations = iterations;
    return output;
}

} // namespace

std::unique_ptr<Algorithm> make_vidholm_2004() {
    return std::make_unique<Vidholm2004>();
}
std::unique_ptr<Algorithm> make_wish_2008_surface() {
    return make_algorithm_of<WishState, wish_tick<WishMode::surface>>();
}
std::unique_ptr<Algorithm> make_wish_2008_surface_literal() {
    return make_algorithm_of<WishState, wish_tick<WishMode::surface_literal>>();
}
std::unique_ptr<Algorithm> make_wish_2008_viscosity() {
    return make_algorithm_of<WishState, wish_tick<WishMode::viscosity>>();
}
std::unique_ptr<Algorithm> make_wish_2008_potential() {
    return make_algorithm_of<WishState, wish_tick<WishMode::potential>>();
}
std::unique_ptr<Algorithm> make_wish_2008_vector() {
    return make_algorithm_of<WishState, wish_tick<WishMode::vector>>();
}
std::unique_ptr<Algorithm> make_eriksson_2006() {
    return make_algorithm_of<ErikssonState, eriksson_tick<false>>();
}
std::unique_ptr<Algorithm> make_eriksson_2006_literal() {
    return make_algorithm_of<ErikssonState, eriksson_tick<true>>();
}

} // namespace palpate::haptics
