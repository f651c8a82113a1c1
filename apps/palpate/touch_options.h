#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "apps/palpate/touch_feel.h"
#include "apps/palpate/touch_path.h"
#include "apps/palpate/touch_strokes.h"
#include "haptics/device/simulated.h"
#include "haptics/proxy/algorithms.h"

namespace palpate {

inline const char* default_touch_algorithm() {
    const haptics::AlgorithmEntry* entry = haptics::find_algorithm("swept-point");
    return (entry ? *entry : haptics::algorithms().back()).name;
}

// The options of `palpate touch`.
struct TouchOptions {
    std::string scene, labels, algorithm = default_touch_algorithm(), device = "falcon";
    std::string report, page, record, sound, output;
    PathOptions motion;
    double iso = NAN, radius_mm = 0, stiffness = 500, damping = 0, yield_n = 0, viscosity = 0;
    double drill_threshold_mm = haptics::TouchParameters().drill_threshold_mm;
    double vibration_n = 0, surface_delay_s = haptics::TouchParameters().surface_delay_s;
    std::vector<double> friction{0.0};
    uint32_t samples = 340, delay = 0;
    double rate_hz = 1000, scale = 0;
    FeelOptions feel;
    haptics::HandModel hand;
    bool real_time = false, keep_journal = false;
};

inline bool edits(const TouchOptions& o) {
    return !o.feel.edit.empty() || o.feel.drill_mm > 0.0 || !o.feel.second_edit.empty();
}

// Its distance from the surface begins to remove material, and no button.
inline bool drills_by_itself(const TouchOptions& o) {
    return o.algorithm == "drill-three-step";
}

inline TouchedStrokes strokes_of(const TouchOptions& o) {
    return {o.scene, o.labels, o.output, edits(o), o.keep_journal};
}

} // namespace palpate
