#pragma once

#include <array>

namespace palpate {

// Weights of the samples floor(x) - 1 .. floor(x) + 2 of the uniform cubic B-spline at x, and how
// they change with x; f is x - floor(x). Number is float or double.
template <class Number>
struct CubicWeights {
    std::array<Number, 4> value, slope;
};

template <class Number>
CubicWeights<Number> cubic_weights(Number f) {
    constexpr auto n = [](double constant) { return static_cast<Number>(constant); };
    const Number r = n(1) - f;
    return {{r * r * r / n(6), (n(4) - f * f * (n(6) - n(3) * f)) / n(6),
             (n(4) - r * r * (n(6) - n(3) * r)) / n(6), f * f * f / n(6)},
            {n(-0.5) * r * r, f * (n(1.5) * f - n(2)), r * (n(2) - n(1.5) * r), n(0.5) * f * f}};
}

} // namespace palpate
