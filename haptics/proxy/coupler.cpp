#include "haptics/proxy/coupler.h"

#include <algorithm>

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr double kFade_s = 0.02;
// The spring, beyond what the tool's own motion explains, is bled off so fast: 0.09 N in 1 ms.
constexpr double kBleed_n_per_s = Yielding::kRate_n_per_s;
// For so long after what is touched was exchanged geometry may take to come to rest: until then
// what moves beyond the tool's own motion is the edit's. A third of the ticks in which force could
// fall from 30 N at that rate; the work of a tick is bounded, so at a low rate as many ticks.
constexpr double kCatchingUp_s = 0.1, kCatchingUp_ticks = 100.0;
// The force above which material yields that never does, so that it can be slewed.
constexpr double kNever_n = MostTouch::force_n;

double never_or(double yield_n) {
    return yield_n > 0.0 ? yield_n : kNever_n;
}

// T0 falls at once to the force that is felt, and on from there by the rate of edits. It rises by
// 5 % of the larger 1 / T0 a millisecond. Both are above 0.
double slewed_yield(double now_n, double target_n, double felt_n, double dt_s) {
    if (target_n < now_n)
        return std::max(target_n, std::min(now_n, felt_n) - Yielding::kRate_n_per_s * dt_s);
    return 1.0 / slewed(1.0 / now_n, 1.0 / target_n, dt_s);
}

} // namespace

void Coupler::reset(dvec3 tool_mm) {
    *this = Coupler{};
    rendered_ = tool_ = hand_ = tool_mm;
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
    const double depth = std::max(0.0, -glm::dot(way, normal));
    const dvec3 along = way - glm::dot(way, normal) * normal;
    const double whole = glm::length(along), held = friction * depth;
    slipping = whole > held + 1e-6;
    return hand - (whole > held ? held / whole : 1.0) * along;
}

bool Coupler::stays_inside(bool is_free, double grain_mm) {
    const double k = 1e-3 * feel_.stiffness_n_per_m;
    return k > 0.0 && yielding_.stays(is_free, grain_mm, tool_, k, cut_.felt_n());
}

dvec3 Coupler::hand_of(const TickInput& input) {
    if (yielding_.is_leaving() && !has_come_out_ && bleed_.is_over() && has_settled_)
        yielding_.catch_up(std::max(1e-9, 1e-3 * feel_.stiffness_n_per_m), input.dt_s);
    return yielding_.hand(input.tool.position_mm);
}

TickOutput Coupler::couple(const TickInput& input, const Geometry& geometry,
                           const std::optional<Feel>& may_be) {
    if (geometry.lacks_data) {
        yielding_ = {};
        return finish(input, {.proxy_mm = input.tool.position_mm, .lacks_data = true});
    }
    take_feel(input, geometry, may_be);
    yield(input, geometry);
    return finish(input, geometry);
}

// While a force is felt, its properties are slewed; else they change at once. So a first contact
// has the properties of what it touches, and not of the air before it.
void Coupler::take_feel(const TickInput& input, const Geometry& geometry,
                        const std::optional<Feel>& may_be) {
    const double dt = input.dt_s;
    const bool is_felt = had_force_ || yielding_.is_inside();
    if (!may_be && is_felt)
        return;
    const TouchParameters& q = *input.parameters;
    // A proxy that is not where the hand is will be felt, also where work ended on its way.
    const bool is_air =
        !geometry.touching && geometry.proxy_mm == yielding_.hand(input.tool.position_mm);
    const Feel target = may_be.value_or(is_air ? plain_feel(q) : softest_feel(q));
    const double yield_n = never_or(target.yield_n);
    if (!is_felt) {
        feel_ = target;
        feel_.yield_n = yield_n;
        return;
    }
    feel_.stiffness_n_per_m = slewed(feel_.stiffness_n_per_m, target.stiffness_n_per_m, dt);
    feel_.friction_static = slewed(feel_.friction_static, target.friction_static, dt);
    feel_.friction_dynamic = slewed(feel_.friction_dynamic, target.friction_dynamic, dt);
    feel_.yield_n = slewed_yield(feel_.yield_n, yield_n, cut_.felt_n(), dt);
    feel_.label = target.label;
}

void Coupler::yield(const TickInput& input, const Geometry& geometry) {
    const double dt = input.dt_s;
    const dvec3 x = input.tool.position_mm;
    const double k = 1e-3 * feel_.stiffness_n_per_m; // N/mm
    if (!(k > 0.0))
        return;
    const dvec3 spring = geometry.proxy_mm - yielding_.hand(x);
    // A jump of the force by an edit, or by the end of a gap in the data, is bled off first: until
    // then the force that comes is cut at T0, and nothing yields.
    const bool is_leaving = yielding_.is_leaving();
    const bool is_moved = lacked_data_ || geometry.was_replaced || catching_up_s_ > 0.0 ||
                          geometry.submerged != was_submerged_ || !bleed_.is_over();
    if ((is_leaving ? !lacked_data_ : is_first_ || !is_moved) && !yielding_.is_inside() &&
        geometry.touching && feel_.yield_n < kNever_n &&
        k * glm::dot(spring, geometry.normal) > feel_.yield_n) {
        // From where it was rendered: what coming out left to make up for is not asked now.
        yielding_.enter(is_leaving ? rendered_ + (x - tool_) : geometry.proxy_mm, geometry.normal,
                        x);
        bleed_.forget();
    }
    if (yielding_.is_inside())
        yielding_.sink(x, k, feel_.yield_n < kNever_n ? feel_.yield_n : INFINITY,
                       feel_.friction_dynamic, dt);
}

