#include "haptics/proxy/swept_tool.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "haptics/proxy/coupler.h"
#include "haptics/proxy/planes.h"
#include "haptics/proxy/sphere_samples.h"
#include "haptics/proxy/sweep.h"
#include "haptics/proxy/tool_points.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr uint32_t kMostContacts = 24;
constexpr double kSameWay = 0.995; // cosine of 6 degrees
// Samples that are looked at each time: the deepest in material. So many of those that are nearly
// in it, too, by this share of the contrast: a body that bulges is touched before any is inside.
constexpr uint32_t kMostConsidered = 16, kLeastConsidered = 3;
constexpr double kNear = 0.06;
constexpr uint32_t kMostIterations = 24;
constexpr uint32_t kMostLooks = 5; // at every sample, in a tick
// What a tick may spend on contacts, in tenths of a microsecond: on each that is looked at, and on
// the samples that have to be filtered for it. Those that held the tool may take twice as much.
// What is left undone: of the samples in material the shallower ones are not looked at, and the
// tick ends with a step that the others allow, or where all that held the tool were last looked at.
// The next tick goes on with what was made.
constexpr uint32_t kMostWork = 120, kContactWork = 4, kSamplesOfWork = 40;
constexpr double kConverged_mm = 2e-4;
// Steps that have got so short by turning back, in samples, are not worth another look: 0.002 N at
// 500 N/m and 0.4 mm.
constexpr double kShortest = 0.01;
// All in samples. A place is deep where a contact is so far in material, and farther in noise: for
// each sample that normals are blurred by. A hand is fast that goes so far in a tick; then the tool
// goes back to the last place that was not deep from one that was not looked at. Within so much of
// a look nothing new is expected.
constexpr double kDeep = 0.025, kDeepInNoise = 0.15, kFast = 0.3, kSeen = 0.1;
// After each time that it goes back the longest step is half as long, down to this share of it:
// then it goes on, whatever is there.
constexpr double kShortestShare = 0.1;
// In noise: so much of the sharp value, for each sample of blur, is the smooth one instead.
constexpr double kSmoothShare = 0.5;
constexpr double kFlat = 0.004; // slope across a sample, as a share of the contrast
// How far a ball's contact turns towards where it faces the surface, at each look. On a body that
// bends by 1/r all of it is 1 / (1 + R/r) of what its normal says: 1 on a plane, 0.6 on the edges
// of a body that R has two thirds of, more in hollows.
constexpr double kTurn = 0.7;
constexpr double kCover = 0.65;  // how far from all samples it may lie, in distances between them
constexpr double kFacing = 0.96; // cosine of 16 degrees, within which its plane is that of a ball

// A place on the tool: one of its samples or, on a ball, the direction of any.
struct Touch {
    uint32_t sample = 0;
    dvec3 way{0.0};
};

struct Hold {
    Touch touch;
    dvec3 normal{0.0};
    double clearance_mm = 0.0; // negative: in material
    double seen_mm = 0.0;      // of the place itself, before a ball turns to face what is there
    double confidence = 1.0;
};

struct State : Felt {
    // What was exchanged has moved the tool, and it is not yet where that ends.
    bool is_catching_up = false;
    bool is_fast = false; // the hand was, and the tool is not yet where it belongs
    dvec3 goal{0.0};
    double longest_step = 1.0; // as a share of half a sample
    double trust_mm = 1e3;     // of the last step
    uint32_t held_count = 0;   // places that held the tool in the tick before
    std::array<Touch, kMostContacts> held{};
};

