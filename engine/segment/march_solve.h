#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace palpate {

// One axis of the upwind quadratic: the term weight * (u - value)^2 of
//     sum over axes = cost^2,
// where it counts only if u is above `from`, the arrival at the neighbour.
struct MarchAxis {
    float from, value, weight;
};

// The arrival at a sample from neighbours on up to three axes: the larger root of the quadratic of
// those axes whose neighbours arrive before it (Sethian, Level set methods and fast marching
// methods, 1999, chapter 8). Axes without a neighbour have from = infinity and weight = 0. The
// result is above the `from` of every axis that counts, or equal to it where cost is 0; infinity
// where none does. cost >= 0.
inline float march_solve_in_order(MarchAxis a, MarchAxis b, MarchAxis c, float cost) {
    if (b.from < a.from)
        std::swap(a, b);
    if (c.from < b.from) {
        std::swap(b, c);
        if (b.from < a.from)
            std::swap(a, b);
    }
    if (a.from == std::numeric_limits<float>::infinity())
        return a.from;
    // Relative to the earliest neighbour, so that nothing is lost where times are large.
    const float base = a.value;
    float u = cost / std::sqrt(a.weight);
    if (base + u <= b.from)
        return std::max(base + u, a.from);
    const float db = b.value - base, squared = cost * cost;
    float sum = a.weight + b.weight, first = b.weight * db, second = first * db;
    float root = first * first - sum * (second - squared);
    if (!(root >= 0.0f))
        return std::max(base + u, a.from);
    const float two = (first + std::sqrt(root)) / sum;
    if (base + two < b.from)
        return std::max(base + u, a.from);
    u = two;
    if (base + u <= c.from)
        return base + u;
    const float dc = c.value - base;
    sum += c.weight, first += c.weight * dc, second += c.weight * dc * dc;
    root = first * first - sum * (second - squared);
    if (!(root >= 0.0f))
        return base + u;
    const float three = (first + std::sqrt(root)) / sum;
    return base + (base + three < c.from ? u : three);
}

// The same, straight away where all axes with a neighbour count, which is the usual case.
[[gnu::always_inline]] inline float march_solve(const MarchAxis& a, const MarchAxis& b,
                                                const MarchAxis& c, float cost) {
    const float base = std::min({a.from, b.from, c.from});
    const float da = a.weight > 0.0f ? a.value - base : 0.0f;
    const float db = b.weight > 0.0f ? b.value - base : 0.0f;
    const float dc = c.weight > 0.0f ? c.value - base : 0.0f;
    const float last = std::max({a.weight > 0.0f ? a.from : base, b.weight > 0.0f ? b.from : base,
                                 c.weight > 0.0f ? c.from : base});
    const float sum = a.weight + b.weight + c.weight;
    const float first = a.weight * da + b.weight * db + c.weight * dc;
    const float second = a.weight * da * da + b.weight * db * db + c.weight * dc * dc;
    const float root = first * first - sum * (second - cost * cost);
    const float u = base + (first + std::sqrt(std::max(root, 0.0f))) / sum;
    if (root >= 0.0f && u >= last)
        return u;
    return march_solve_in_order(a, b, c, cost);
}

} // namespace palpate
