#pragma once

#include "engine/scene/transfer_function.h"

// The transfer function between two places of its table: what the exact integrator makes of a piece
// of a ray on which the value is nearly linear.
namespace palpate::reference {

// Places are taken to 1/256 of an entry, which samplers with weights of 8 bits resolve.
constexpr double kTableFractions = 256.0;
constexpr double kNarrowEntries = 2.0;

// A place in the table, in entries: 0 is the first one.
struct TablePoint {
    double place;
    glm::dvec4 entry;    // rgb and tau per mm, linear between entries
    glm::dvec4 integral; // of (rgb * tau, tau), in entries; beyond the ends it goes on with them
};
TablePoint table_point(const TransferTable& table, double value);
double entries_per_value(const TransferTable& table);

// The contribution of a piece of a ray: `opacity` of `color`.
struct TableSpan {
    glm::dvec3 color{0.0};
    double opacity = 0.0;
    double seen_at = 0.5; // the mean share of the way at which the light arises that leaves it
    double error = 0.0;   // largest error of opacity * color, of one channel
};

// From a to b over length_mm. `bend` is by how many entries the value half-way lies above the mean
// of the ends: a parabola, which lingers where it is flat.
//
// With sigma = 0 .. 1 the share of the way in value and kappa = 4 bend / (b - a), kept to -1 .. 1,
// the time spent at sigma is 1 + kappa (2 sigma - 1) to first order. The mean of tau is then that
// of the table plus kappa times its first moment, for which tau counts as linear: (tau_b - tau_a) /
// 6.
//
// The front of a piece hides its back. With x = 0 .. 1 the share of its optical depth d, the colour
// that is seen is the mean of c(x) weighted by exp(-d x). Expanded in Legendre polynomials of
// 2 x - 1, c = m + k1 P1 + k2 P2 + k3 P3 + ..., it is m - k1 r1 + k2 r2 - k3 r3 + ..., where
// r_n = i_n(d / 2) / i_0(d / 2) with the modified spherical Bessel functions (DLMF 10.54.2). m is
// the table's. Where colour goes from c_a to c_b and tau from tau_a to tau_b, both linearly, with
// s = (tau_b - tau_a) / (tau_a + tau_b) and D = c_b - c_a:
//   m = (c_a + c_b) / 2 + s D / 6,  k1 = (1 - s^2 / 5) D / 2,  k2 = -s (1 - 3 s^2 / 7) D / 6.
// Where m is another, as where colour has a step, D is the smaller of those that fit m and one end.
// `error` sums up what that leaves out, times the opacity: k3 r3, at most
// 0.05 D min(1, d^3 / 840); and what m is off that of linear functions, and tau's mean off theirs,
// which is what k1 may be off by, times r1.
TableSpan table_span(const TablePoint& a, const TablePoint& b, double bend, double length_mm);

// Sub-steps are not cut below this share, and a piece ends where less comes through.
constexpr double kLeastSpan = 0x1p-12;
constexpr double kLeastTransmittance = 0x1p-20;

// The detail of a transfer function, in values, that sub-steps have to resolve; > 0.
double sub_step_detail(const TransferFunction& function);

} // namespace palpate::reference
