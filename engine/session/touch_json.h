#pragma once

#include "engine/base/json_value.h"
#include "engine/session/session.h"

namespace palpate {

// Haptic parameters as JSON under the keys of haptics::kTouchSettings: what
// read_touch_parameters() turns into the same again, to the bit.
Json touch_parameters_json(const haptics::TouchParameters& parameters);

// An absent key keeps its default; unknown keys and values out of their ranges are errors.
haptics::TouchParameters read_touch_parameters(const JsonValue& in);

} // namespace palpate
