#include "haptics/proxy/swept_tool.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "haptics/proxy/coupler.h"
#include "haptics/proxy/planes.h"
#include "haptics/proxy/proxy_account.h"
#include "haptics/proxy/slide_gain.h"
#include "haptics/proxy/tool_contacts.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr uint32_t kMostIterations = 24;
constexpr uint32_t kMostLooks = 5; // at every sample, in a tick
constexpr double kConverged_mm = 2e-4;
// Steps that have got so short by turning back, in samples, are not worth another look: 0.002 N at
// 500 N/m and 0.4 mm.
constexpr double kShortest = 0.01;
// In samples. A hand is fast that goes so far in a tick; then the tool goes back to the last place
// that was not deep from one that was not looked at. Within so much of a look nothing new is
// expected.
constexpr double kFast = 0.3, kSeen = 0.1;
// From here on (0 .. 1) a ball fits a groove so well that a step is no longer than kSeen: what
// holds it across the groove is other places at the next look.
constexpr double kFits = 0.2;
// After each time that it goes back the longest step is half as long, down to this share of it:
// then it goes on, whatever is there.
constexpr double kShortestShare = 0.1;
// For so long after what is touched was exchanged, the tool may be drawn along; then it is the hand
// alone that moves it.
constexpr double kCatchingUp_s = 0.1;
// From one tick to the next, of the way where it turned back: no less than this; all of it again
// where the hand has moved by so much, in samples. Ways beyond the hand's that are no longer than
// the last one do not count.
constexpr double kLeastEase = 1.0 / 64.0, kEased = 0.2, kTremor = 0.03;
constexpr double kLeastShare = 0.05; // of a way, that is worth going

struct State : Felt {
    // What was exchanged has moved the tool, and it may not yet be where that ends.
    double catching_up_s = 0.0;
    bool is_sunk = false; // since then, wherever it was looked at
    uint64_t stamps = 0;  // of what it felt
    bool is_fast = false; // the hand was, and the tool is not yet where it belongs
    // In matter without a way out: nothing holds it until none of it is in any.
    bool is_submerged = false;
    dvec3 hand{0.0};
    double longest_step = 1.0; // as a share of half a sample
    double trust_mm = 1e3;     // of the last step
    SlideGain gain;
    dvec3 last_way{0.0}; // that a tick led it
    double ease = 1.0;   // as a share of such a way
    ProxyAccount account;
    uint32_t held_count = 0; // places that held the tool in the tick before
    std::array<Touch, ToolContacts::kMost> held{};
};

// The steps of one tick.
struct Course {
    dvec3 goal;
    double moved_mm; // of the hand, since the tick before
    double half_sample_mm;
    double trust_mm; // how far planes are believed to hold: no step is longer
    double longest_mm;
    bool look = true; // at every sample, next
    uint32_t looks = 0, steps = 0;
    // Where all were looked at and none was deep.
    dvec3 good;
    bool has_good = false;
    bool is_out = false; // somewhere where all were looked at, none was sunk
    // It is farther from the last such look than what that says.
    bool is_unseen = false;
    double since_look_mm = 0.0;
    dvec3 last_step{0.0};
    // What planes said of the way along the surface, before that step.
    std::optional<dvec3> last_along;
    // Where all of the last step led, before it was tempered and cut; none where it led out.
    std::optional<dvec3> rest;
    bool has_learnt = false; // from a step of this tick how far to go
    bool touching = false, has_settled = false;
};

enum class Next { go_on, stop };

class SweptTool final : public Algorithm {
 public:
    void reset(const TickInput& input) noexcept override {
        state_ = State{};
        if (is_place(input.tool.position_mm))
            state_.proxy = input.tool.position_mm;
        coupler_.reset(state_.proxy);
    }
    TickOutput tick(const TickInput& input) noexcept override;

 private:
    std::span<const Touch> held() const { return {state_.held.data(), state_.held_count}; }
    double voxel_mm() const { return contacts_.field().voxel_mm(); }

