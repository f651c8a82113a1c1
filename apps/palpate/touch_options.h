#pragma once

#include <string>

#include "apps/palpate/touch_path.h"
#include "apps/palpate/touch_strokes.h"
#include "engine/program/touch_feel.h"
#include "engine/program/touch_run.h"
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
    haptics::TouchParameters parameters;
    TouchRunSettings run;
    FeelOptions feel;
    bool real_time = false, keep_journal = false;
};

inline bool edits(const TouchOptions& o) {
    return !o.feel.edit.empty() || o.feel.drill_mm > 0.0 || !o.feel.second_edit.empty();
}

// Its distance from the surface begins to remove material, and no button.
inline bool drills_by_itself(const TouchOptions& o) {
    return haptics::find_algorithm(o.algorithm)->takes(haptics::kTakesDrill);
}

inline TouchedStrokes strokes_of(const TouchOptions& o) {
    return {o.scene, o.labels, o.output, edits(o), o.keep_journal};
}

} // namespace palpate
