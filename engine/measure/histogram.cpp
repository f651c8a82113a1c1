#include "engine/measure/histogram.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/volume/changes.h"

namespace palpate {

Histogram::Histogram(double low, double high, size_t bins)
    : low_(low), high_(high), counts_(bins, 0) {
    PALPATE_ASSERT(low < high && bins > 0);
}

size_t Histogram::bin_of(double value) const {
    const auto bins = static_cast<double>(counts_.size());
    const double place = std::floor((value - low_) * bins / (high_ - low_));
    return static_cast<size_t>(std::clamp(place, 0.0, bins - 1.0));
}

void Histogram::add(const Volume& volume, glm::uvec3 position, bool takes_away) {
    const Brick& brick = volume.brick(position);
    const glm::uvec3 valid = volume.valid_in_brick(position);
    const auto enter = [&](float value, uint64_t times) {
        if (!std::isnan(value))
            counts_[bin_of(double{value})] += takes_away ? -times : times; // modulo 2^64
    };
    if (brick.is_constant()) {
        enter(brick.value(0), uint64_t{valid.x} * valid.y * valid.z);
        return;
    }
    ++bricks_read_;
    const Brick::Pinned pinned = brick.pin();
    for (uint32_t z = 0; z < valid.z; ++z)
        for (uint32_t y = 0; y < valid.y; ++y)
            for (uint32_t x = 0; x < valid.x; ++x)
                enter(brick.value(pinned, offset_in_brick({x, y, z})), 1);
}

bool Histogram::count(const Volume& volume, const std::stop_token& stop) {
    const bool goes_on = counted_ && counted_->grid().size == volume.grid().size &&
                         counted_->type() == volume.type();
    const auto stopped = [&] {
        if (stop.stop_requested())
            counted_.reset();
        return stop.stop_requested();
    };
    if (goes_on && counted_->is_same_as(volume))
        return true;
    if (goes_on) {
        for (const ChangedBrick& changed : changed_bricks(*counted_, volume)) {
            if (stopped())
                return false;
            add(*counted_, changed.position, true);
            add(volume, changed.position, false);
        }
    } else {
        std::fill(counts_.begin(), counts_.end(), 0);
        const glm::uvec3 count = volume.brick_count();
        for (uint32_t z = 0; z < count.z; ++z)
            for (uint32_t y = 0; y < count.y; ++y)
                for (uint32_t x = 0; x < count.x; ++x) {
                    if (stopped())
                        return false;
                    add(volume, {x, y, z}, false);
                }
    }
    counted_ = volume;
    return true;
}

} // namespace palpate