    bool is_exchanged(const TickInput& input, const Volume& volume);
    void follow(const TickInput& input, Geometry& geometry);
    void settle(Course& c, Geometry& geometry);
    void submerge(dvec3 hand, Geometry& geometry);
    void ease(dvec3 start, double moved_mm);
    void hold_back(dvec3 start, dvec3 hand, double dt_s, Course& c);
    Course course_to(dvec3 goal, double moved_mm, const Geometry& geometry) const;
    bool try_leap(Course& c);
    Next look_and_step(Course& c, bool is_first, Geometry& geometry);
    dvec3 wanted_step(dvec3 goal) const;
    dvec3 tempered(dvec3 step, Course& c);
    double unseen_mm(const Course& c) const;
    void remember_holds(Course& c, dvec3 step, Geometry& geometry);
    bool go_back_if_unseen(Course& c);
    dvec3 torque_of(dvec3 force_n) const;

    State state_;
    Coupler coupler_;
    ToolContacts contacts_;
};

Course SweptTool::course_to(dvec3 goal, double moved_mm, const Geometry& geometry) const {
    const State& s = state_;
    const double half_sample_mm = 0.5 * voxel_mm(), longest_mm = s.longest_step * half_sample_mm;
    // Where the last tick's steps turned back and got short, this one's begin as short.
    const double trust_mm = geometry.was_replaced
                                ? longest_mm
                                : std::min(longest_mm, 4.0 * s.trust_mm + 2.0 * moved_mm);
    return {.goal = goal,
            .moved_mm = moved_mm,
            .half_sample_mm = half_sample_mm,
            .trust_mm = trust_mm,
            .longest_mm = longest_mm,
            .good = s.proxy};
}

// Where nothing holds it: as far as blocks are clear.
bool SweptTool::try_leap(Course& c) {
    State& s = state_;
    const dvec3 way = c.goal - s.proxy;
    const double length = glm::length(way);
    const double leap = std::min(length, 16.0 * voxel_mm());
    const dvec3 next = length > 0.0 ? s.proxy + (leap / length) * way : c.goal;
    if (s.held_count > 0 || !contacts_.is_clear(s.proxy, next))
        return false;
    s.proxy = leap == length ? c.goal : next;
    s.is_submerged = false;
    c.good = s.proxy;
    c.has_good = c.is_out = true;
    c.has_settled = leap == length;
    return true;
}

// To what of all places that no contact forbids is nearest to the goal.
dvec3 SweptTool::wanted_step(dvec3 goal) const {
    const std::span<const Hold> holds = contacts_.holds();
    std::array<Plane, ToolContacts::kMostHolds> planes;
    for (size_t k = 0; k < holds.size(); ++k)
        planes[k] = {holds[k].normal,
                     glm::dot(holds[k].normal, state_.proxy) - holds[k].clearance_mm};
    const Projection target = project_to_planes(goal, {planes.data(), holds.size()});
    if (target.is_feasible)
        return target.point - state_.proxy;
    // Wedged: out of what is deepest, as far as its opponents allow.
    dvec3 step(0.0);
    double in_material = 0.0;
    for (const Hold& hold : holds) {
        step -= std::min(0.0, hold.clearance_mm) * hold.normal;
        in_material += hold.clearance_mm < 0.0;
    }
    return step / std::max(1.0, in_material);
}

// Of the part across the hand's push, which leads along the surface, as much as is worth going; out
// of what is in material all the same.
dvec3 SweptTool::tempered(dvec3 step, Course& c) {
    State& s = state_;
    const dvec3 push = unit_or_zero(c.goal - s.proxy);
    const dvec3 along = step - glm::dot(step, push) * push;
    if (c.last_along) {
        const dvec3 went = c.last_step - glm::dot(c.last_step, push) * push;
        s.gain.learn(went, *c.last_along, along);
        c.has_learnt = true;
    }
    c.last_along = along;
    return wanted_step(s.proxy + step - (1.0 - s.gain.value()) * along);
}

