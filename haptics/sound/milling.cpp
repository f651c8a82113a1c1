#include "haptics/sound/milling.h"

#include <algorithm>
#include <cmath>

#include "engine/volume/changes.h"

namespace palpate::haptics {

Removed removed_between(const Volume& before, const Volume& after, double iso,
                        const Volume& material) {
    uint64_t count = 0;
    double sum = 0.0;
    for (const ChangedBrick& changed : changed_bricks(before, after)) {
        const Brick &was = before.brick(changed.position), &is = after.brick(changed.position),
                    &made_of = material.brick(changed.position);
        const Brick::Pinned was_pin = was.pin(), is_pin = is.pin(), made_pin = made_of.pin();
        const BrickBox box = changed_samples(changed);
        const glm::uvec3 high = glm::min(box.high, before.valid_in_brick(changed.position));
        for (uint32_t z = box.low.z; z < high.z; ++z)
            for (uint32_t y = box.low.y; y < high.y; ++y)
                for (uint32_t x = box.low.x; x < high.x; ++x) {
                    const uint32_t at = offset_in_brick({x, y, z});
                    if (was.value(was_pin, at) >= iso && !(is.value(is_pin, at) >= iso)) {
                        ++count;
                        sum += made_of.value(made_pin, at);
                    }
                }
    }
    if (count == 0)
        return {};
    const double sample_mm3 =
        std::abs(glm::determinant(glm::dmat3(before.grid().world_from_index)));
    return {static_cast<double>(count) * sample_mm3, sum / static_cast<double>(count)};
}

double milling_level(const Milling& milling) noexcept {
    const double rate = std::max(0.0, milling.rate_mm3_per_s);
    return (0.4 + 0.6 * std::clamp(milling.hardness, 0.0, 1.0)) * rate / (rate + kHalf_mm3_per_s);
}

Milling MillingMeter::look(double time_s, const Volume& now, double iso, bool is_labels,
                           bool by_hand, double speed_mm_per_s) {
    const bool comparable = last_ && last_->size() == now.size() && last_->type() == now.type();
    if (!comparable)
        top_ = now.range().max;
    if (!comparable || milling_.rate_mm3_per_s == 0.0)
        material_ = comparable ? last_ : now;
    milling_.speed_mm_per_s = speed_mm_per_s;
    if (comparable && by_hand && !last_->is_same_as(now)) {
        const Removed removed = removed_between(*last_, now, iso, *material_);
        if (removed.mm3 > 0.0) {
            milling_.removed_mm3 += removed.mm3;
            milling_.hardness =
                is_labels    ? 1.0
                : top_ > iso ? std::clamp((removed.mean_value - iso) / (top_ - iso), 0.0, 1.0)
                             : 0.0;
            // The newest place takes up what comes faster than the ring has places for.
            constexpr double kPlace_s = kWindow_s / (kLooks - 1);
            Look& newest = looks_[(next_ + kLooks - 1) % kLooks];
            if (newest.mm3 > 0.0 && time_s - newest.time_s < kPlace_s)
                newest.mm3 += removed.mm3;
            else
                looks_[next_++ % kLooks] = {time_s, removed.mm3};
        }
    }
    last_ = now;
    double sum = 0.0;
    for (const Look& look : looks_)
        if (look.mm3 > 0.0 && time_s - look.time_s < kWindow_s)
            sum += look.mm3;
    milling_.rate_mm3_per_s = sum / kWindow_s;
    return milling_;
}

uint64_t Dust::take(double removed_mm3) noexcept {
    const auto whole =
        static_cast<uint64_t>(removed_mm3 > 0.0 ? std::min(removed_mm3 / kGrain_mm3, 1e15) : 0.0);
    const uint64_t came = whole > given_ ? whole - given_ : 0;
    given_ = whole;
    return came;
}

} // namespace palpate::haptics
