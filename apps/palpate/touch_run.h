#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json.h"
#include "engine/session/session.h"
#include "haptics/device/recorded.h"
#include "haptics/device/registry.h"
#include "haptics/sound/milling_sound.h"

namespace palpate {

// The run of `palpate touch`.
struct TouchRunSetup {
    SessionSetup session;
    std::optional<EditSetup> edit;        // while button 0 is pressed
    std::optional<EditSetup> second_edit; // while button 1 is
    const haptics::AlgorithmEntry& algorithm;
    haptics::HandPath path;
    haptics::DeviceEntry device;
    haptics::HandModel hand;
    double rate_hz = 1000.0;
    double scale = 0.0; // 0: what the path needs
    uint32_t delay_ticks = 0;
    bool real_time = false;
};

// Button 1 is the second one where it does something.
inline haptics::Servo::Options servo_options(const TouchRunSetup& setup) {
    haptics::Servo::Options options{.rate_hz = setup.rate_hz};
    if (setup.second_edit)
        options.second_button = 1;
    return options;
}

struct TouchRun {
    std::vector<haptics::ServoTick> ticks;
    int64_t start_ns = 0; // of the path; before it force fades in
    std::vector<haptics::DeviceRecord> records;
    Volume volume; // that was edited, else the first of the document, as it is at the end
    size_t strokes = 0;
    std::vector<haptics::MillingMoment> milling; // since start_ns, every Session::kMeasure_ms
    double removed_mm3 = 0.0;
    Json telemetry; // haptics/servo/telemetry.h
};

// Appends the session's milling to the run where the last moment is long enough ago.
void listen(TouchRun& run, const Session& session, int64_t now_ns);

// The hand rests at the path's first pose until force has faded in, then follows the path. On a
// virtual clock everything is a function of the setup, bit for bit, processor times apart.
Result<TouchRun> run_touch_loop(TouchRunSetup setup, std::stop_token stop,
                                const std::function<void(double share)>& progress);

} // namespace palpate
