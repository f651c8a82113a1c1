#pragma once

#include <string>

#include "engine/io/scene_data.h"

namespace palpate {

// A background that is brighter than what lies in it (ValueSurvey::bright_background; of a CT at
// least as bright as bone) hides it from rays that look for bright values: by default dark values
// are then opaque in mode alpha, and mode mip shows the smallest.
//
// Says so in a sentence that goes on after the volume's name; empty where it is not so.
std::string told_of_bright_background(const LoadedScene& loaded);

} // namespace palpate
