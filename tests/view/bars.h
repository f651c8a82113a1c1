#pragma once

#include "apps/view/window/panel.h"

namespace palpate::view {

// The size of a window whose views and panels are as large as in one of this size without bars, so
// that places in views stay where they are when a bar changes.
inline glm::uvec2 with_bars(glm::uvec2 size_px, double text_scale = 1.0) {
    return size_px + bars_px(glm::uvec2(1'000'000), text_scale); // a window that limits no bar
}

} // namespace palpate::view
