#include "haptics/sound/milling_sound.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptics/field/coupling.h"

namespace palpate::haptics {

void MillingSound::make(const Milling& milling, std::span<float> out) noexcept {
    constexpr double kStep = 1.0 / (kWhole_s * kSoundRate_hz);
    constexpr int kHarmonics = 4;
    const double wanted = milling_level(milling);
    const double hardness = std::clamp(milling.hardness, 0.0, 1.0);
    const double spindle_hz = kSpindle_hz * (1.0 - 0.2 * wanted);
    const double noise_share = 0.3 + 0.4 * hardness;
    const double cut_hz = std::min(800.0 + 40.0 * std::max(0.0, milling.speed_mm_per_s), 8000.0);
    // White noise through a first-order low-pass y += a (x - y) has a / (2 - a) of its variance.
    const double a = 1.0 - std::exp(-2.0 * std::numbers::pi * cut_hz / kSoundRate_hz);
    const double noise_gain = std::sqrt((2.0 - a) / a);
    for (float& sample : out) {
        level_ += std::clamp(wanted - level_, -kStep, kStep);
        if (level_ == 0.0) {
            sample = 0.0f;
            continue;
        }
        phase_ += spindle_hz / kSoundRate_hz;
        phase_ -= std::floor(phase_);
        double tone = 0.0;
        for (int k = 1; k <= kHarmonics; ++k)
            tone += std::sin(2.0 * std::numbers::pi * k * phase_) / k;
        noise_ += a * (next_signed(random_) - noise_);
        const double both =
            (1.0 - noise_share) * 0.5 * tone + noise_share * 0.5 * noise_gain * noise_;
        sample = static_cast<float>(std::clamp(level_ * both, -1.0, 1.0));
    }
}

std::vector<float> sound_of(std::span<const MillingMoment> moments, double end_s) {
    std::vector<float> samples(static_cast<size_t>(std::max(0.0, end_s) * kSoundRate_hz));
    MillingSound sound;
    const auto place = [&](double time_s) {
        return std::min(samples.size(), static_cast<size_t>(std::max(0.0, time_s) * kSoundRate_hz));
    };
    for (size_t i = 0; i < moments.size(); ++i) {
        const size_t begin = place(moments[i].time_s);
        const size_t end = i + 1 < moments.size() ? place(moments[i + 1].time_s) : samples.size();
        sound.make(moments[i].milling, std::span(samples).subspan(begin, end - begin));
    }
    return samples;
}

} // namespace palpate::haptics
