#include "apps/view/tools/stylus.h"

#include <cstddef>

namespace palpate::view {

const char* name_of(Carve carve) {
    constexpr const char* names[] = {"nothing", "draw",  "erase", "erode", "dilate", "smooth",
                                     "cut",     "drill", "add",   "seed",  "pull",   "crosshair"};
    return names[static_cast<size_t>(carve)];
}

const char* name_of(TipShape shape) {
    constexpr const char* names[] = {"ball", "box", "cylinder", "burr"};
    return names[static_cast<size_t>(shape)];
}

} // namespace palpate::view
