#include "haptics/proxy/swept_tool.h"

#include <algorithm>
#include <array>

#include "haptics/proxy/coupler.h"
#include "haptics/proxy/planes.h"
#include "haptics/proxy/sphere_samples.h"
#include "haptics/proxy/sweep.h"
#include "haptics/proxy/tool_points.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr uint32_t kMostContacts = 24;
constexpr double kSameWay = 0.98;        // cosine of 11 degrees
constexpr uint32_t kMostConsidered = 16; // samples in material, at each look
constexpr uint32_t kMostIterations = 24;
constexpr uint32_t kMostLooks = 5; // at every sample, in a tick
// What a tick may spend on contacts, in tenths of a microsecond: on each that is looked at, and on
// the samples that have to be filtered for it. Those that held the tool may take twice as much.
// What is left undone: of the samples in material the shallower ones are not looked at, and the
// tick ends with the step that the others allow. The next tick goes on with what was made.
constexpr uint32_t kMostWork = 170, kContactWork = 4, kSamplesOfWork = 40;
constexpr double kConverged_mm = 2e-4;
// Steps that have got so short by turning back, in samples, are not worth another look: 0.002 N at
// 500 N/m and 0.4 mm.
constexpr double kShortest = 0.01;
// A sample is deep in material where its value is so much of the contrast above the iso-value: 0.05
// samples on an edge blurred by 0.7, which rises by 0.57 a sample.
constexpr double kDeep = 0.03;
constexpr double kFlat = 0.004; // slope across a sample, as a share of the contrast

struct Hold {
    uint32_t sample = 0;
    dvec3 normal{0.0};
    double clearance_mm = 0.0; // negative: in material
    double confidence = 1.0;
};

struct State : Felt {
    // What was exchanged has moved the tool, and it is not yet where that ends.
    bool is_catching_up = false;
    // The hand has moved by more than a tenth of a sample in a tick, and the tool is not yet there.
    bool is_fast = false;
    dvec3 goal{0.0};
    uint32_t held_count = 0; // samples that held the tool in the tick before
    std::array<uint32_t, kMostContacts> held{};
};

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
    void find_contacts(dvec3 at, bool all);
    bool consider(dvec3 at, uint32_t sample); // false where it has no slope
    bool look_deep(dvec3 at);
    bool is_deep() const { return deepest_ > kDeep * field_.contrast(); }
    uint32_t work() const {
        return kContactWork * considered_ + field_.filtered_samples() / kSamplesOfWork;
    }
    void settle(dvec3 goal, Geometry& geometry);

    State state_;
    Coupler coupler_;
    uint32_t count_ = 0;
    double reach_mm_ = 0.0; // of the farthest point
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
    bool any_flat_ = false, any_sloped_ = false; // of the samples in material that it considered
    double deepest_ = 0.0;    // value above the iso-value of the deepest sample, at the last look
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

// The samples that are in material, in inside_. Most are not near any for many ticks.
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
                               inside_.data());
}

bool SweptTool::look_deep(dvec3 at) {
    const uint32_t inside = solid_points(at);
    deepest_ = 0.0;
    for (uint32_t k = 0; k < inside; ++k)
        deepest_ = std::max(deepest_, double{inside_[k].value});
    return is_deep();
}

bool SweptTool::is_free(dvec3 at) {
    return solid_points(at) == 0;
}

bool SweptTool::consider(dvec3 at, uint32_t sample) {
    ++considered_;
    const dvec3 p = at + points_[sample];
    const auto [sharp, smooth] = field_.both(p);
    const double floor = kFlat * field_.contrast() / field_.voxel_mm();
    Hold found{.sample = sample};
    const double slope = glm::length(smooth.gradient);
    if (slope < floor)
        return false;
    found.normal = -smooth.gradient / slope;
    // How steep the sharp field falls along that normal; no less than half the smooth one, so that
    // a flat place of it does not throw the tool out.
    const double fall = std::max(-glm::dot(sharp.gradient, found.normal), 0.5 * slope);
    found.clearance_mm = std::clamp((field_.iso() - sharp.value) / fall, -2.0 * field_.voxel_mm(),
                                    2.0 * field_.voxel_mm());
    found.confidence = std::min(1.0, slope / (4.0 * floor));
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
    else if (found.clearance_mm < place->clearance_mm)
        *place = found;
    return true;
}

