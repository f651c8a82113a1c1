#pragma once

#include <atomic>
#include <cstdint>

#include "engine/edit/editor.h"
#include "haptics/field/algorithm.h"
#include "haptics/sound/milling.h"

namespace palpate {

// Measures what strokes take away of the volume that is edited, every kMeasure_ms while there may
// be something. Samples at or above the iso-value are solid, and those of labels above 0.
class MillingFollower {
 public:
    static constexpr int64_t kMeasure_ms = 10;
    static constexpr int64_t kNever_ns = INT64_MAX;

    MillingFollower(Editor& editor, Mailbox<haptics::TouchParameters>& parameters)
        : states_(editor.add_reader()), parameters_(parameters.add_reader()) {}

    // One thread: measures where the last time is long enough ago and there may be something.
    void measure(int64_t now_ns, double speed_mm_per_s);
    // The same thread: when to measure next; kNever_ns: after the next edit.
    int64_t due_ns();
    // For who measures by a clock that stands from now on: nothing is removed any more.
    void rest() noexcept;

    // Any thread; never waits. The speed is not its own.
    haptics::Milling milling(double speed_mm_per_s) const noexcept;
    // How strongly material goes, for the servo.
    const std::atomic<float>& removal() const { return removal_; }

 private:
    Editor::Readers::Reader states_;
    Mailbox<haptics::TouchParameters>::Reader parameters_;
    haptics::MillingMeter meter_;
    int64_t measured_ns_ = 0;
    uint64_t snapshot_ = 0, commands_ = 0; // of the state that was measured
    std::atomic<double> removed_mm3_{0.0}, rate_mm3_per_s_{0.0}, hardness_{0.0};
    std::atomic<float> removal_{0.0f};
};

} // namespace palpate
