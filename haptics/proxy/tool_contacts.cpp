#include "haptics/proxy/tool_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "haptics/field/coupling.h"

namespace palpate::haptics {

namespace {

using glm::dvec3;

constexpr double kSameWay = 0.995; // cosine of 6 degrees
// Samples that are looked at each time: the deepest in material. So many of those that are nearly
// in it, too, by this share of the contrast: a body that bulges is touched before any is inside.
// More would take the work that further looks of the tick need; but those without a slope do not
// count, of so many in all.
constexpr uint32_t kMostConsidered = 6, kLeastConsidered = 3, kMostTried = 16;
constexpr double kNear = 0.09;
// Work, in tenths of a microsecond: of each contact that is looked at, of the samples that have to
// be filtered for it, of the points that are scanned and of a leap.
constexpr uint32_t kContactWork = 4, kSamplesOfWork = 40, kPointsOfWork = 40, kLeapWork = 5;
// In samples: a place is deep where a contact is so far in material, and farther for each sample
// that normals are blurred by.
constexpr double kDeep = 0.025, kDeepForBlur = 0.15, kSunk = 0.5;
// The share of the smooth value that is mixed into the sharp one in noise, for each sample of blur
// against it.
constexpr double kSmoothShare = 0.5;
constexpr double kFlatSlope = 0.004; // slope across a sample, as a share of the contrast
// How far a ball's contact turns towards where it faces the surface, at its first look. On a body
// that bends by 1/r all of it is 1 / (1 + R/r) of what its normal says: 1 on a plane, 0.6 on the
// edges of a body that R has two thirds of, more in hollows. So a contact that had to turn back
// turns by half the share at the next look, else by twice as much, up to this.
constexpr double kTurn = 0.7;
// On grey values a ball is held where it is pushed. Its other contacts may be in
// material by so much, in samples for each sample of blur, so that neither bumps of noise nor what
// blur does to normals in a hollow hold it in turn; by less where they face the surface to within 8
// degrees (of which the second is 1 - cosine), and not at all where they face it.
constexpr double kSlackForBlur = 0.25, kSlackFacing = 0.01;
// Places within 0.3 of the coarsest sample of where it is pushed, and within 16 degrees, have
// nothing to add.
constexpr double kBesidePushed_samples = 0.3, kBesidePushed = 0.96;
constexpr double kCover = 0.65; // how far from all samples it may lie, in distances between them
bool is_inside(const Field::Inside& sample) {
    return sample.value >= 0.0f;
}

} // namespace

void ToolContacts::follow(const TickInput& input, const Volume& volume) {
    const TouchParameters& q = *input.parameters;
    field_.follow(volume, q);
    noise_samples_ = q.normal_blur_samples;
    is_labels_ = q.source == TouchSource::labels;
    blur_samples_ = std::max(noise_samples_, is_labels_ ? 0.0 : kEdgeBlur_samples);
    place_points(input);
    considered_ = scanned_ = leaps_ = 0;
}

uint32_t ToolContacts::work() const {
    return kContactWork * considered_ + kLeapWork * leaps_ +
           field_.filtered_samples() / kSamplesOfWork + scanned_ / kPointsOfWork;
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
        field_.settings() == made_in_settings_) {
        reshaped_mm_ = 0.0;
        return;
    }
    made_of_ = tool;
    made_in_version_ = input.scene->version;
    made_turn_ = input.tool.rotation;
    made_radius_mm_ = q.tool_radius_mm;
    made_samples_ = q.tool_samples;
    made_in_settings_ = field_.settings();
    near_samples_ = 0;
    reach_mm_ = 0.0;
    is_ball_ = !tool && q.tool_radius_mm > 0.0;
    const uint32_t count_before = std::exchange(point_count_, 0);
    reshaped_mm_ = 0.0;
    const auto place = [&](dvec3 point) {
        dvec3& placed = points_[point_count_++];
        reshaped_mm_ = std::max(reshaped_mm_, glm::distance(placed, point));
        placed = point;
        reach_mm_ = std::max(reach_mm_, glm::length(point));
    };
    if (tool) {
        const glm::dmat3 turn = glm::mat3_cast(glm::normalize(input.tool.rotation));
        for (size_t i = 0; i < std::min(tool->points_mm.size(), points_.size()); ++i)
            place(turn * tool->points_mm[i]);
    } else if (q.tool_radius_mm == 0.0) {
        place(dvec3(0.0));
    } else {
        for (const dvec3& direction : sphere_.directions(q.tool_samples))
            place(q.tool_radius_mm * direction);
        reach_mm_ = q.tool_radius_mm;
        beside_pushed_ =
            std::max(kBesidePushed,
                     std::cos(std::min(kBesidePushed_samples * field_.coarsest_mm() / reach_mm_,
                                       std::numbers::pi)));
        cover_ = std::cos(
            std::min(kCover * std::sqrt(4.0 * std::numbers::pi / point_count_), std::numbers::pi));
    }
    if (point_count_ != count_before)
        reshaped_mm_ = std::numeric_limits<double>::infinity();
    glm::vec3 most(0.0f);
    for (uint32_t i = 0; i < point_count_; ++i) {
        offsets_[i] = field_.offset_of(points_[i]);
        most = glm::max(most, glm::abs(offsets_[i]));
    }
    reach_samples_ = std::max({most.x, most.y, most.z});
}

