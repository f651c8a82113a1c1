#pragma once

#include "engine/annotate/figure.h"

namespace palpate {

// How much of a picture's left side its legend takes, with the room between marks and other things;
// 0 without one.
double legend_width_px(const Figure& figure, glm::uvec2 size_px);

} // namespace palpate