bool is_inside(const Field::Inside& sample) {
    return sample.value >= 0.0f;
}

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
    void place_points(const TickInput& input);
    bool is_clear(dvec3 from, dvec3 to) const;
    uint32_t solid_points(dvec3 at);
    bool is_free(dvec3 at);
    // Of those that held it; `all`: and of every sample that is in material now.
    // Stops where work is spent before all that held it were looked at, though never at the first
    // look of a tick.
    void find_contacts(dvec3 at, bool all, bool is_first);
    bool consider(dvec3 at, Touch touch); // false where it has no slope
    void face(Hold& found) const;
    dvec3 arm_of(const Touch& touch) const {
        return is_ball_ ? reach_mm_ * touch.way : points_[touch.sample];
    }
    Touch touch_of(uint32_t sample) const {
        return {sample, is_ball_ ? points_[sample] / reach_mm_ : dvec3(0.0)};
    }
    bool is_deep() const;
    uint32_t work() const {
        return kContactWork * considered_ + field_.filtered_samples() / kSamplesOfWork;
    }
    void settle(dvec3 goal, Geometry& geometry);

    State state_;
    Coupler coupler_;
    uint32_t count_ = 0;
    double reach_mm_ = 0.0; // of the farthest point
    bool is_ball_ = false;
    // Of a ball: how far from its samples places lie, and the cosine of that.
    double cover_angle_ = 0.0, cover_ = 0.0;
    SphereSamples sphere_;
    std::array<dvec3, SphereSamples::kMost> points_;      // about the tool's origin, world axes
    std::array<glm::vec3, SphereSamples::kMost> offsets_; // the same in index space
    double reach_samples_ = 0.0;                          // of the farthest offset, on any axis
    // What points_ were made of.
    const ToolPoints* made_of_ = nullptr;
    uint64_t made_in_version_ = 0, made_in_settings_ = 0;
    glm::dquat made_turn_{0.0, 0.0, 0.0, 0.0};
    double made_radius_mm_ = -1.0;
    uint32_t made_samples_ = 0;
    // The points that may be in material while the tool is within a sample of near_at_.
    uint32_t near_count_ = 0;
    uint64_t near_samples_ = 0; // of Field::samples_about
    dvec3 near_at_{0.0};
    std::array<uint16_t, SphereSamples::kMost> near_;
    uint32_t contact_count_ = 0;
    std::array<Hold, kMostContacts> contacts_;
    bool any_inside_ = false, is_spent_ = false; // at the last look, and whether work was spent;
    bool has_left_out_ = false;                  // of those that held it, for want of work;
    bool any_flat_ = false, any_sloped_ = false; // of the samples in material that it considered
    double blur_samples_ = 0.0;                  // of normals, against noise
    bool is_labels_ = false;
    uint32_t considered_ = 0; // contacts, in this tick
    std::array<Field::Inside, SphereSamples::kMost> inside_;
    Field field_;
};

void SweptTool::place_points(const TickInput& input) {
    const TouchParameters& q = *input.parameters;
    const ToolPoints* tool = input.scene->tool.get();
    if (tool && tool->points_mm.empty())
        tool = nullptr;
    if (tool == made_of_ &&
        (!tool ||
         (input.scene->version == made_in_version_ && input.tool.rotation == made_turn_)) &&
        q.tool_radius_mm == made_radius_mm_ && q.tool_samples == made_samples_ &&
        field_.settings() == made_in_settings_)
        return;
    made_of_ = tool;
    made_in_version_ = input.scene->version;
    made_turn_ = input.tool.rotation;
    made_radius_mm_ = q.tool_radius_mm;
    made_samples_ = q.tool_samples;
    made_in_settings_ = field_.settings();
    near_samples_ = 0;
    reach_mm_ = 0.0;
    is_ball_ = !tool && q.tool_radius_mm > 0.0;
    if (tool) {
        const glm::dmat3 turn = glm::mat3_cast(glm::normalize(input.tool.rotation));
        count_ = static_cast<uint32_t>(std::min<size_t>(tool->points_mm.size(), points_.size()));
        for (uint32_t i = 0; i < count_; ++i) {
            points_[i] = turn * tool->points_mm[i];
            reach_mm_ = std::max(reach_mm_, glm::length(points_[i]));
        }
    } else if (q.tool_radius_mm == 0.0) {
        count_ = 1;
        points_[0] = dvec3(0.0);
    } else {
        const auto directions = sphere_.directions(q.tool_samples);
        count_ = static_cast<uint32_t>(directions.size());
        reach_mm_ = q.tool_radius_mm;
        cover_angle_ =
            std::min(kCover * std::sqrt(4.0 * std::numbers::pi / count_), std::numbers::pi);
        cover_ = std::cos(cover_angle_);
        for (uint32_t i = 0; i < count_; ++i)
            points_[i] = q.tool_radius_mm * directions[i];
    }
    glm::vec3 most(0.0f);
    for (uint32_t i = 0; i < count_; ++i) {
        offsets_[i] = field_.offset_of(points_[i]);
        most = glm::max(most, glm::abs(offsets_[i]));
    }
    reach_samples_ = std::max({most.x, most.y, most.z});
}

