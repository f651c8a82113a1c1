#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "haptics/servo/servo.h"

namespace palpate {

// One page that needs nothing else: position, force, energy and penetration of a run of the servo
// over time. Times count from start_ns; ticks before it are left out. Each pixel column shows the
// least and the largest value of its ticks, so that no peak is lost.
std::string touch_page(std::span<const haptics::ServoTick> ticks, int64_t start_ns,
                       const std::string& title);

} // namespace palpate