// How far it may go from a look that left samples out, or where a ball fits a groove. Where none is
// in material, and what held it was looked at, as far as the hand did: what was left out lies
// farther out than what was not.
double SweptTool::unseen_mm(const Course& c) const {
    const ToolContacts::Look& look = contacts_.look();
    const auto contacts = contacts_.contacts();
    const bool has_seen = std::any_of(contacts.begin(), contacts.end(),
                                      [](const Hold& hold) { return !hold.is_pushed; });
    const bool may_follow = has_seen && !look.any_inside && look.fits <= kFits && !state_.is_fast;
    return std::max(kSeen * voxel_mm(), may_follow ? c.moved_mm : 0.0);
}

// What held it on this step, or nearly did, is looked at again.
void SweptTool::remember_holds(Course& c, dvec3 step, Geometry& geometry) {
    State& s = state_;
    s.held_count = 0;
    c.touching = false;
    dvec3 push(0.0);
    geometry.confidence = 1.0;
    const size_t contacts = contacts_.contacts().size();
    size_t index = 0;
    for (const Hold& hold : contacts_.holds()) {
        const bool is_contact = index++ < contacts;
        const double left = hold.clearance_mm + glm::dot(hold.normal, step);
        if (left > 4.0 * c.half_sample_mm)
            continue;
        if (is_contact) // what has held it in this tick may hold it again
            s.held[s.held_count++] = hold.touch;
        if (left < 1e-6 && glm::dot(hold.normal, c.goal - s.proxy) < 0.0) {
            c.touching = true;
            push += hold.normal;
            geometry.confidence = std::min(geometry.confidence, hold.confidence);
        }
    }
    // Planes hold it against the goal where they end its way; on the way there it is held already.
    const bool is_held = c.rest && glm::distance(*c.rest, c.goal) > 1e-6 &&
                         glm::distance(*c.rest, s.proxy) < c.half_sample_mm;
    c.touching |= is_held;
    if (is_held)
        s.normal = unit_or_zero(*c.rest - c.goal);
    else if (c.touching)
        s.normal = unit_or_zero(push);
}

