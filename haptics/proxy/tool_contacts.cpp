#include "haptics/proxy/tool_contacts.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptics/proxy/coupling.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr double kSameWay = 0.995; // cosine of 6 degrees
// Samples that are looked at each time: the deepest in material. So many of those that are nearly
// in it, too, by this share of the contrast: a body that bulges is touched before any is inside.
constexpr uint32_t kMostConsidered = 16, kLeastConsidered = 3;
constexpr double kNear = 0.06;
// What a tick may spend on contacts, in tenths of a microsecond: on each that is looked at, and on
// the samples that have to be filtered for it. Those that held the tool may take twice as much.
// What is left undone: of the samples in material the shallower ones are not looked at, and the
// tick ends with a step that the others allow, or where all that held the tool were last looked at.
// The next tick goes on with what was made.
constexpr uint32_t kMostWork = 120, kContactWork = 4, kSamplesOfWork = 40;
// In samples: a place is deep where a contact is so far in material, and farther in noise: for each
// sample that normals are blurred by.
constexpr double kDeep = 0.025, kDeepInNoise = 0.15;
// In noise: so much of the sharp value, for each sample of blur, is the smooth one instead.
constexpr double kSmoothShare = 0.5;
constexpr double kFlat = 0.004; // slope across a sample, as a share of the contrast
// How far a ball's contact turns towards where it faces the surface, at each look. On a body that
// bends by 1/r all of it is 1 / (1 + R/r) of what its normal says: 1 on a plane, 0.6 on the edges
// of a body that R has two thirds of, more in hollows.
constexpr double kTurn = 0.7;
constexpr double kCover = 0.65;  // how far from all samples it may lie, in distances between them
constexpr double kFacing = 0.96; // cosine of 16 degrees, within which its plane is that of a ball

bool is_inside(const Field::Inside& sample) {
    return sample.value >= 0.0f;
}

} // namespace

void ToolContacts::follow(const TickInput& input, const Volume& volume) {
    const TouchParameters& q = *input.parameters;
    field_.follow(volume, q);
    blur_samples_ = q.normal_blur_samples;
    is_labels_ = q.source == TouchSource::labels;
    place_points(input);
    considered_ = 0;
}

uint32_t ToolContacts::work() const {
    return kContactWork * considered_ + field_.filtered_samples() / kSamplesOfWork;
}

void ToolContacts::place_points(const TickInput& input) {
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
        point_count_ =
            static_cast<uint32_t>(std::min<size_t>(tool->points_mm.size(), points_.size()));
        for (uint32_t i = 0; i < point_count_; ++i) {
            points_[i] = turn * tool->points_mm[i];
            reach_mm_ = std::max(reach_mm_, glm::length(points_[i]));
        }
    } else if (q.tool_radius_mm == 0.0) {
        point_count_ = 1;
        points_[0] = dvec3(0.0);
    } else {
        const auto directions = sphere_.directions(q.tool_samples);
        point_count_ = static_cast<uint32_t>(directions.size());
        reach_mm_ = q.tool_radius_mm;
        cover_angle_ =
            std::min(kCover * std::sqrt(4.0 * std::numbers::pi / point_count_), std::numbers::pi);
        cover_ = std::cos(cover_angle_);
        for (uint32_t i = 0; i < point_count_; ++i)
            points_[i] = q.tool_radius_mm * directions[i];
    }
    glm::vec3 most(0.0f);
    for (uint32_t i = 0; i < point_count_; ++i) {
        offsets_[i] = field_.offset_of(points_[i]);
        most = glm::max(most, glm::abs(offsets_[i]));
    }
    reach_samples_ = std::max({most.x, most.y, most.z});
}

bool ToolContacts::is_clear(dvec3 from, dvec3 to) const {
    return field_.is_clear(glm::min(from, to) - reach_mm_, glm::max(from, to) + reach_mm_, 0.0);
}