bool SweptTool::is_clear(dvec3 from, dvec3 to) const {
    return field_.is_clear(glm::min(from, to) - reach_mm_, glm::max(from, to) + reach_mm_, 0.0);
}

// The samples that are in material or nearly so, in inside_. Most are not near any for many ticks.
uint32_t SweptTool::solid_points(dvec3 at) {
    const std::span<const glm::vec3> offsets(offsets_.data(), count_);
    const glm::vec3 moved = glm::abs(field_.offset_of(at - near_at_));
    const bool is_far = !(std::max({moved.x, moved.y, moved.z}) <= 0.99f);
    if (is_far || near_samples_ != field_.samples_about(near_at_, reach_samples_)) {
        near_count_ = field_.near_points(at, offsets, reach_samples_, near_.data());
        near_at_ = at;
        near_samples_ = field_.samples_about(at, reach_samples_);
    }
    return field_.solid_points(at, offsets, reach_samples_, {near_.data(), near_count_},
                               static_cast<float>(kNear * field_.contrast()), inside_.data());
}

bool SweptTool::is_deep() const {
    double least = 0.0;
    for (uint32_t k = 0; k < contact_count_; ++k)
        least = std::min(least, contacts_[k].clearance_mm);
    return least < -(kDeep + kDeepInNoise * blur_samples_) * field_.voxel_mm();
}

bool SweptTool::is_free(dvec3 at) {
    const uint32_t count = solid_points(at);
    return std::none_of(inside_.begin(), inside_.begin() + count, is_inside);
}

// A ball is nearest to a surface where it faces it, between its samples: part of the way there. The
// rest follows when it is looked at again. Where that is another sample's place, and nothing holds
// that, the contact becomes its; else it stays, so that the contacts of a ball that fits a hollow
// stay spread over it.
void SweptTool::face(Hold& found) const {
    const double facing = -glm::dot(found.normal, found.touch.way);
    const dvec3 way = unit_or_zero(glm::mix(found.touch.way, -found.normal, kTurn));
    uint32_t sample = found.touch.sample;
    if (glm::dot(way, points_[sample]) < cover_ * reach_mm_) {
        sample = sphere_.nearest(way, 2.0 * cover_angle_);
        for (uint32_t i = 0; i < contact_count_; ++i)
            if (contacts_[i].touch.sample == sample)
                return;
        found.touch.sample = sample;
    }
    found.touch.way = way;
    if (facing > kFacing) {
        found.normal = -way;
        found.clearance_mm -= kTurn * reach_mm_ * (1.0 - facing);
    }
}

