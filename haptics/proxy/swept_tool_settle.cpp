#include <algorithm>

#include "haptics/proxy/swept_tool_course.h"

namespace palpate::haptics::swept_tool {

namespace {

constexpr double kConverged_mm = 2e-4;
// Steps that have got so short by turning back, in samples, are not worth another look: 0.002 N at
// 500 N/m and 0.4 mm.
constexpr double kShortest = 0.01;
// At every sample, in a tick: those that settle it on bumps that hold it in turn, and for each half
// sample that it has to go as many as a way along a surface, to and fro across the straight one,
// has.
constexpr uint32_t kLooks = 5, kLooksOnWay = 4;
// In samples: within so much of a look nothing new is expected.
constexpr double kSeen = 0.1;

} // namespace

Course SweptTool::course_to(dvec3 goal, double moved_mm, const Geometry& geometry) const {
    const State& s = state_;
    const double half_sample_mm = 0.5 * voxel_mm();
    // The steps begin as short as those of the last tick, if they turned back and got short.
    const double trust_mm = geometry.was_replaced
                                ? half_sample_mm
                                : std::min(half_sample_mm, 4.0 * s.trust_mm + 2.0 * moved_mm);
    const double way_mm = s.is_behind ? glm::distance(goal, s.proxy) : moved_mm;
    const double on_way = std::min(1e6, kLooksOnWay * way_mm / half_sample_mm);
    return {.goal = goal,
            .moved_mm = moved_mm,
            .half_sample_mm = half_sample_mm,
            .trust_mm = trust_mm,
            .most_looks = kLooks + static_cast<uint32_t>(on_way)};
}

// Goes as far as blocks are clear, if nothing holds the tool.
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
    c.is_out = true;
    c.has_settled = leap == length;
    return true;
}

// To what of all places that no contact forbids is nearest to the goal.
dvec3 SweptTool::wanted_step(dvec3 goal) const {
    const std::span<const Hold> holds = contacts_.holds();
    std::array<Plane, ToolContacts::kMost> planes;
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

// Shortens the part of a step across the hand's push, which leads along the surface, to what is
// worth going. The step leads out of material all the same.
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

// How far it may go from a look that left samples out. Where none is in material, and what held it
// was looked at, as far as the hand did: what was left out lies farther out than what was not.
double SweptTool::unseen_mm(const Course& c) const {
    const ToolContacts::Look& look = contacts_.look();
    const auto contacts = contacts_.holds();
    const bool has_seen = std::any_of(contacts.begin(), contacts.end(),
                                      [](const Hold& hold) { return !hold.is_pushed; });
    const bool may_follow = has_seen && !look.any_inside;
    return std::max(kSeen * voxel_mm(), may_follow ? c.moved_mm : 0.0);
}

// Contacts that held it on this step, or nearly did, are looked at again.
void SweptTool::remember_holds(Course& c, dvec3 step, Geometry& geometry) {
    State& s = state_;
    s.held_count = 0;
    c.touching = false;
    dvec3 push(0.0);
    geometry.confidence = 1.0;
    for (const Hold& hold : contacts_.holds()) {
        const double left = hold.clearance_mm + glm::dot(hold.normal, step);
        if (left > 4.0 * c.half_sample_mm)
            continue;
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
    contacts_.find(s.proxy, {.held = held(), .goal_mm = c.goal, .all = looked});
    const ToolContacts::Look& look = contacts_.look();
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
        return Next::stop;
    }
    const bool is_buried =
        look.any_flat && !look.any_sloped && (geometry.was_replaced || s.catching_up_s > 0.0);
    if ((is_buried || has_none) && look.any_inside && s.normal != dvec3(0.0))
        contacts_.add({{0, -s.normal}, s.normal, -c.half_sample_mm, -c.half_sample_mm, 0.5});
    const bool deep = contacts_.is_deep();
    // The deepest come first: where work ended before any of them, nothing is known of it.
    const bool knows = looked && (!look.is_spent || look.any_sloped || look.any_flat);
    c.is_out |= knows && !contacts_.is_sunk();
    if (knows && !deep) {
        c.good = s.proxy;
        c.since_look_mm = 0.0;
    }
    // The tool goes out of a place where it is deep, and on from there.
    dvec3 step = wanted_step(deep ? s.proxy : c.goal);
    c.rest = deep ? std::nullopt : std::optional(s.proxy + step);
    if (!deep && !has_none) {
        step = tempered(step, c);
    } else {
        c.last_along.reset();
        s.gain = {};
    }
    // Between surfaces that bend, planes of one place are wrong at the next: where a step takes
    // back the last, steps get shorter.
    c.trust_mm = glm::dot(step, c.last_step) < 0.0 ? 0.5 * c.trust_mm
                                                   : std::min(c.half_sample_mm, 2.0 * c.trust_mm);
    if (look.is_spent && !deep)
        c.trust_mm = std::min(c.trust_mm, unseen_mm(c));
    const double wanted = glm::length(step), length = std::min(wanted, c.trust_mm);
    if (wanted > c.trust_mm)
        step *= c.trust_mm / wanted;
    c.last_step = step;
    s.proxy += step;
    remember_holds(c, step, geometry);
    c.has_settled = length < kConverged_mm && looked;
    c.since_look_mm += length;
    c.look = length < kConverged_mm || c.since_look_mm > kSeen * voxel_mm();
    const bool is_at_end = c.has_settled || c.trust_mm < kShortest * voxel_mm();
    return is_at_end ? Next::stop : Next::go_on;
}

// Rather behind the hand than where it was not looked at. The next tick goes on from there, with
// what this one has filtered.
void SweptTool::fall_behind(Course& c) {
    State& s = state_;
    if (c.good && c.since_look_mm > kSeen * voxel_mm())
        s.proxy = *c.good;
    c.touching |= !contacts_.holds().empty();
    if (c.touching && s.proxy != c.goal)
        s.normal = unit_or_zero(s.proxy - c.goal);
}

// To where a tool rests that is drawn to the goal, in as many steps as the work of a tick allows.
void SweptTool::settle(Course& c, Geometry& geometry) {
    State& s = state_;
    for (; c.looks < c.most_looks; ++c.steps) {
        c.is_spent = c.steps > 0 && contacts_.is_spent();
        if (c.is_spent)
            break;
        if (try_leap(c)) {
            if (c.has_settled)
                break;
            continue;
        }
        if (look_and_step(c, c.steps == 0, geometry) == Next::stop)
            break;
    }
    if (c.is_spent)
        fall_behind(c);
    if (!c.has_learnt && !c.has_settled)
        s.gain.doubt();
    s.trust_mm = c.trust_mm;
    geometry.iterations = c.steps;
}

} // namespace palpate::haptics::swept_tool