// One look and one step.
Next SweptTool::look_and_step(Course& c, bool is_first, Geometry& geometry) {
    State& s = state_;
    // Every sample is looked at before the first step, after each long one, and at the end.
    const bool looked = c.look;
    c.looks += looked;
    contacts_.find(s.proxy, {.held = held(),
                             .goal_mm = c.goal,
                             .all = looked,
                             .is_first = is_first,
                             .is_fast = s.is_fast});
    const ToolContacts::Look& look = contacts_.look();
    if (look.has_left_out) // it stays where all of them were looked at
        return Next::stop;
    const bool has_none = contacts_.holds().empty();
    const bool is_unknown = look.is_spent && has_none && !look.any_flat; // none was looked at
    // So deep that nothing has a slope, and no way out is known.
    if (looked)
        s.is_submerged = look.any_inside &&
                         (s.is_submerged || (has_none && !is_unknown && s.normal == dvec3(0.0)));
    if (s.is_submerged) {
        submerge(c.goal, geometry);
        return Next::stop;
    }
    if (is_unknown) {
        c.touching |= is_first && s.touching;
        c.is_unseen = c.has_good;
        return Next::stop;
    }
    const bool is_buried =
        look.any_flat && !look.any_sloped && (geometry.was_replaced || s.catching_up_s > 0.0);
    if ((is_buried || has_none) && look.any_inside && s.normal != dvec3(0.0))
        contacts_.add({{0, -s.normal}, s.normal, -c.half_sample_mm, -c.half_sample_mm, 0.5});
    const bool deep = contacts_.is_deep();
    // The deepest come first: where work ended before any of them, nothing is known of it.
    const bool knows = looked && (!look.is_spent || look.any_sloped || look.any_flat);
    c.is_unseen = c.is_unseen && (!knows || deep);
    c.is_out |= knows && !contacts_.is_sunk();
    if (knows && !deep) {
        c.good = s.proxy;
        c.has_good = true;
    }
    if (c.is_unseen && look.is_spent && s.is_fast && c.has_good)
        return Next::stop;
    // Where it is deep it goes out, and on from there.
    dvec3 step = wanted_step(deep ? s.proxy : c.goal);
    c.rest = deep ? std::nullopt : std::optional(s.proxy + step);
    if (!deep && !has_none && !s.is_fast && look.fits <= kFits) {
        step = tempered(step, c);
    } else {
        c.last_along.reset();
        s.gain = {};
    }
    // Between surfaces that bend, planes of one place are wrong at the next: where a step takes
    // back the last, steps get shorter.
    c.trust_mm = glm::dot(step, c.last_step) < 0.0 ? 0.5 * c.trust_mm
                                                   : std::min(c.longest_mm, 2.0 * c.trust_mm);
    if ((look.is_spent || look.fits > kFits) && !deep)
        c.trust_mm = std::min(c.trust_mm, unseen_mm(c));
    const double wanted = glm::length(step), length = std::min(wanted, c.trust_mm);
    if (wanted > c.trust_mm)
        step *= c.trust_mm / wanted;
    c.last_step = step;
    s.proxy += step;
    remember_holds(c, step, geometry);
    c.has_settled = length < kConverged_mm && looked;
    c.since_look_mm = looked ? length : c.since_look_mm + length;
    c.is_unseen = c.since_look_mm > kSeen * voxel_mm();
    c.look = length < kConverged_mm || c.is_unseen;
    const bool is_at_end = look.is_spent || c.has_settled || c.trust_mm < kShortest * voxel_mm();
    return is_at_end ? Next::stop : Next::go_on;
}

// Rather behind the hand than in material. What led there is tried again in shorter steps.
bool SweptTool::go_back_if_unseen(Course& c) {
    State& s = state_;
    if (!(c.is_unseen && c.has_good && s.is_fast && s.longest_step > kShortestShare))
        return false;
    s.proxy = c.good;
    c.touching |= !contacts_.holds().empty();
    if (c.touching && s.proxy != c.goal)
        s.normal = unit_or_zero(s.proxy - c.goal);
    return true;
}

// To where a tool rests that is drawn to the goal.
void SweptTool::settle(Course& c, Geometry& geometry) {
    State& s = state_;
    for (; c.steps < kMostIterations && c.looks < kMostLooks; ++c.steps) {
        if (try_leap(c)) {
            if (c.has_settled)
                break;
            continue;
        }
        if (look_and_step(c, c.steps == 0, geometry) == Next::stop)
            break;
    }
    const bool went_back = go_back_if_unseen(c);
    s.is_fast &= !c.has_settled;
    if (!c.has_learnt && !c.has_settled)
        s.gain.doubt();
    s.trust_mm = c.trust_mm;
    s.longest_step = went_back ? 0.5 * s.longest_step : std::min(1.0, 4.0 * s.longest_step);
    geometry.iterations = c.steps;
}

void SweptTool::submerge(dvec3 hand, Geometry& geometry) {
    State& s = state_;
    s.is_submerged = geometry.submerged = true;
    s.proxy = hand;
    s.held_count = 0;
}

// Where ticks lead it to and fro, or away from a hand that hardly moves, as among bumps that hold
// it in turn, it goes less far each time, until the hand moves on.
void SweptTool::ease(dvec3 start, double moved_mm) {
    State& s = state_;
    const dvec3 way = s.proxy - start;
    const double slack_mm = kTremor * voxel_mm();
    s.ease = std::min(1.0, 1.25 * s.ease + moved_mm / (kEased * voxel_mm()));
    const bool turns = glm::dot(way, s.last_way) < 0.0;
    const bool leaves =
        glm::distance(s.proxy, s.hand) > glm::distance(start, s.hand) + slack_mm + moved_mm;
    if ((turns || leaves) && glm::length(way) > 2.0 * moved_mm + slack_mm)
        s.ease = std::max(kLeastEase, 0.4 * s.ease);
    s.last_way = way;
    if (s.ease < 1.0 && contacts_.is_as_free(start + s.ease * way, start))
        s.proxy = start + s.ease * way;
}