bool SweptTool::consider(dvec3 at, Touch touch) {
    ++considered_;
    const dvec3 p = at + arm_of(touch);
    auto [sharp, smooth] = field_.both(p);
    if (!is_labels_) { // a tool of samples rests on bumps, and noise is half of them in the mean
        const double share = kSmoothShare * blur_samples_;
        sharp.value += share * (smooth.value - sharp.value);
        sharp.gradient += share * (smooth.gradient - sharp.gradient);
    }
    const double floor = kFlat * field_.contrast() / field_.voxel_mm();
    Hold found{.touch = touch};
    const double slope = glm::length(smooth.gradient);
    if (slope < floor || field_.is_buried(sharp.value))
        return false;
    found.normal = -smooth.gradient / slope;
    // How steep the sharp field falls along that normal; no less than half the smooth one, so that
    // a flat place of it does not throw the tool out.
    const double fall = std::max(-glm::dot(sharp.gradient, found.normal), 0.5 * slope);
    found.clearance_mm = std::clamp((field_.iso() - sharp.value) / fall, -2.0 * field_.voxel_mm(),
                                    2.0 * field_.voxel_mm());
    found.confidence = std::min(1.0, slope / (4.0 * floor));
    found.seen_mm = found.clearance_mm;
    if (is_ball_)
        face(found);
    // Of contacts that face the same way the deepest says it all. When there is room for no other,
    // the shallowest goes.
    Hold* place = nullptr;
    for (uint32_t i = 0; i < contact_count_ && !place; ++i)
        if (glm::dot(contacts_[i].normal, found.normal) > kSameWay)
            place = &contacts_[i];
    if (!place && contact_count_ == kMostContacts)
        place = std::max_element(
            contacts_.begin(), contacts_.end(),
            [](const Hold& a, const Hold& b) { return a.clearance_mm < b.clearance_mm; });
    if (!place)
        contacts_[contact_count_++] = found;
    else if (found.seen_mm < place->seen_mm)
        *place = found;
    return true;
}

void SweptTool::find_contacts(dvec3 at, bool all, bool is_first) {
    contact_count_ = 0;
    any_inside_ = any_flat_ = any_sloped_ = is_spent_ = has_left_out_ = false;
    for (uint32_t i = 0; i < state_.held_count; ++i) {
        has_left_out_ = !is_first && work() > 2 * kMostWork;
        if (has_left_out_)
            return;
        if (state_.held[i].sample < count_)
            consider(at, state_.held[i]);
    }
    if (!all)
        return;
    const uint32_t count = solid_points(at);
    const auto inside =
        static_cast<uint32_t>(std::count_if(inside_.begin(), inside_.begin() + count, is_inside));
    any_inside_ = inside > 0;
    // The deepest of them say enough: the others follow when these are out. And where a body
    // bulges between its samples, a tool touches before any of its own are in material.
    const auto is_deeper = [](const Field::Inside& a, const Field::Inside& b) {
        return a.value > b.value || (a.value == b.value && a.point < b.point);
    };
    const auto end = inside_.begin() + count;
    const auto last =
        inside_.begin() + std::min({count, kMostConsidered, std::max(inside, kLeastConsidered)});
    std::partial_sort(inside_.begin(), last, end, is_deeper);
    for (auto at_hand = inside_.begin(); at_hand != last; ++at_hand) {
        is_spent_ = work() > kMostWork;
        if (is_spent_)
            return;
        const bool has_slope = consider(at, touch_of(at_hand->point));
        if (is_inside(*at_hand))
            (has_slope ? any_sloped_ : any_flat_) = true;
    }
}

