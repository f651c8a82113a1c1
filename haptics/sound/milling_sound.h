#pragma once

#include <span>
#include <vector>

#include "haptics/sound/milling.h"

namespace palpate::haptics {

// Samples a second of all sound here.
constexpr double kSoundRate_hz = 44100.0;

// The sound of a burr as a function of what it removes: the harmonics of its spindle, slower under
// load, and noise that is louder in hard material and brighter at speed. Its level follows
// milling_level() within kWhole_s; without removal the samples are exactly 0. Deterministic: the
// same states give the same samples. Neither allocates, locks nor throws.
class MillingSound {
 public:
    static constexpr double kWhole_s = 0.020;    // from silence to all
    static constexpr double kSpindle_hz = 500.0; // 30 000 turns a minute
    // Continues with out.size() samples at kSoundRate_hz, each within -1 .. 1.
    void make(const Milling& milling, std::span<float> out) noexcept;

 private:
    double level_ = 0.0, phase_ = 0.0, noise_ = 0.0;
    uint64_t random_ = 1;
};

// A run's milling over time, from which its sound is made afterwards.
struct MillingMoment {
    double time_s = 0.0; // rises
    Milling milling;
};
// From 0 to end_s; before the first moment it is silent, and each lasts until the next.
std::vector<float> sound_of(std::span<const MillingMoment> moments, double end_s);

} // namespace palpate::haptics
