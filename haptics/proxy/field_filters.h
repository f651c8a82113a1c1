#pragma once

#include <array>

#include "engine/volume/grid.h"

namespace palpate::haptics {

// What the views of a Field (field.h) do to samples before the spline: one filter an axis.
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

// What is sharpened more follows kinks more closely, and rings more where a flat flank begins to
// bend. Straightened steps on uneven spacing have the choice: what holds a point is then decided by
// the one, its normals by the other; a tool in a groove is nearer to the truth with the latter
// alone.
enum class Kinks { exact, calm };

// blur: of the smooth view, in coarsest spacings; 0 for data without noise. Labels are felt with
// filters of their own, and steps that are straightened with nearly one for both views.
FieldFilters make_filters(const Grid& grid, double blur, bool labels, bool straightened,
                          Kinks kinks = Kinks::exact);

} // namespace palpate::haptics
