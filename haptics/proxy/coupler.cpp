#include "haptics/proxy/coupler.h"

#include <algorithm>
#include <array>

#include "engine/volume/cubic_weights.h"
#include "haptics/field/samples.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr double kYieldTime_s = 0.01, kFade_s = 0.02;
// Of the spring, beyond what the tool's own motion explains: 0.09 N in a millisecond.
constexpr double kBleed_n_per_s = 90.0;

} // namespace

Feel feel_at(const Volume& labels, dvec3 index, const TouchParameters& q) {
    const Feel plain = plain_feel(q);
    if (q.source != TouchSource::labels || q.label_count == 0 ||
        glm::any(glm::greaterThan(glm::abs(index), dvec3(1e6))))
        return plain;
    const dvec3 low = glm::floor(index);
    const dvec3 f = index - low;
    const auto x = cubic_weights(f.x).value, y = cubic_weights(f.y).value,
               z = cubic_weights(f.z).value;
    const uint32_t count = std::min(q.label_count, TouchParameters::kMostLabels);
    Feel sum{};
    double total = 0.0, heaviest = 0.0;
    std::array<double, TouchParameters::kMostLabels> shares{};
    for (int i = 0; i < 64; ++i) {
        const glm::ivec3 at(i & 3, i >> 2 & 3, i >> 4);
        const float label = resident_sample(labels, glm::ivec3(low) - 1 + at);
        if (!(label > 0.0f))
            continue;
        const double weight = x[size_t(at.x)] * y[size_t(at.y)] * z[size_t(at.z)];
        Feel feel = plain;
        for (uint32_t k = 0; k < count; ++k) {
            const LabelTouch& l = q.labels[k];
            if (double{label} != l.label)
                continue;
            feel = {l.stiffness_n_per_m, l.friction_static, l.friction_dynamic, l.yield_n, l.label};
            shares[k] += weight;
            if (shares[k] > heaviest) {
                heaviest = shares[k];
                sum.label = l.label;
            }
        }
        sum.stiffness_n_per_m += weight * feel.stiffness_n_per_m;
        sum.friction_static += weight * feel.friction_static;
        sum.friction_dynamic += weight * feel.friction_dynamic;
        sum.yield_n += weight * feel.yield_n;
        total += weight;
    }
    if (total < 1e-6)
        return plain;
    return {sum.stiffness_n_per_m / total, sum.friction_static / total,
            sum.friction_dynamic / total, sum.yield_n / total, sum.label};
}

void Coupler::reset(dvec3 tool_mm) {
    *this = Coupler{};
    rendered_ = tool_ = tool_mm;
}

TickOutput Coupler::unknown() {
    presence_ = 0.0;
    return unknown_output(rendered_);
}

dvec3 Coupler::rubbed(dvec3 hand, dvec3 proxy, dvec3 normal, bool& slipping) const {
    const double friction = slipping ? feel_.friction_dynamic : feel_.friction_static;
    if (!(friction > 0.0))
        return hand;
    const dvec3 way = hand - proxy;
    const double depth = std::max(0.0, -glm::dot(way, normal) - yielded_mm_);
    const dvec3 along = way - glm::dot(way, normal) * normal;
    const double whole = glm::length(along), held = friction * depth;
    slipping = whole > held + 1e-6;
    return hand - (whole > held ? held / whole : 1.0) * along;
}

void Coupler::yield(const TickInput& input, const Geometry& geometry, const Feel& may_be) {
    const double dt = input.dt_s;
    if (geometry.touching && !is_first_) {
        feel_.stiffness_n_per_m = slewed(feel_.stiffness_n_per_m, may_be.stiffness_n_per_m, dt);
        feel_.friction_static = slewed(feel_.friction_static, may_be.friction_static, dt);
        feel_.friction_dynamic = slewed(feel_.friction_dynamic, may_be.friction_dynamic, dt);
        feel_.yield_n = slewed(feel_.yield_n, may_be.yield_n, dt);
        feel_.label = may_be.label;
    } else {
        feel_ = may_be; // in the air nothing jumps
    }
    const double k = 1e-3 * feel_.stiffness_n_per_m; // N/mm
    if (!(geometry.touching && feel_.yield_n > 0.0 && k > 0.0)) {
        yielded_mm_ = 0.0;
        return;
    }
    if (yielded_mm_ == 0.0)
        entry_ = geometry.normal;
    const dvec3 x = input.tool.position_mm;
    const double depth = std::max(0.0, glm::dot(geometry.proxy_mm - x, entry_));
    const double most = feel_.yield_n / k;
    if (depth > yielded_mm_ + most)
        yielded_mm_ += (depth - most - yielded_mm_) * -std::expm1(-dt / kYieldTime_s);
    else
        yielded_mm_ = std::min(yielded_mm_, depth);
}

TickOutput Coupler::finish(const TickInput& input, const Geometry& geometry, dvec3 rendered) {
    const TouchParameters& q = *input.parameters;
    const dvec3 x = input.tool.position_mm;
    const double dt = input.dt_s, k = 1e-3 * feel_.stiffness_n_per_m;
    if (geometry.was_replaced && !is_first_)
        bleed_.take_up(rendered_ + (x - tool_), rendered, glm::distance(x, tool_));
    rendered += bleed_.next(k > 0.0 ? kBleed_n_per_s / k : 1e6, dt);

    TickOutput output;
    const double fade = dt / kFade_s;
    presence_ =
        geometry.lacks_data ? std::max(0.0, presence_ - fade) : std::min(1.0, presence_ + fade);
    const double damping = rendered == x ? 0.0 : q.damping_n_s_per_m;
    output.force_n = coupling_n(feel_.stiffness_n_per_m, damping, x, rendered,
                                input.velocity_mm_per_s, (rendered - rendered_) / dt);
    if (yielded_mm_ > 0.0)
        output.force_n -= 1e-3 * q.viscosity_n_s_per_m * input.velocity_mm_per_s;
    // Doubt comes and goes no faster than an edit is felt, and not while one is.
    const double wanted = std::clamp(2.0 * geometry.confidence, 0.0, 1.0);
    const double felt = glm::length(output.force_n);
    if (!had_force_)
        trust_ = wanted;
    else if (bleed_.is_over() && felt > 0.0)
        trust_ +=
            std::clamp(wanted - trust_, -kBleed_n_per_s * dt / felt, kBleed_n_per_s * dt / felt);
    had_force_ = felt > 0.0;
    output.force_n *= presence_ * trust_;
    if (input.removing && geometry.touching && q.vibration_n > 0.0)
        output.force_n += q.vibration_n * vibration_.next(dt) * geometry.normal;

    is_first_ = false;
    rendered_ = rendered;
    tool_ = x;
    output.proxy = input.tool;
    output.proxy.position_mm = rendered;
    output.depth_mm = glm::distance(rendered, x);
    output.normal = geometry.touching ? geometry.normal : dvec3(0.0);
    output.confidence = geometry.confidence;
    output.label = geometry.touching ? feel_.label : 0;
    output.contacts = geometry.contacts;
    output.iterations = geometry.iterations;
    output.contact = geometry.lacks_data  ? Contact::unknown
                     : geometry.submerged ? Contact::submerged
                     : yielded_mm_ > 0.0  ? Contact::yielding
                     : geometry.touching  ? Contact::touching
                                          : Contact::free;
    if (!is_finite(output.force_n) || !is_finite(rendered)) {
        reset(x);
        return unknown();
    }
    return output;
}

} // namespace palpate::haptics
