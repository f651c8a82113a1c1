#include "haptics/proxy/swept_tool.h"

#include <algorithm>
#include <cmath>

#include "haptics/proxy/swept_tool_course.h"

namespace palpate::haptics {

namespace swept_tool {

namespace {

// For so long after what is touched was exchanged, the tool may be drawn along; then it is the hand
// alone that moves it.
constexpr double kCatchingUp_s = 0.1;
constexpr double kTorque_ticks = 100.0; // that torque is watched for at least: as many at any rate
// From one tick to the next, of the way where it turned back: no less than this; all of it again
// where the hand has moved by so much, in samples. Ways beyond the hand's that are no longer than
// the last one do not count, and a hand that moves by no more rests.
constexpr double kLeastEase = 1.0 / 64.0, kEased = 0.2, kTremor = 0.03;
constexpr double kLeastShare = 0.05; // of a way, that is worth going

} // namespace

void SweptTool::submerge(dvec3 hand, Geometry& geometry) {
    State& s = state_;
    s.is_submerged = geometry.submerged = true;
    s.proxy = hand;
    s.held_count = 0;
}

// The tool goes less far each time that ticks lead it to and fro, or away from a hand that hardly
// moves, as among bumps that hold it in turn, until the hand moves on.
void SweptTool::ease(dvec3 start, double moved_mm) {
    State& s = state_;
    const dvec3 way = s.proxy - start;
    const double slack_mm = kTremor * voxel_mm();
    s.ease = std::min(1.0, s.ease + moved_mm / (kEased * voxel_mm()));
    const bool turns = glm::dot(way, s.last_way) < 0.0;
    const bool leaves =
        glm::distance(s.proxy, s.hand) > glm::distance(start, s.hand) + slack_mm + moved_mm;
    if ((turns || leaves) && glm::length(way) > 2.0 * moved_mm + slack_mm)
        s.ease = std::max(kLeastEase, 0.4 * s.ease);
    s.last_way = way;
    if (s.ease < 1.0 && contacts_.is_as_free(start + s.ease * way, start))
        s.proxy = start + s.ease * way;
}

// The tool moves by itself, without the hand, only as far as its account allows: part of the way,
// where that is free, or none of it.
void SweptTool::hold_back(dvec3 start, dvec3 hand, double dt_s, Course& c) {
    State& s = state_;
    s.account.forget(dt_s);
    s.account.allow(contacts_.reshaped_mm(), glm::distance(start, hand));
    const dvec3 step = s.proxy - start;
    double share = s.account.share_of(start, s.proxy, hand, contacts_.doubt_mm());
    if (share < 1.0) {
        while (share > kLeastShare && !contacts_.is_as_free(start + share * step, start))
            share *= 0.5;
        s.proxy = share > kLeastShare ? start + share * step : start;
        if (s.proxy != hand) {
            c.touching = true;
            s.normal = unit_or_zero(s.proxy - hand);
        }
    }
    s.account.note(start, s.proxy, hand);
}

// How far its contacts are to be trusted was seen where it would have settled: that changes by the
// share of the way there that it went, and not where nothing held it at the end of that way.
void SweptTool::keep_confidence(dvec3 start, dvec3 settled, bool was_held, Geometry& geometry) {
    State& s = state_;
    if (s.proxy == settled)
        return;
    const double share =
        was_held ? std::min(1.0, glm::distance(start, s.proxy) / glm::distance(start, settled))
                 : 0.0;
    geometry.confidence = glm::mix(s.confidence, geometry.confidence, share);
}

// Out of material that it yielded into: nothing that it knew of contacts is of use.
void SweptTool::come_out(dvec3 place, dvec3 hand) {
    const Felt felt = state_;
    state_ = State{};
    static_cast<Felt&>(state_) = felt;
    state_.proxy = place;
    state_.hand = hand;
    state_.touching = state_.slipping = false;
    state_.normal = dvec3(0.0);
}

void SweptTool::follow(dvec3 hand, double dt_s, Geometry& geometry) {
    State& s = state_;
    const dvec3 start = s.proxy;
    const double moved_mm = glm::distance(hand, s.hand);
    const double length_before_mm = glm::distance(start, s.hand);
    const bool was_behind = s.is_behind;
    s.hand = hand;
    const bool is_catching_up = geometry.was_replaced || s.catching_up_s > 0.0;
    if (geometry.was_replaced)
        s.gain = {};

    const dvec3 goal = s.touching ? coupler_.rubbed(hand, s.proxy, s.normal, s.slipping) : hand;
    Course c = course_to(goal, moved_mm, geometry);
    settle(c, geometry);
    if (!c.touching && goal != hand && !c.is_spent) { // it lost what it rubbed on
        const uint32_t looks = c.looks, steps = c.steps + 1;
        c = course_to(hand, moved_mm, geometry);
        c.looks = looks;
        c.steps = steps;
        settle(c, geometry);
    }

    // Work may end among contacts that only rearrange, while the spring hardly changes, or that
    // hold the tool where it is: that is no lag.
    const double length_mm = glm::distance(s.proxy, hand), doubt_mm = contacts_.doubt_mm();
    const bool falls_behind = length_mm > length_before_mm + doubt_mm;
    const bool comes_closer = length_mm < glm::distance(start, hand) - doubt_mm;
    const bool is_held = c.rest && glm::distance(*c.rest, s.proxy) < c.half_sample_mm;
    s.is_behind = !is_catching_up && c.is_spent && !is_held &&
                  (falls_behind || (s.is_behind && comes_closer));
    geometry.is_behind = s.is_behind;
    s.is_sunk = is_catching_up && !c.is_out && (geometry.was_replaced || s.is_sunk);
    s.catching_up_s = c.has_settled           ? 0.0
                      : geometry.was_replaced ? kCatchingUp_s
                                              : std::max(0.0, s.catching_up_s - dt_s);
    if (s.is_sunk && s.catching_up_s == 0.0 && !c.has_settled) {
        submerge(hand, geometry);
        c.touching = false;
    }
    // Farther than a sample it went along a surface that bends: part of that way as the crow flies
    // may lead through material, and is the hand's, not a tremor. While the hand rests
    // such a way is a jump between contacts, unless the tool was still behind.
    const bool is_hands = was_behind || moved_mm > kTremor * voxel_mm();
    const bool went_far = is_hands && glm::distance(start, s.proxy) > voxel_mm();
    if (is_catching_up || s.is_submerged || went_far) {
        s.account.reset();
        s.ease = 1.0;
    } else {
        const dvec3 settled = s.proxy;
        const bool was_held = c.touching;
        // Short of the hand something holds it, also where the last look did not show what.
        if (c.touching || s.held_count > 0 || s.proxy != hand)
            ease(start, moved_mm);
        hold_back(start, hand, dt_s, c);
        keep_confidence(start, settled, was_held, geometry);
    }
    s.confidence = geometry.confidence;
    if (!(c.touching && s.touching))
        s.slipping = glm::distance(s.proxy, start) > 1e-5;
    s.touching = c.touching;
    geometry.contacts = s.held_count;
}

// Whether what the tool feels is another than in the tick before. Edits elsewhere are not.
bool SweptTool::is_exchanged(const TickInput& input, const Volume& volume) {
    State& s = state_;
    const TouchParameters& p = *input.parameters;
    const bool may_be_same = s.has_proxy && p.iso == s.iso && p.source == s.source &&
                             std::isfinite(contacts_.reshaped_mm());
    const bool has_new_samples = s.exchange(input, volume);
    return !may_be_same || (has_new_samples && contacts_.stamps_about(s.proxy) != s.stamps);
}

// Each contact's share of the force is what its normal carries; it acts at its sample.
dvec3 SweptTool::lever_of(dvec3 force_n) const {
    double total = 0.0;
    dvec3 arm(0.0);
    for (const Hold& hold : contacts_.holds()) {
        if (hold.clearance_mm > 0.1 * voxel_mm())
            continue;
        const double share = std::max(0.0, glm::dot(hold.normal, force_n));
        total += share;
        arm += share * contacts_.arm_of(hold.touch);
    }
    return total > 0.0 ? arm / total : dvec3(0.0);
}

// Torque is released as force is: with the lever of the last contacts for as long as any force is
// left. After an exchange it changes by the rate at which edits are felt, over the tool's reach,
// and by what the hand's motion explains.
dvec3 SweptTool::torque_of(const TickInput& input, double moved_mm, bool is_exchanged,
                           dvec3 force_n) {
    const dvec3 torque_nm = 1e-3 * glm::cross(lever_mm_, force_n);
    torque_watch_s_ = is_exchanged ? std::max(kCatchingUp_s, kTorque_ticks * input.dt_s)
                                   : std::max(0.0, torque_watch_s_ - input.dt_s);
    const double reach_mm = contacts_.reach_mm();
    if (torque_watch_s_ > 0.0) {
        const double turned_mm =
            std::isfinite(contacts_.reshaped_mm()) ? contacts_.reshaped_mm() : 0.0;
        const double spring_n_per_mm = 1e-3 * coupler_.feel().stiffness_n_per_m;
        const double natural_n_mm =
            reach_mm * spring_n_per_mm * moved_mm + glm::length(force_n) * (moved_mm + turned_mm);
        torque_bleed_.take_up(torque_nm_, torque_nm, 1e-3 * natural_n_mm);
    }
    torque_nm_ =
        torque_nm + torque_bleed_.next(1e-3 * reach_mm * Yielding::kRate_n_per_s, input.dt_s);
    return torque_nm_;
}

TickOutput SweptTool::tick(const TickInput& input) noexcept {
    State& s = state_;
    const TouchParameters& q = *input.parameters;
    const std::optional<Volume>& volume = Felt::volume_of(input);
    const glm::dquat turn = input.tool.rotation;
    const double turn_length = glm::dot(turn, turn);
    if (!is_sane(input) || !volume || !(turn_length > 0.25 && turn_length < 4.0))
        return coupler_.unknown();
    contacts_.follow(input, *volume);
    const Field& field = contacts_.field();
    const State before = s;
    const bool was_inside = coupler_.is_inside();
    Geometry geometry;
    geometry.was_replaced = is_exchanged(input, *volume);
    const dvec3 hand =
        coupler_.hand(input, field.voxel_mm(), [&](dvec3 p) { return contacts_.is_free(p); });
    if (coupler_.has_come_out())
        come_out(coupler_.place_mm(), hand);
    const bool is_inside = coupler_.is_inside();
    if (is_inside)
        s.proxy = coupler_.place_mm();
    else
        follow(hand, input.dt_s, geometry);
    geometry.proxy_mm = s.proxy;
    geometry.touching = s.touching && !is_inside;
    geometry.normal = s.normal;
    // In material that it yielded into, its contacts are those of the way in.
    const dvec3 push = is_inside ? dvec3(0.0) : unit_or_zero(s.proxy - hand);
    const bool lacks_data =
        contacts_.lacks_data(s.proxy, push, {before.held.data(), before.held_count});
    // After a gap in which all force has gone, the tool begins anew at the hand, deep in material.
    // Contacts beside the gap hold it on its way out; what matters are those where it comes to
    // rest.
    geometry.lacks_data = lacks_data || (lacked_data_ && s.catching_up_s > 0.0);
    lacked_data_ = geometry.lacks_data;
    std::optional<Feel> feel;
    if (geometry.touching || is_inside || s.proxy != hand)
        feel = contacts_.feel_at(s.proxy, push, q);
    TickOutput output = coupler_.couple(input, geometry, feel);
    if (geometry.touching && !geometry.lacks_data)
        lever_mm_ = lever_of(output.force_n);
    const bool has_surface_changed =
        geometry.was_replaced || geometry.lacks_data || before.is_submerged != s.is_submerged;
    output.torque_nm = torque_of(input, glm::distance(input.tool.position_mm, tool_mm_),
                                 has_surface_changed, output.force_n);
    tool_mm_ = input.tool.position_mm;
    if (!lacks_data) {
        s.stamps = contacts_.stamps_about(s.proxy);
        return output;
    }
    s = before;
    if (was_inside || coupler_.is_at_hand()) {
        s = State{};
        s.restart(input.tool.position_mm);
    }
    return output;
}

} // namespace swept_tool

std::unique_ptr<Algorithm> make_swept_tool() {
    return std::make_unique<swept_tool::SweptTool>();
}

} // namespace palpate::haptics