// The samples that are in material or nearly so, in inside_. Most are not near any for many ticks.
uint32_t ToolContacts::solid_points(dvec3 at) {
    const std::span<const glm::vec3> offsets(offsets_.data(), point_count_);
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

bool ToolContacts::is_free(dvec3 at) {
    const uint32_t count = solid_points(at);
    return std::none_of(inside_.begin(), inside_.begin() + count, is_inside);
}

bool ToolContacts::is_deep() const {
    double least = 0.0;
    for (uint32_t k = 0; k < count_; ++k)
        least = std::min(least, holds_[k].clearance_mm);
    return least < -(kDeep + kDeepInNoise * blur_samples_) * field_.voxel_mm();
}

// A ball is nearest to a surface where it faces it, between its samples: part of the way there. The
// rest follows when it is looked at again. Where that is another sample's place, and nothing holds
// that, the contact becomes its; else it stays, so that the contacts of a ball that fits a hollow
// stay spread over it.
void ToolContacts::face(Hold& found) const {
    const double facing = -glm::dot(found.normal, found.touch.way);
    const dvec3 way = unit_or_zero(glm::mix(found.touch.way, -found.normal, kTurn));
    uint32_t sample = found.touch.sample;
    if (glm::dot(way, points_[sample]) < cover_ * reach_mm_) {
        sample = sphere_.nearest(way, 2.0 * cover_angle_);
        for (uint32_t i = 0; i < count_; ++i)
            if (holds_[i].touch.sample == sample)
                return;
        found.touch.sample = sample;
    }
    found.touch.way = way;
    if (facing > kFacing) {
        found.normal = -way;
        found.clearance_mm -= kTurn * reach_mm_ * (1.0 - facing);
    }
}

bool ToolContacts::consider(dvec3 at, Touch touch) {
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
    keep(found);
    return true;
}

void ToolContacts::keep(const Hold& found) {
    // Of contacts that face the same way the deepest says it all. When there is room for no other,
    // the shallowest goes.
    Hold* place = nullptr;
    for (uint32_t i = 0; i < count_ && !place; ++i)
        if (glm::dot(holds_[i].normal, found.normal) > kSameWay)
            place = &holds_[i];
    if (!place && count_ == kMost)
        place = std::max_element(holds_.begin(), holds_.end(), [](const Hold& a, const Hold& b) {
            return a.clearance_mm < b.clearance_mm;
        });
    if (!place)
        holds_[count_++] = found;
    else if (found.seen_mm < place->seen_mm)
        *place = found;
}

void ToolContacts::add(const Hold& hold) {
    if (count_ < kMost)
        holds_[count_++] = hold;
}

void ToolContacts::find(dvec3 at, std::span<const Touch> held, bool all, bool is_first) {
    count_ = 0;
    look_ = {};
    for (const Touch& touch : held) {
        look_.has_left_out = !is_first && work() > 2 * kMostWork;
        if (look_.has_left_out)
            return;
        if (has(touch))
            consider(at, touch);
    }
    if (all)
        consider_deepest(at);
}

// The deepest of all samples in material say enough: the others follow when these are out. And
// where a body bulges between its samples, a tool touches before any of its own are in material.
void ToolContacts::consider_deepest(dvec3 at) {
    const uint32_t count = solid_points(at);
    const auto inside =
        static_cast<uint32_t>(std::count_if(inside_.begin(), inside_.begin() + count, is_inside));
    look_.any_inside = inside > 0;
    const auto is_deeper = [](const Field::Inside& a, const Field::Inside& b) {
        return a.value > b.value || (a.value == b.value && a.point < b.point);
    };
    const auto end = inside_.begin() + count;
    const auto last =
        inside_.begin() + std::min({count, kMostConsidered, std::max(inside, kLeastConsidered)});
    std::partial_sort(inside_.begin(), last, end, is_deeper);
    for (auto at_hand = inside_.begin(); at_hand != last; ++at_hand) {
        look_.is_spent = work() > kMostWork;
        if (look_.is_spent)
            return;
        const bool has_slope = consider(at, touch_of(at_hand->point));
        if (is_inside(*at_hand))
            (has_slope ? look_.any_sloped : look_.any_flat) = true;
    }
}

} // namespace palpate::haptics