void SweptTool::find_contacts(dvec3 at, bool all) {
    contact_count_ = 0;
    any_inside_ = any_flat_ = any_sloped_ = is_spent_ = false;
    for (uint32_t i = 0; i < state_.held_count; ++i)
        if (state_.held[i] < count_ && work() <= 2 * kMostWork)
            consider(at, state_.held[i]);
    if (!all)
        return;
    const uint32_t inside = solid_points(at);
    any_inside_ = inside > 0;
    // The deepest of them say enough: the others follow when these are out.
    const auto is_deeper = [](const Field::Inside& a, const Field::Inside& b) {
        return a.value > b.value || (a.value == b.value && a.point < b.point);
    };
    const auto end = inside_.begin() + inside;
    const auto last = inside_.begin() + std::min(inside, kMostConsidered);
    std::partial_sort(inside_.begin(), last, end, is_deeper);
    deepest_ = inside > 0 ? double{inside_.front().value} : 0.0;
    for (auto at_hand = inside_.begin(); at_hand != last; ++at_hand) {
        is_spent_ = work() > kMostWork;
        if (is_spent_)
            return;
        (consider(at, at_hand->point) ? any_sloped_ : any_flat_) = true;
    }
}

void SweptTool::settle(dvec3 goal, Geometry& geometry) {
    State& s = state_;
    const dvec3 start = s.proxy;
    const double most = 0.5 * field_.voxel_mm();
    std::array<Plane, kMostContacts> planes;
    bool touching = false, look = true, has_settled = false;
    uint32_t i = 0, looks = 0;
    double since_look = 0.0, trust = most;
    dvec3 last_step(0.0), safe = start;
    bool has_safe = false;
    for (; i < kMostIterations && looks < kMostLooks; ++i) {
        if (s.held_count == 0) {
            // Nothing holds it: leaps as far as blocks are clear.
            const dvec3 way = goal - s.proxy;
            const double length = glm::length(way);
            const double leap = std::min(length, 16.0 * field_.voxel_mm());
            const dvec3 next = length > 0.0 ? s.proxy + (leap / length) * way : goal;
            if (is_clear(s.proxy, next)) {
                s.proxy = leap == length ? goal : next;
                has_settled = leap == length;
                if (has_settled)
                    break;
                continue;
            }
        }
        // Every sample is looked at before the first step, after each long one, and at the end.
        looks += look;
        const bool looked = look;
        find_contacts(s.proxy, look);
        if (is_spent_ && contact_count_ == 0 && !any_flat_) { // nothing was looked at yet
            touching = i == 0 && s.touching;
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
            contacts_[contact_count_++] = {0, s.normal, -most, 0.5};
        if (looked && !is_deep()) {
            safe = s.proxy;
            has_safe = true;
        }
        for (uint32_t k = 0; k < contact_count_; ++k)
            planes[k] = {contacts_[k].normal,
                         glm::dot(contacts_[k].normal, s.proxy) - contacts_[k].clearance_mm};
        const Projection target = project_to_planes(goal, {planes.data(), contact_count_});
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
        trust = glm::dot(step, last_step) < 0.0 ? 0.5 * trust : std::min(most, 2.0 * trust);
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
            s.held[s.held_count++] = contacts_[k].sample;
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
        if (is_spent_ || has_settled || trust < kShortest * field_.voxel_mm())
            break;
        since_look = looked ? length : since_look + length;
        look = length < kConverged_mm || since_look > 0.1 * field_.voxel_mm();
    }
    s.is_fast |= glm::distance(goal, s.goal) > 0.2 * most;
    s.is_fast &= !has_settled;
    s.goal = goal;
    if (s.is_fast && has_safe) {
        // The last steps of a fast hand were not looked at: where they lead into material, back to
        // half of their way, a quarter, an eighth, or none of it. Rather behind the hand than in
        // material.
        const dvec3 way = s.proxy - safe;
        for (int half = 0; half < 4 && look_deep(s.proxy); ++half)
            s.proxy = half < 3 ? safe + std::exp2(-1.0 - half) * way : safe;
    }
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
    // Values, not straightened steps: these make the middle of a thin wall shallow, and a tool
    // steps into a wall before it is pushed out.
    field_.follow(*volume, q.source, q.iso, q.normal_blur_samples);
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
        s.held_count > 0 && s.held[0] < count_ ? s.proxy + points_[s.held[0]] : s.proxy;
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
            arm += share * points_[contacts_[k].sample];
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