TickOutput Coupler::finish(const TickInput& input, const Geometry& geometry) {
    const TouchParameters& q = *input.parameters;
    const bool is_inside = yielding_.is_inside(), in_contact = geometry.touching || is_inside;
    const dvec3 tool = input.tool.position_mm, x = is_inside ? tool : yielding_.hand(tool);
    const double dt = input.dt_s, k = 1e-3 * feel_.stiffness_n_per_m;
    const bool is_exchanged = geometry.was_replaced || lacked_data_;
    catching_up_s_ = is_exchanged && !is_first_ ? std::max(kCatchingUp_s, kCatchingUp_ticks * dt)
                                                : std::max(0.0, catching_up_s_ - dt);
    dvec3 rendered = is_inside ? yielding_.place_mm() : geometry.proxy_mm;
    // Force stays what it was, and then falls, also where geometry takes some ticks to get there.
    if (geometry.lacks_data)
        bleed_.take_up(rendered_ + (x - hand_), rendered, 0.0);
    else if (yielding_.is_leaving())
        bleed_.take_up(rendered_ + (has_come_out_ ? tool - tool_ : x - hand_), rendered, 0.0);
    else if ((catching_up_s_ > 0.0 || geometry.submerged != was_submerged_) && !is_inside)
        bleed_.take_up(rendered_ + (x - hand_), rendered, glm::distance(x, hand_));
    // A lagging proxy that made up for part of its lag in this tick, with the hand that geometry
    // took, has used that much of the speed.
    const double made_up = yielding_.is_leaving() && !has_come_out_
                               ? glm::distance(x - hand_, tool - tool_) / dt
                               : 0.0;
    const double speed = std::max(0.0, Yielding::speed_mm_per_s(k) - made_up);
    const bool is_bleeding = !bleed_.is_over();
    rendered += bleed_.next(k > 0.0 ? speed : 1e6, dt);

    TickOutput output;
    const double damping = rendered == x ? 0.0 : q.damping_n_s_per_m;
    output.force_n = coupling_n(feel_.stiffness_n_per_m, damping, x, rendered,
                                input.velocity_mm_per_s, (rendered - rendered_) / dt);
    output.force_n =
        cut_.cut(output.force_n, feel_.yield_n < kNever_n ? feel_.yield_n : INFINITY, dt);
    // A spring that is long because work ended says nothing of what is touched. Afterwards it grows
    // as an edit is felt, and by what the hand moves.
    const double spring_n = glm::length(output.force_n);
    const double grows_n = kBleed_n_per_s * dt + k * glm::distance(x, hand_);
    const double most_n = geometry.is_behind ? spring_n_
                          : is_returning_    ? spring_n_ + grows_n
                                             : INFINITY;
    is_returning_ = spring_n > most_n;
    if (is_returning_)
        output.force_n *= most_n / spring_n;
    spring_n_ = std::min(spring_n, most_n);
    if (is_inside)
        output.force_n -= 1e-3 * q.viscosity_n_s_per_m * input.velocity_mm_per_s;
    // Doubt comes and goes no faster than an edit is felt, and not while one is.
    const double wanted = std::clamp(2.0 * geometry.confidence, 0.0, 1.0);
    const double felt = glm::length(output.force_n);
    if (!had_force_)
        trust_ = wanted;
    else if (!is_bleeding && felt > 0.0)
        trust_ +=
            std::clamp(wanted - trust_, -kBleed_n_per_s * dt / felt, kBleed_n_per_s * dt / felt);
    had_force_ = felt > 0.0;
    // While behind it fades, and comes again as an edit is felt.
    const double fade = dt / kFade_s;
    const double comes = felt > 0.0 ? std::min(fade, kBleed_n_per_s * dt / felt) : fade;
    if (geometry.is_behind)
        presence_ = std::max(0.0, presence_ - fade);
    else if (!geometry.lacks_data) // where nothing is known, no force comes
        presence_ = std::min(1.0, presence_ + comes);
    output.force_n *= presence_ * trust_;
    const dvec3 normal = is_inside ? yielding_.normal() : geometry.normal;
    // A tool larger than what is felt makes its own room, and the hand touches nothing meanwhile.
    if (in_contact && normal != dvec3(0.0))
        last_normal_ = normal;
    if (input.removal > 0.0 && q.vibration_n > 0.0)
        output.force_n += input.removal * q.vibration_n * vibration_.next(dt) * last_normal_;
    output.force_n -= 1e-3 * q.air_drag_n_s_per_m * input.velocity_mm_per_s;

    is_first_ = false;
    lacked_data_ = geometry.lacks_data;
    was_submerged_ = geometry.submerged;
    has_settled_ = in_contact || rendered == x;
    rendered_ = rendered;
    tool_ = tool;
    hand_ = x;
    output.proxy = input.tool;
    output.proxy.position_mm = rendered;
    output.depth_mm = glm::distance(rendered, tool);
    output.normal = in_contact ? normal : dvec3(0.0);
    output.confidence = geometry.confidence;
    output.label = in_contact ? feel_.label : 0;
    output.contacts = geometry.contacts;
    output.iterations = geometry.iterations;
    const bool yields = is_inside || yielding_.is_leaving();
    output.contact = geometry.lacks_data  ? Contact::unknown
                     : geometry.submerged ? Contact::submerged
                     : geometry.is_behind ? Contact::behind
                     : yields             ? Contact::yielding
                     : geometry.touching  ? Contact::touching
                                          : Contact::free;
    if (!is_finite(output.force_n) || !is_finite(rendered)) {
        reset(tool);
        return unknown();
    }
    return output;
}

} // namespace palpate::haptics
