#include "engine/reference/cubic.h"

#include <algorithm>
#include <cmath>

namespace palpate::reference {

Cubic cell_cubic(const std::array<float, 8>& corners, glm::dvec3 entry, glm::dvec3 exit) {
    // value = k + kx x + ky y + kz z + kxy x y + kxz x z + kyz y z + kxyz x y z
    std::array<double, 8> v;
    std::copy(corners.begin(), corners.end(), v.begin());
    const double kx = v[1] - v[0], ky = v[2] - v[0], kz = v[4] - v[0];
    const double kxy = v[3] - v[2] - kx;
    const double kxz = v[5] - v[4] - kx;
    const double kyz = v[6] - v[4] - ky;
    const double kxyz = (v[7] - v[6] - v[5] + v[4]) - (v[3] - v[2] - v[1] + v[0]);
    const glm::dvec3 a = entry, d = exit - entry;
    const double xy1 = a.x * d.y + a.y * d.x, xy2 = d.x * d.y;
    Cubic cubic;
    cubic.c[0] = v[0] + kx * a.x + ky * a.y + kz * a.z + kxy * a.x * a.y + kxz * a.x * a.z +
                 kyz * a.y * a.z + kxyz * a.x * a.y * a.z;
    cubic.c[1] = kx * d.x + ky * d.y + kz * d.z + kxy * xy1 + kxz * (a.x * d.z + a.z * d.x) +
                 kyz * (a.y * d.z + a.z * d.y) + kxyz * (a.x * a.y * d.z + a.z * xy1);
    cubic.c[2] = kxy * xy2 + kxz * d.x * d.z + kyz * d.y * d.z + kxyz * (d.z * xy1 + a.z * xy2);
    cubic.c[3] = kxyz * xy2 * d.z;
    return cubic;
}

MonotonePieces monotone_pieces(const Cubic& cubic) {
    MonotonePieces pieces{{0.0, 1.0, 1.0, 1.0}, 1};
    const auto cut = [&](double u) {
        if (u > pieces.ends[pieces.count - 1] && u < 1.0) {
            pieces.ends[pieces.count++] = u;
            pieces.ends[pieces.count] = 1.0;
        }
    };
    // Slope: a u^2 + b u + c = 0, by the form that does not cancel (Press et al., Numerical
    // Recipes, 5.6).
    const double a = 3.0 * cubic.c[3], b = 2.0 * cubic.c[2], c = cubic.c[1];
    const double discriminant = b * b - 4.0 * a * c;
    if (discriminant < 0.0)
        return pieces;
    const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
    double first = a != 0.0 ? q / a : 2.0, second = q != 0.0 ? c / q : 2.0;
    if (first > second)
        std::swap(first, second);
    cut(first);
    cut(second);
    return pieces;
}

double root_between(const Cubic& cubic, double value, double a, double b) {
    const double at_a = cubic(a) - value, at_b = cubic(b) - value;
    if (at_a == 0.0)
        return a;
    if (at_b == 0.0)
        return b;
    if ((at_a > 0.0) == (at_b > 0.0))
        return std::abs(at_a) < std::abs(at_b) ? a : b;
    // Newton's steps, halving instead where one would leave the bracket or shrink it slowly.
    double u = a - at_a * (b - a) / (at_b - at_a);
    for (int i = 0; i < 200 && a < b; ++i) {
        const double f = cubic(u) - value;
        if (f == 0.0)
            return u;
        const double width = b - a;
        ((f > 0.0) == (at_a > 0.0) ? a : b) = u;
        double next = u - f / cubic.slope(u);
        if (!(next > a && next < b) || b - a > 0.5 * width)
            next = 0.5 * (a + b);
        if (next == u || next <= a || next >= b)
            return u;
        u = next;
    }
    return u;
}

} // namespace palpate::reference