void SweptTool::settle(dvec3 goal, Geometry& geometry) {
    State& s = state_;
    const dvec3 start = s.proxy;
    const double moved_mm = glm::distance(goal, s.goal);
    s.is_fast |= moved_mm > kFast * field_.voxel_mm();
    s.goal = goal;
    const double most = 0.5 * field_.voxel_mm(), longest = s.longest_step * most;
    std::array<Plane, kMostContacts> planes;
    bool touching = false, look = true, has_settled = false, is_unseen = false;
    uint32_t i = 0, looks = 0;
    double since_look = 0.0;
    // Where the last tick's steps turned back and got short, this one's begin as short.
    double trust = longest;
    if (!geometry.was_replaced)
        trust = std::min(longest, 4.0 * s.trust_mm + 2.0 * moved_mm);
    // Where all were looked at and none was deep; from what was not looked at it goes back there.
    dvec3 good = start, last_step(0.0);
    bool has_good = false;
    for (; i < kMostIterations && looks < kMostLooks; ++i) {
        if (s.held_count == 0) {
            // Nothing holds it: leaps as far as blocks are clear.
            const dvec3 way = goal - s.proxy;
            const double length = glm::length(way);
            const double leap = std::min(length, 16.0 * field_.voxel_mm());
            const dvec3 next = length > 0.0 ? s.proxy + (leap / length) * way : goal;
            if (is_clear(s.proxy, next)) {
                s.proxy = leap == length ? goal : next;
                good = s.proxy;
                has_good = true;
                has_settled = leap == length;
                if (has_settled)
                    break;
                continue;
            }
        }
        // Every sample is looked at before the first step, after each long one, and at the end.
        looks += look;
        const bool looked = look;
        find_contacts(s.proxy, look, i == 0);
        if (has_left_out_) // it stays where all of them were looked at
            break;
        if (is_spent_ && contact_count_ == 0 && !any_flat_) { // nothing was looked at yet
            touching = i == 0 && s.touching;
            is_unseen = has_good;
            break;
        }
        if (any_inside_ && contact_count_ == 0 && s.normal == dvec3(0.0)) {
            // So deep that nothing has a slope, and no way out is known.
            geometry.submerged = true;
            s.proxy = goal;
            break;
        }
        const bool is_buried =
            any_flat_ && !any_sloped_ && (geometry.was_replaced || s.is_catching_up);
        if ((is_buried || contact_count_ == 0) && any_inside_ && s.normal != dvec3(0.0) &&
            contact_count_ < kMostContacts)
            contacts_[contact_count_++] = {{0, -s.normal}, s.normal, -most, -most, 0.5};
        const bool deep = is_deep();
        // The deepest come first: where work ended before any of them, nothing is known of it.
        const bool knows = looked && (!is_spent_ || any_sloped_ || any_flat_);
        is_unseen = is_unseen && (!knows || deep);
        if (knows && !deep) {
            good = s.proxy;
            has_good = true;
        }
        if (is_unseen && is_spent_ && s.is_fast && has_good)
            break;
        for (uint32_t k = 0; k < contact_count_; ++k)
            planes[k] = {contacts_[k].normal,
                         glm::dot(contacts_[k].normal, s.proxy) - contacts_[k].clearance_mm};
        // Where it is deep it goes out, and on from there.
        const Projection target =
            project_to_planes(deep ? s.proxy : goal, {planes.data(), contact_count_});
        dvec3 step = target.point - s.proxy;
        if (!target.is_feasible) {
            // Wedged: out of what is deepest, as far as its opponents allow.
            step = dvec3(0.0);
            for (uint32_t k = 0; k < contact_count_; ++k)
                step -= std::min(0.0, contacts_[k].clearance_mm) * contacts_[k].normal /
                        static_cast<double>(contact_count_);
        }
        // Between surfaces that bend, planes of one place are wrong at the next: where a step takes
        // back the last, steps get shorter.
        trust = glm::dot(step, last_step) < 0.0 ? 0.5 * trust : std::min(longest, 2.0 * trust);
        if (is_spent_ && !deep)
            trust = std::min(trust, kSeen * field_.voxel_mm());
        const double wanted = glm::length(step), length = std::min(wanted, trust);
        if (wanted > trust)
            step *= trust / wanted;
        last_step = step;
        s.proxy += step;
        // Those that held it, or nearly do, are looked at again.
        s.held_count = 0;
        touching = false;
        dvec3 push(0.0);
        geometry.confidence = 1.0;
        for (uint32_t k = 0; k < contact_count_; ++k) {
            const double left = contacts_[k].clearance_mm + glm::dot(contacts_[k].normal, step);
            // What has held it in this tick may hold it again.
            if (left > 4.0 * most)
                continue;
            s.held[s.held_count++] = contacts_[k].touch;
            if (left < 1e-6 && glm::dot(contacts_[k].normal, goal - s.proxy) < 0.0) {
                touching = true;
                push += contacts_[k].normal;
                geometry.confidence = std::min(geometry.confidence, contacts_[k].confidence);
            }
        }
        if (touching)
            s.normal = unit_or_zero(s.proxy - goal) == dvec3(0.0) ? unit_or_zero(push)
                                                                  : unit_or_zero(s.proxy - goal);
        has_settled = length < kConverged_mm && looked;
        since_look = looked ? length : since_look + length;
        is_unseen = since_look > kSeen * field_.voxel_mm();
        if (is_spent_ || has_settled || trust < kShortest * field_.voxel_mm())
            break;
        look = length < kConverged_mm || is_unseen;
    }
    // Rather behind the hand than in material. What led there is tried again in shorter steps.
    const bool goes_back = is_unseen && has_good && s.is_fast && s.longest_step > kShortestShare;
    if (goes_back) {
        s.proxy = good;
        touching |= contact_count_ > 0;
        if (touching && s.proxy != goal)
            s.normal = unit_or_zero(s.proxy - goal);
    }
    s.is_fast &= !has_settled;
    s.trust_mm = trust;
    s.longest_step = goes_back ? 0.5 * s.longest_step : std::min(1.0, 4.0 * s.longest_step);
    geometry.iterations = i;
    geometry.contacts = s.held_count;
    const bool was_catching_up = s.is_catching_up;
    s.is_catching_up = (geometry.was_replaced || was_catching_up) && !has_settled;
    geometry.was_replaced |= was_catching_up;

    // Friction: the proxy stays behind by as much as the cone allows.
    const Feel& feel = coupler_.feel();
    const double friction = s.slipping ? feel.friction_dynamic : feel.friction_static;
    if (touching && s.touching && friction > 0.0) {
        const double depth = std::max(0.0, glm::distance(s.proxy, goal) - coupler_.yielded_mm());
        dvec3 moved = s.proxy - start;
        moved -= glm::dot(moved, s.normal) * s.normal;
        const double across = glm::length(moved);
        const double back = std::min(across, friction * depth);
        s.slipping = across > friction * depth + 1e-6;
        if (back > 0.0) {
            const dvec3 held = s.proxy - (back / across) * moved;
            if (is_free(held))
                s.proxy = held;
        }
    } else {
        s.slipping = glm::distance(s.proxy, start) > 1e-5;
    }
    s.touching = touching;
}

