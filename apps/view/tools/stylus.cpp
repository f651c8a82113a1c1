#include "apps/view/tools/stylus.h"

#include <cstddef>

namespace palpate::view {

static_assert([] {
    size_t number = 0;
    for (const CarveRow& row : kCarveTable)
        if (static_cast<size_t>(row.carve) != number++)
            return false;
    return number == static_cast<size_t>(Carve::crosshair) + 1;
}());

const char* name_of(TipShape shape) {
    constexpr const char* names[] = {"ball", "box", "cylinder", "burr"};
    return names[static_cast<size_t>(shape)];
}

} // namespace palpate::view
