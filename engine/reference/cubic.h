#pragma once

#include <array>
#include <glm/glm.hpp>

namespace palpate::reference {

// The trilinear interpolant of one cell along a straight line through it: a cubic in u, where u = 0
// is the line's entry and u = 1 its exit.
struct Cubic {
    std::array<double, 4> c{}; // c[0] + c[1] u + c[2] u^2 + c[3] u^3

    double operator()(double u) const { return c[0] + u * (c[1] + u * (c[2] + u * c[3])); }
    double slope(double u) const { return c[1] + u * (2.0 * c[2] + u * 3.0 * c[3]); }
};

// corners: x fastest, as cell_corners() gives them; entry and exit in cell coordinates, 0 .. 1.
Cubic cell_cubic(const std::array<float, 8>& corners, glm::dvec3 entry, glm::dvec3 exit);

// The ends of the pieces of [0, 1] on which the cubic rises or falls throughout: 0, turning points
// in order, 1.
struct MonotonePieces {
    std::array<double, 4> ends;
    int count; // of pieces: 1 .. 3
};
MonotonePieces monotone_pieces(const Cubic& cubic);

// The place where the cubic takes `value` on [a, b], on which it is monotone; the end nearer in
// value if it does not take it there. To the last bit or so of u.
double root_between(const Cubic& cubic, double value, double a, double b);

} // namespace palpate::reference
