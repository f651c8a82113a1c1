#include "haptics/proxy/stored_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "haptics/proxy/four.h"

namespace palpate::haptics {

namespace {

// The normal distribution's quantiles: how many standard deviations from the middle of a blurred
// step a sample of this share of it lies. Shares run from 0 to 1; those below 1/2000 say no more.
struct Quantiles {
    static constexpr int kLast = 2048;
    std::array<float, kLast + 1> of{};

    Quantiles() {
        constexpr double kLeast = 0.0005;
        double x = -3.3;
        for (int i = 0; i <= kLast / 2; ++i) {
            const double share = std::max(kLeast, i / double{kLast});
            for (int step = 0; step < 6; ++step) // Newton, from the one before
                x -= (0.5 * std::erfc(-x / std::sqrt(2.0)) - share) * std::sqrt(2.0 * M_PI) *
                     std::exp(0.5 * x * x);
            of[static_cast<size_t>(i)] = static_cast<float>(x);
            of[static_cast<size_t>(kLast - i)] = static_cast<float>(-x);
        }
    }
    float at(float share) const {
        const float place = std::clamp(share, 0.0f, 1.0f) * kLast;
        const int i = std::min(static_cast<int>(place), kLast - 1);
        const float low = of[static_cast<size_t>(i)], high = of[static_cast<size_t>(i + 1)];
        return low + (place - static_cast<float>(i)) * (high - low);
    }
};
const Quantiles& quantiles() {
    static const Quantiles table;
    return table;
}

} // namespace

Plateaus usable_plateaus(Plateaus plateaus, double iso, double blur_samples) {
    const double width = plateaus.solid - plateaus.free;
    const bool is_within = iso > plateaus.free + 0.1 * width && iso < plateaus.solid - 0.1 * width;
    return is_within && !(blur_samples > 0.0) ? plateaus : Plateaus{};
}

StoredSamples::StoredSamples() {
    quantiles(); // made here, not by the first tick
}

void StoredSamples::set(bool labels, double base, Plateaus plateaus) {
    labels_ = labels;
    base_ = base;
    straightened_ = !labels && plateaus.solid > plateaus.free;
    if (!straightened_)
        return;
    // q(share) steps about the middle, made as steep at the base as the samples are.
    const double width = plateaus.solid - plateaus.free;
    free_ = static_cast<float>(plateaus.free);
    share_scale_ = static_cast<float>(1.0 / width);
    const auto at_base = double{quantiles().at(static_cast<float>((base - plateaus.free) / width))};
    const double steepness = width * std::exp(-0.5 * at_base * at_base) / std::sqrt(2.0 * M_PI);
    step_scale_ = static_cast<float>(steepness);
    step_at_base_ = static_cast<float>(steepness * at_base);
}

float StoredSamples::of(float sample) const {
    if (labels_)
        return sample > 0.0f ? 0.5f : -0.5f;
    if (!straightened_)
        return sample - static_cast<float>(base_);
    const float share = (sample - free_) * share_scale_;
    return step_scale_ * quantiles().at(share) - step_at_base_;
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
