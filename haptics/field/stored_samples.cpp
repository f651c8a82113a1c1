#include "haptics/field/stored_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "haptics/field/four.h"

namespace palpate::haptics {

namespace {

double normal_share(double deviations) {
    return 0.5 * std::erfc(-deviations / std::sqrt(2.0));
}
double density(double deviations) {
    return std::exp(-0.5 * deviations * deviations) / std::sqrt(2.0 * M_PI);
}

// A step's place, in standard deviations of its blur from the middle, as it is stored: a step
// again, but wider by this factor, and as steep in the middle as a ramp. A plain ramp has a kink
// where it ends, and beside a tight bend one where distances have theirs; both are felt through a
// spline. By 1.6 both have nearly gone, and what is left of the blur of 0.7 samples is resolved by
// it: an edge is met within 0.002 samples, a hollow of 1.5 within 0.011 where a ramp errs by 0.02.
constexpr double kWider = 1.6;
double widened(double deviations) {
    return kWider * std::sqrt(2.0 * M_PI) * (normal_share(deviations / kWider) - 0.5);
}

// Samples of less than this share of a step, or that near to its end, say no more of the distance.
constexpr double kLeast = 0.0005, kFarthest = 3.29;
constexpr double kBuried = 0.9 * kFarthest;

// How samples are stored, by the share of the step that they have.
struct Steps {
    static constexpr int kLast = 2048;
    std::array<float, kLast + 1> of{};

    Steps() {
        double x = -kFarthest;
        for (int i = 0; i <= kLast / 2; ++i) {
            const double share = std::max(kLeast, i / double{kLast});
            for (int step = 0; step < 6; ++step) // Newton, from the one before
                x -= (normal_share(x) - share) / density(x);
            const double stored = widened(x);
            of[static_cast<size_t>(i)] = static_cast<float>(stored);
            of[static_cast<size_t>(kLast - i)] = static_cast<float>(-stored);
        }
    }
    float at(float share) const {
        const float place = std::clamp(share, 0.0f, 1.0f) * kLast;
        const int i = std::min(static_cast<int>(place), kLast - 1);
        const float low = of[static_cast<size_t>(i)], high = of[static_cast<size_t>(i + 1)];
        return low + (place - static_cast<float>(i)) * (high - low);
    }
};
const Steps& steps() {
    static const Steps table;
    return table;
}

} // namespace

Plateaus usable_plateaus(Plateaus plateaus, double iso, double blur_samples) {
    const double width = plateaus.solid - plateaus.free;
    const bool is_within = iso > plateaus.free + 0.1 * width && iso < plateaus.solid - 0.1 * width;
    return is_within && !(blur_samples > 0.0) ? plateaus : Plateaus{};
}

StoredSamples::StoredSamples() {
    steps(); // made here, not by the first tick
}

void StoredSamples::set(bool labels, double base, Plateaus plateaus) {
    labels_ = labels;
    base_ = base;
    const double width = plateaus.solid - plateaus.free;
    straightened_ = !labels && base > plateaus.free && base < plateaus.solid &&
                    std::isfinite(static_cast<float>(1.0 / width));
    if (!straightened_)
        return;
    // Made as steep at the base as the samples are.
    free_ = static_cast<float>(plateaus.free);
    share_scale_ = static_cast<float>(1.0 / width);
    const double share = (base - plateaus.free) / width;
    const auto at = [](double place) { return double{steps().at(static_cast<float>(place))}; };
    constexpr double kAbout = 2.0 / Steps::kLast;
    const double rise = (at(share + kAbout) - at(share - kAbout)) / (2.0 * kAbout);
    step_scale_ = static_cast<float>(width / rise);
    step_at_base_ = step_scale_ * static_cast<float>(at(share));
    buried_ = step_scale_ * static_cast<float>(widened(kBuried)) - step_at_base_;
}

float StoredSamples::of(float sample) const {
    if (labels_)
        return sample > 0.0f ? 0.5f : -0.5f;
    if (!straightened_)
        return sample - static_cast<float>(base_);
    const float share = (sample - free_) * share_scale_;
    return step_scale_ * steps().at(share) - step_at_base_;
}

void StoredSamples::make(std::span<float> samples) const {
    size_t i = 0;
    if (!labels_ && !straightened_) { // the common case, four at a time
        const auto base = static_cast<float>(base_);
        for (; i + 4 <= samples.size(); i += 4)
            store(&samples[i], load(&samples[i]) - Four{base, base, base, base});
    }
    for (; i < samples.size(); ++i)
        samples[i] = of(samples[i]);
}

} // namespace palpate::haptics
