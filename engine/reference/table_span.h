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

// What a piece of a ray shows: `opacity` of `color`.
struct TableSpan {
    glm::dvec3 color{0.0};
    double opacity = 0.0;
};

// From a to b over length_mm. `bend` is by how many entries the value half-way lies above the mean
// of the ends: a parabola, which lingers where it is flat.
//
// With sigma = 0 .. 1 the share of the way in value and kappa = 4 bend / (b - a), kept to -1 .. 1,
// the time spent at sigma is 1 + kappa (2 sigma - 1) to first order. The mean of tau is then that
// of the table plus kappa times its first moment, for which tau counts as linear: (tau_b - tau_a) /
// 6.
TableSpan table_span(const TablePoint& a, const TablePoint& b, double bend, double length_mm);

// The detail of a transfer function, in values, that sub-steps have to resolve; > 0.
double sub_step_detail(const TransferFunction& function);

} // namespace palpate::reference
