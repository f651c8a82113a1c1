#pragma once

#include <optional>

#include "apps/view/window/panel.h"
#include "engine/scene/transfer_function.h"

namespace palpate::view {

// A transfer function as it is edited in a plot: opacity over values, with the points of colour on
// a bar below. All functions keep points in the order of their values and at least one of each
// list: a dragged point stops at its neighbours.

// The point that a hand has hold of, or has chosen.
struct TransferPoint {
    enum class Of { opacity, color, iso };
    Of of = Of::opacity;
    size_t number = 0; // in its list

    friend bool operator==(const TransferPoint&, const TransferPoint&) = default;
};

// State of the editor; a part of ViewState.
struct TransferEditing {
    std::optional<TransferPoint> chosen;
    bool is_dragged = false;
    bool log_counts = true;
    double low = 0.0, high = 0.0; // values at the plot's ends; equal: all values

    friend bool operator==(const TransferEditing&, const TransferEditing&) = default;
};

// The places of things in the window. The plot is a box; opacity 0 lies at its foot, 1 at its head.
// The bar of colours lies below.
struct TransferPlot {
    Box box, bar;
    double low = 0.0, high = 1.0; // low < high; values at the left and the right edge

    double value_at(double x_px) const;
    double opacity_at(double y_px) const; // 0 .. 1
    double x_of(double value) const;
    double y_of(double opacity) const;
};

// The nearest point within reach of a pixel. In the plot: opacities, and iso-values by their grips
// at its head; in the bar: colours.
constexpr double kTransferReach_px = 7.0;
std::optional<TransferPoint> point_under(const TransferPlot& plot, const TransferFunction& function,
                                         const std::vector<double>& isos, glm::dvec2 at_px);

// The number of the new point.
size_t add_opacity(TransferFunction& function, double value, double opacity);
size_t add_color(TransferFunction& function, double value); // of the colour that is there
void move_opacity(TransferFunction& function, size_t number, double value, double opacity);
void move_color(TransferFunction& function, size_t number, double value);
// Whether it is gone: the last one stays.
bool remove_point(TransferFunction& function, TransferPoint point);

} // namespace palpate::view