TickOutput SweptTool::tick(const TickInput& input) noexcept {
    State& s = state_;
    const TouchParameters& q = *input.parameters;
    const std::optional<Volume>& volume = Felt::volume_of(input);
    const glm::dquat turn = input.tool.rotation;
    const double turn_length = glm::dot(turn, turn);
    if (!is_sane(input) || !volume || !(turn_length > 0.25 && turn_length < 4.0))
        return coupler_.unknown();
    field_.follow(*volume, q);
    blur_samples_ = q.normal_blur_samples;
    is_labels_ = q.source == TouchSource::labels;
    place_points(input);
    const dvec3 x = input.tool.position_mm;
    considered_ = 0;
    Geometry geometry;
    geometry.was_replaced = s.exchange(input, *volume);
    settle(x, geometry);
    geometry.proxy_mm = s.proxy;
    geometry.touching = s.touching;
    geometry.normal = s.normal;
    geometry.lacks_data = field_.lacked_brick();
    const dvec3 felt =
        s.held_count > 0 && s.held[0].sample < count_ ? s.proxy + arm_of(s.held[0]) : s.proxy;
    TickOutput output = coupler_.couple(input, geometry, feel_at(*volume, field_.index_of(felt), q),
                                        field_.voxel_mm(), [&](dvec3 p) { return is_free(p); });
    // Each contact's share of the force is what its normal carries; it acts at its sample.
    if (s.touching) {
        double total = 0.0;
        dvec3 arm(0.0);
        for (uint32_t k = 0; k < contact_count_; ++k) {
            const double share = std::max(0.0, glm::dot(contacts_[k].normal, output.force_n));
            if (contacts_[k].clearance_mm > 0.1 * field_.voxel_mm())
                continue;
            total += share;
            arm += share * arm_of(contacts_[k].touch);
        }
        if (total > 0.0)
            output.torque_nm = 1e-3 * glm::cross(arm / total, output.force_n);
    }
    s.proxy = geometry.proxy_mm;
    s.touching = geometry.touching;
    return output;
}

} // namespace

std::unique_ptr<Algorithm> make_swept_tool() {
    return std::make_unique<SweptTool>();
}

} // namespace palpate::haptics
