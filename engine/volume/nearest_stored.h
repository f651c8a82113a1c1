#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace palpate {

// A value as samples of type T hold it: the nearest whole number (of two the even one) within the
// type's limits; for float the nearest float.
template <class T>
T nearest_stored(double value) {
    if constexpr (std::is_floating_point_v<T>)
        return static_cast<T>(value);
    else
        return static_cast<T>(std::clamp<double>(
            std::nearbyint(value), std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
}

} // namespace palpate
