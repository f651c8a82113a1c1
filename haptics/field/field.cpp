#include "haptics/field/field.h"

#include <algorithm>

#include "engine/volume/extent.h"
#include "haptics/field/samples.h"
#include "haptics/field/spline_place.h"

namespace palpate::haptics {

namespace {

bool is_same_grid(const Grid& a, const Grid& b) {
    return a.size == b.size && a.world_from_index == b.world_from_index;
}

} // namespace

bool Field::is_far(glm::dvec3 index) const {
    for (int axis = 0; axis < 3; ++axis)
        if (!(index[axis] > -8.0 && index[axis] < double(volume_->size()[axis]) + 8.0))
            return true;
    return false;
}

void Field::follow(const Volume& volume, TouchSource source, double iso, double blur, double edge) {
    volume_ = &volume;
    lacked_brick_ = false;
    filtered_samples_ = 0;
    const bool labels = source == TouchSource::labels;
    if (labels) {
        iso = 0.5;
        blur = 1.0;
    }
    const bool same_settings =
        settings_ != 0 && source == source_ && blur == blur_ && edge == edge_;
    if (same_settings && iso == iso_ && volume.version() == version_)
        return;
    const ValueRange range = volume.range();
    const bool plain = labels || range.empty();
    if (!same_settings || (!plain && range.min < lowest_) || lowest_ >= iso ||
        !is_same_grid(volume.grid(), grid_)) {
        ++settings_;
        source_ = source;
        base_ = double{static_cast<float>(iso)};
        blur_ = blur;
        edge_ = edge;
        lowest_ = plain ? 0.0f : std::min(range.min, static_cast<float>(iso) - 1.0f);
        grid_ = volume.grid();
        stored_.set(labels, base_);
        filters_ = make_filters(grid_, blur, edge, labels);
        index_from_world_ = index_from_world(grid_);
        gradient_to_world_ = glm::transpose(glm::dmat3(index_from_world_));
        smallest_mm_ = smallest_spacing_mm(grid_);
        coarsest_mm_ = largest_spacing_mm(grid_);
    }
    ++generation_;
    iso_ = iso;
    threshold_ = labels ? 0.0f : stored_.of(static_cast<float>(iso));
    version_ = volume.version();
    contrast_ = plain ? 1.0 : std::max(1e-9, double{range.max} - double{lowest_});
}

FieldSample Field::evaluate(const SplinePlace& place, Part part) {
    const Block& b = block(place.block, part);
    const auto [value, slope] =
        place.value_and_slope(part == kSharpPart ? b.sharp.data() : b.smooth.data());
    return {base_ + double{value}, gradient_to_world_ * glm::dvec3(slope)};
}

double Field::value(glm::dvec3 world_mm) {
    const glm::dvec3 index = index_of(world_mm);
    if (!volume_ || is_far(index))
        return base_ + double{stored_.of(lowest_)};
    const SplinePlace place(index);
    return base_ + double{place.value(block(place.block, kSharpPart).sharp.data())};
}

FieldSample Field::sharp(glm::dvec3 world_mm) {
    return both(world_mm, true, false).sharp;
}

FieldSample Field::smooth(glm::dvec3 world_mm) {
    return both(world_mm, false, true).smooth;
}

Field::Both Field::both(glm::dvec3 world_mm, bool sharp, bool smooth) {
    const glm::dvec3 index = index_of(world_mm);
    if (!volume_ || is_far(index))
        return {{base_ + double{stored_.of(lowest_)}, {}},
                {base_ + double{stored_.of(lowest_)}, {}}};
    const SplinePlace place(index);
    Both found;
    if (sharp)
        found.sharp = evaluate(place, kSharpPart);
    if (smooth)
        found.smooth = evaluate(place, kSmoothPart);
    return found;
}

bool Field::lacks_data(glm::dvec3 world_mm) const {
    if (!volume_ || !may_lack_data())
        return false;
    const glm::dvec3 index = index_of(world_mm);
    if (is_far(index))
        return false;
    const int reach = std::max(filters_.sharp.reach, filters_.smooth.reach);
    const glm::ivec3 cell(glm::floor(index));
    return haptics::lacks_data(*volume_, cell - 1 - reach, cell + 2 + reach);
}

bool Field::is_clear(glm::dvec3 from_mm, glm::dvec3 to_mm, double margin_samples) const {
    if (!volume_)
        return true;
    const glm::dvec3 a = index_of(from_mm), b = index_of(to_mm);
    const bool labels = source_ == TouchSource::labels;
    const double margin = margin_samples + filters_.sharp_reach;
    const glm::dvec3 low = glm::clamp(glm::min(a, b) - margin, -kFarthest, kFarthest);
    const glm::dvec3 high = glm::clamp(glm::max(a, b) + margin, -kFarthest, kFarthest);
    bool lacks_some = false;
    const ValueRange range =
        range_about(*volume_, glm::ivec3(glm::floor(low)), glm::ivec3(glm::ceil(high)), lacks_some);
    if (range.empty())
        return true;
    const auto highest = double{stored_.of(range.max)};
    const auto lowest = double{stored_.of(lacks_some ? std::min(range.min, lowest_) : range.min)};
    // A blurred label reaches 0.5 only where some sample is one.
    return highest + (labels ? 0.0 : filters_.overshoot * (highest - lowest)) < double{threshold_};
}

} // namespace palpate::haptics
