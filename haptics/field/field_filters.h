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

struct FieldFilters {
    Filter sharp, smooth;
    bool is_one_view = false; // both are the same
    // How far the sharp view may leave its samples' range, as a share of it, and how far from a
    // point the samples lie that it is made of.
    double overshoot = 0.0;
    int sharp_reach = 4;
};

// blur: of the smooth view, in coarsest spacings; 0 for data without noise. Labels are felt with
// filters of their own, and steps that are straightened nearly with one for both views: what is
// sharpened more follows kinks more closely, and rings more where a flat flank begins to bend; so
// where spacing is uneven, matter is decided by seven taps and normals by five.
FieldFilters make_filters(const Grid& grid, double blur, bool labels, bool straightened);

} // namespace palpate::haptics
