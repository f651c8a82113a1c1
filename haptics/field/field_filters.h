#pragma once

#include <array>

#include "engine/volume/grid.h"

namespace palpate::haptics {

// The filters of a Field's views (field.h) before the spline: one an axis.
struct Filter {
    static constexpr int kMostReach = 5;
    int reach = 1; // samples to either side; 1, 2, 3 or 5
    std::array<std::array<float, 2 * kMostReach + 1>, 3> taps{}; // the first 2 reach + 1 of each
};

// The normals of a spline waver with the lattice if the edge that it is made of is narrow, and they
// turn where a surface bends if all blur is wide. So edge and filter together are blurred by this,
// whatever share of it the edge has itself. Of the family of scenes, directions err least at about
// this (docs/log/touch.md).
constexpr double kEdgeBlur_samples = 0.6;

struct FieldFilters {
    Filter sharp, smooth;
    // How far the sharp view may leave its samples' range, as a share of it, and how far from a
    // point the samples lie that it is made of.
    double overshoot = 0.0;
    int sharp_reach = 4;
};

// blur: of the smooth view against noise, in coarsest spacings; edge: standard deviation of the
// edge, likewise. Labels are felt with a sharp filter of their own.
FieldFilters make_filters(const Grid& grid, double blur, double edge, bool labels);

} // namespace palpate::haptics