bool ToolContacts::is_clear(dvec3 from, dvec3 to) {
    ++leaps_;
    return field_.is_clear(glm::min(from, to) - reach_mm_, glm::max(from, to) + reach_mm_, 0.0);
}

// The samples that may be in material. Most are not near any for many ticks.
std::span<const uint16_t> ToolContacts::near_points(dvec3 at) {
    const std::span<const glm::vec3> offsets(offsets_.data(), point_count_);
    const glm::vec3 moved = glm::abs(field_.offset_of(at - near_at_));
    const bool is_far = !(std::max({moved.x, moved.y, moved.z}) <= 0.99f);
    if (is_far || near_samples_ != field_.samples_about(near_at_, reach_samples_)) {
        near_count_ = field_.near_points(at, offsets, reach_samples_, near_.data());
        near_at_ = at;
        near_samples_ = field_.samples_about(at, reach_samples_);
    }
    return {near_.data(), near_count_};
}

// The samples that are in material or nearly so, in inside_.
uint32_t ToolContacts::solid_points(dvec3 at) {
    const std::span<const uint16_t> named = near_points(at);
    scanned_ += point_count_;
    return field_.solid_points(at, {offsets_.data(), point_count_}, reach_samples_, named,
                               static_cast<float>(kNear * field_.contrast()), inside_.data());
}

// The largest of the samples there, in value units above the iso-value.
float ToolContacts::deepest_value(dvec3 at) {
    const uint32_t count = solid_points(at);
    float deepest = -std::numeric_limits<float>::infinity();
    for (uint32_t i = 0; i < count; ++i)
        deepest = std::max(deepest, inside_[i].value);
    return deepest;
}

// Some at a time: in material that yields most of them are solid, and one says it. A wide ball's
// lie in more blocks of labels than the field keeps.
bool ToolContacts::is_free(dvec3 at) {
    constexpr size_t kAtATime = 16;
    for (std::span<const uint16_t> left = near_points(at); !left.empty();) {
        const std::span<const uint16_t> some = left.first(std::min(kAtATime, left.size()));
        left = left.subspan(some.size());
        scanned_ += static_cast<uint32_t>(some.size());
        if (field_.solid_points(at, {offsets_.data(), point_count_}, reach_samples_, some, 0.0f,
                                inside_.data()) > 0)
            return false;
    }
    return true;
}

