#include "apps/view/panels/transfer_editor.h"

#include <algorithm>
#include <cmath>

namespace palpate::view {

namespace {

constexpr double kGrip_px = 12.0; // height of the grips of iso-values

template <class Points>
size_t place_for(const Points& points, double value) {
    return static_cast<size_t>(
        std::upper_bound(points.begin(), points.end(), value,
                         [](double v, const auto& point) { return v < point.value; }) -
        points.begin());
}

template <class Points>
double between_neighbours(const Points& points, size_t number, double value) {
    const double least = number > 0 ? points[number - 1].value : -INFINITY;
    const double most = number + 1 < points.size() ? points[number + 1].value : INFINITY;
    return std::clamp(value, least, most);
}

} // namespace

double TransferPlot::value_at(double x_px) const {
    return low + (x_px - box.low_px.x) / std::max(box.size_px.x - 1, 1) * (high - low);
}

double TransferPlot::opacity_at(double y_px) const {
    return std::clamp(1.0 - (y_px - box.low_px.y) / std::max(box.size_px.y - 1, 1), 0.0, 1.0);
}

double TransferPlot::x_of(double value) const {
    return box.low_px.x + (value - low) / (high - low) * std::max(box.size_px.x - 1, 1);
}

double TransferPlot::y_of(double opacity) const {
    return box.low_px.y + (1.0 - opacity) * std::max(box.size_px.y - 1, 1);
}

std::optional<TransferPoint> point_under(const TransferPlot& plot, const TransferFunction& function,
                                         const std::vector<double>& isos, glm::dvec2 at_px) {
    std::optional<TransferPoint> nearest;
    double least = kTransferReach_px;
    const auto take = [&](TransferPoint::Of of, size_t number, double away) {
        if (away <= least) {
            least = away;
            nearest = {of, number};
        }
    };
    if (at_px.y >= plot.bar.low_px.y) {
        for (size_t i = 0; i < function.colors.size(); ++i)
            take(TransferPoint::Of::color, i,
                 std::abs(plot.x_of(function.colors[i].value) - at_px.x));
        return nearest;
    }
    for (size_t i = 0; i < function.opacities.size(); ++i) {
        const auto& [value, opacity] = function.opacities[i];
        take(TransferPoint::Of::opacity, i,
             glm::distance(glm::dvec2(plot.x_of(value), plot.y_of(opacity)), at_px));
    }
    if (at_px.y <= plot.box.low_px.y + kGrip_px)
        for (size_t i = 0; i < isos.size(); ++i)
            take(TransferPoint::Of::iso, i, std::abs(plot.x_of(isos[i]) - at_px.x));
    return nearest;
}

size_t add_opacity(TransferFunction& function, double value, double opacity) {
    const size_t at = place_for(function.opacities, value);
    function.opacities.insert(function.opacities.begin() + static_cast<ptrdiff_t>(at),
                              {value, std::clamp(opacity, 0.0, 1.0)});
    return at;
}

size_t add_color(TransferFunction& function, double value) {
    const glm::dvec3 color = color_at(function, value);
    const size_t at = place_for(function.colors, value);
    function.colors.insert(function.colors.begin() + static_cast<ptrdiff_t>(at), {value, color});
    return at;
}

void move_opacity(TransferFunction& function, size_t number, double value, double opacity) {
    function.opacities[number] = {between_neighbours(function.opacities, number, value),
                                  std::clamp(opacity, 0.0, 1.0)};
}

void move_color(TransferFunction& function, size_t number, double value) {
    function.colors[number].value = between_neighbours(function.colors, number, value);
}

bool remove_point(TransferFunction& function, TransferPoint point) {
    const auto remove = [&](auto& points) {
        if (points.size() < 2 || point.number >= points.size())
            return false;
        points.erase(points.begin() + static_cast<ptrdiff_t>(point.number));
        return true;
    };
    return point.of == TransferPoint::Of::opacity ? remove(function.opacities)
           : point.of == TransferPoint::Of::color ? remove(function.colors)
                                                  : false;
}

} // namespace palpate::view
