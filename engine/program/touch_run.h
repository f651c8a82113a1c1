#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json.h"
#include "engine/base/setting.h"
#include "engine/session/session.h"
#include "haptics/device/recorded.h"
#include "haptics/device/registry.h"
#include "haptics/sound/milling_sound.h"

namespace palpate {

// How a run of `palpate touch` goes.
struct TouchRunSettings {
    double rate_hz = 1000.0;
    double scale = 0.0; // 0: what the path needs
    uint32_t delay_ticks = 0;
    double grip = 1.0;
};

// clang-format off
inline constexpr Setting<TouchRunSettings> kRunSettings[] = {
    {"rate_hz", &TouchRunSettings::rate_hz, 100, 20000, "Hz", "Ticks a second",
     {.option = "rate"}},
    {"scale", &TouchRunSettings::scale, 0, 1e6, "",
     "Scale, mm of the world per mm of the device; 0: as large as the path needs, at least 1",
     {.option = "scale"}},
    {"delay_ticks", &TouchRunSettings::delay_ticks, 0, haptics::DevicePlant::kMostDelayTicks,
     "ticks", "Delay of the simulated device", {.option = "delay"}},
    {"grip", &TouchRunSettings::grip, 0, 1000, "", "Grip of the hand: 0 no hand, 1 relaxed, 3 firm",
     {.option = "grip"}},
};
// clang-format on

struct TouchRunSetup {
    SessionSetup session;
    std::optional<EditSetup> edit;        // while button 0 is pressed
    std::optional<EditSetup> second_edit; // while button 1 is
    const haptics::AlgorithmEntry& algorithm;
    haptics::HandPath path;
    haptics::DeviceEntry device;
    TouchRunSettings settings;
    bool real_time = false;
};

// Button 1 is the second one where it does something.
inline haptics::Servo::Options servo_options(const TouchRunSetup& setup) {
    haptics::Servo::Options options{.rate_hz = setup.settings.rate_hz};
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