bool ToolContacts::is_as_free(dvec3 at, dvec3 other) {
    const float deepest = deepest_value(at);
    // An edge rises by about half of the contrast in a sample.
    const double bump =
        0.5 * (is_held_where_pushed() ? kSlackForBlur * blur_samples_ : kDeep) * field_.contrast();
    return deepest < bump || deepest <= deepest_value(other) + bump;
}

double ToolContacts::doubt_mm() const {
    const double noise = is_labels_ ? 0.0 : kSlackForBlur * blur_samples_;
    return 2.0 * (kDeep + noise) * field_.voxel_mm();
}

double ToolContacts::deepest_mm() const {
    double least = 0.0;
    for (uint32_t k = 0; k < count_; ++k)
        least = std::min(least, holds_[k].clearance_mm);
    return -least;
}

bool ToolContacts::is_deep() const {
    return deepest_mm() > (kDeep + kDeepForBlur * blur_samples_) * field_.voxel_mm();
}

bool ToolContacts::is_sunk() const {
    return deepest_mm() > kSunk * field_.voxel_mm();
}

// A ball is nearest to a surface where it faces it, between its samples: part of the way there. The
// rest follows when it is looked at again. Where that is another sample's place, and nothing holds
// that, the contact becomes its; else it stays, so that the contacts of a ball that fits a hollow
// stay spread over it.
void ToolContacts::face(Hold& found) const {
    Touch& touch = found.touch;
    const double facing = -glm::dot(found.normal, touch.way);
    const dvec3 turn = -found.normal - touch.way;
    const bool is_first = touch.turn_share == 0.0, goes_back = glm::dot(turn, touch.turned) < 0.0;
    touch.turn_share = is_first    ? kTurn
                       : goes_back ? 0.5 * touch.turn_share
                                   : std::min(kTurn, 2.0 * touch.turn_share);
    touch.turned = turn;
    const dvec3 way = unit_or_zero(touch.way + touch.turn_share * turn);
    uint32_t sample = touch.sample;
    if (glm::dot(way, points_[sample]) < cover_ * reach_mm_) {
        sample = sphere_.nearest(way);
        for (uint32_t i = 0; i < count_; ++i)
            if (holds_[i].touch.sample == sample)
                return;
        touch.sample = sample;
    }
    touch.way = way;
    if (facing > kFacing) {
        found.normal = -way;
        found.clearance_mm -= touch.turn_share * reach_mm_ * (1.0 - facing);
    }
}

double ToolContacts::least_slope() const {
    return kFlatSlope * field_.contrast() / field_.voxel_mm();
}

Field::Both ToolContacts::felt_at(dvec3 at) {
    auto [sharp, smooth] = field_.both(at);
    if (!is_labels_) { // a tool of samples rests on bumps, and noise is half of them in the mean
        const double share = kSmoothShare * noise_samples_;
        sharp.value += share * (smooth.value - sharp.value);
        sharp.gradient += share * (smooth.gradient - sharp.gradient);
    }
    return {sharp, smooth};
}

// By how steep the sharp field falls along a normal; no less than half the smooth one, so that a
// flat place of it does not throw the tool out.
double ToolContacts::clearance_of(const FieldSample& sharp, double slope, dvec3 normal) const {
    const double fall = std::max(-glm::dot(sharp.gradient, normal), 0.5 * slope);
    return std::clamp((field_.iso() - sharp.value) / fall, -2.0 * field_.voxel_mm(),
                      2.0 * field_.voxel_mm());
}