// What the hand did not do, the tool does only as far as its account allows: part of the way, where
// that is free, or none of it.
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

void SweptTool::follow(const TickInput& input, Geometry& geometry) {
    State& s = state_;
    const dvec3 start = s.proxy, hand = input.tool.position_mm;
    const double moved_mm = glm::distance(hand, s.hand);
    s.hand = hand;
    s.is_fast |= moved_mm > kFast * voxel_mm();
    const bool is_catching_up = geometry.was_replaced || s.catching_up_s > 0.0;
    if (geometry.was_replaced)
        s.gain = {};

    const dvec3 goal = s.touching ? coupler_.rubbed(hand, s.proxy, s.normal, s.slipping) : hand;
    Course c = course_to(goal, moved_mm, geometry);
    settle(c, geometry);
    if (!c.touching && goal != hand && c.looks < kMostLooks) { // it lost what it rubbed on
        const uint32_t looks = c.looks, steps = c.steps + 1;
        c = course_to(hand, moved_mm, geometry);
        c.looks = looks;
        c.steps = steps;
        settle(c, geometry);
    }

    s.is_sunk = is_catching_up && !c.is_out && (geometry.was_replaced || s.is_sunk);
    s.catching_up_s = c.has_settled           ? 0.0
                      : geometry.was_replaced ? kCatchingUp_s
                                              : std::max(0.0, s.catching_up_s - input.dt_s);
    if (s.is_sunk && s.catching_up_s == 0.0 && !c.has_settled) {
        submerge(hand, geometry);
        c.touching = false;
    }
    geometry.was_replaced = is_catching_up;
    if (is_catching_up || s.is_submerged) {
        s.account.reset();
        s.ease = 1.0;
    } else {
        if (c.touching || s.held_count > 0)
            ease(start, moved_mm);
        hold_back(start, hand, input.dt_s, c);
    }
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
dvec3 SweptTool::torque_of(dvec3 force_n) const {
    double total = 0.0;
    dvec3 arm(0.0);
    for (const Hold& hold : contacts_.holds()) {
        if (hold.clearance_mm > 0.1 * voxel_mm())
            continue;
        const double share = std::max(0.0, glm::dot(hold.normal, force_n));
        total += share;
        arm += share * contacts_.arm_of(hold.touch);
    }
    return total > 0.0 ? 1e-3 * glm::cross(arm / total, force_n) : dvec3(0.0);
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
    Geometry geometry;
    geometry.was_replaced = is_exchanged(input, *volume);
    follow(input, geometry);
    geometry.proxy_mm = s.proxy;
    geometry.touching = s.touching;
    geometry.normal = s.normal;
    geometry.lacks_data = field.lacked_brick();
    const bool is_held = s.held_count > 0 && contacts_.has(s.held[0]);
    const dvec3 felt = is_held ? s.proxy + contacts_.arm_of(s.held[0]) : s.proxy;
    TickOutput output =
        coupler_.couple(input, geometry, feel_at(*volume, field.index_of(felt), q),
                        field.voxel_mm(), [&](dvec3 p) { return contacts_.is_free(p); });
    if (s.touching)
        output.torque_nm = torque_of(output.force_n);
    s.proxy = geometry.proxy_mm;
    s.touching = geometry.touching;
    s.stamps = contacts_.stamps_about(s.proxy);
    return output;
}

} // namespace

std::unique_ptr<Algorithm> make_swept_tool() {
    return std::make_unique<SweptTool>();
}

} // namespace palpate::haptics