bool ToolContacts::consider(dvec3 at, Touch touch, Turn turn) {
    ++considered_;
    const auto [sharp, smooth] = felt_at(at + arm_of(touch));
    Hold found{.touch = touch};
    const double slope = glm::length(smooth.gradient), floor = least_slope();
    if (slope < floor)
        return false;
    found.normal = -smooth.gradient / slope;
    found.clearance_mm = clearance_of(sharp, slope, found.normal);
    found.confidence = std::min(1.0, slope / (4.0 * floor));
    found.seen_mm = found.clearance_mm;
    const double facing = is_ball_ ? -glm::dot(found.normal, touch.way) : 1.0;
    if (is_ball_ && turn == Turn::faces)
        face(found);
    if (is_held_where_pushed()) {
        found.is_pushed = turn == Turn::stays;
        if (found.is_pushed && found.clearance_mm > field_.voxel_mm())
            return true; // in the air, noise has slopes, too
        const double slack = found.is_pushed ? 0.0 : std::min(1.0, (1.0 - facing) / kSlackFacing);
        const double slack_mm = slack * kSlackForBlur * blur_samples_ * field_.voxel_mm();
        found.clearance_mm += slack_mm;
        found.seen_mm += slack_mm;
    }
    keep(found);
    return true;
}

void ToolContacts::keep(const Hold& found) {
    // The deepest of the contacts that face the same way says it all, but for the one where a ball
    // is pushed. When there is room for no other, the shallowest goes.
    Hold* place = nullptr;
    const uint32_t first = count_ > 0 && holds_[0].is_pushed;
    for (uint32_t i = first; i < count_ && !place; ++i)
        if (glm::dot(holds_[i].normal, found.normal) > kSameWay)
            place = &holds_[i];
    if (!place && count_ == kMost)
        place = std::max_element(
            holds_.begin() + first, holds_.begin() + count_,
            [](const Hold& a, const Hold& b) { return a.clearance_mm < b.clearance_mm; });
    if (!place)
        holds_[count_++] = found;
    else if (found.seen_mm < place->seen_mm)
        *place = found;
}

void ToolContacts::add(const Hold& hold) {
    if (count_ < kMost)
        holds_[count_++] = hold;
}

void ToolContacts::find(dvec3 at, const Asked& asked) {
    count_ = 0;
    found_at_ = at;
    look_ = {};
    const dvec3 pushed = unit_or_zero(asked.goal_mm - at);
    if (is_held_where_pushed())
        look_where_pushed(at, pushed);
    for (const Touch& touch : asked.held)
        if (has(touch) && !is_beside_pushed(touch.way))
            consider(at, touch);
    // A ball that is wedged in has its contacts to the sides.
    const bool is_held =
        is_ball_ && std::any_of(holds_.begin(), holds_.begin() + count_, [&](const Hold& hold) {
            return glm::dot(hold.normal, pushed) < 0.0;
        });
    if (is_held && !is_held_where_pushed())
        look_where_pushed(at, pushed);
    if (asked.all)
        consider_deepest(at);
}

void ToolContacts::look_where_pushed(dvec3 at, dvec3 pushed) {
    if (pushed != dvec3(0.0))
        consider(at, {sphere_.nearest(pushed), pushed}, Turn::stays);
}

bool ToolContacts::is_beside_pushed(dvec3 way) const {
    return count_ > 0 && holds_[0].is_pushed && glm::dot(way, holds_[0].touch.way) > beside_pushed_;
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
    const auto end = std::remove_if(
        inside_.begin(), inside_.begin() + count,
        [&](const Field::Inside& sample) { return is_beside_pushed(touch_of(sample.point).way); });
    const auto left = static_cast<uint32_t>(end - inside_.begin());
    const auto last =
        inside_.begin() + std::min({left, kMostTried, std::max(inside, kLeastConsidered)});
    std::partial_sort(inside_.begin(), last, end, is_deeper);
    uint32_t sloped = 0;
    for (auto at_hand = inside_.begin(); at_hand != last && sloped < kMostConsidered; ++at_hand) {
        look_.is_spent = is_spent();
        if (look_.is_spent)
            return;
        const bool has_slope = consider(at, touch_of(at_hand->point));
        sloped += has_slope;
        if (is_inside(*at_hand))
            (has_slope ? look_.any_sloped : look_.any_flat) = true;
    }
}

} // namespace palpate::haptics
