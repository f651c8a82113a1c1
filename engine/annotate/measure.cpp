#include "engine/annotate/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {

namespace {

int strongest_axis(glm::dvec3 v) {
    const glm::dvec3 a = glm::abs(v);
    return a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
}

} // namespace

std::string letters_of(glm::dvec3 direction) {
    constexpr double kLeast = 0.2;
    constexpr const char* positive = "LPS";
    constexpr const char* negative = "RAI";
    std::array<int, 3> order{0, 1, 2};
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
    std::string letters;
    for (const int axis : order)
        if (std::abs(direction[axis]) >= kLeast * glm::length(direction))
            letters += direction[axis] > 0 ? positive[axis] : negative[axis];
    return letters;
}

ScaleBar scale_bar(double mm_per_px, double most_px) {
    const double most_mm = mm_per_px * most_px;
    double mm = std::pow(10.0, std::floor(std::log10(most_mm)));
    for (const double times : {5.0, 2.0})
        if (times * mm <= most_mm) {
            mm *= times;
            break;
        }
    return {mm, mm / mm_per_px};
}

std::string length_text(double mm) {
    return mm < 1000.0 ? fmt::format("{:g} mm", mm) : fmt::format("{:g} m", mm / 1000.0);
}

double mm_per_px(const Camera& camera, glm::uvec2 size_px) {
    const View view = make_view(camera, size_px);
    const double focal_mm = view.projection == Projection::perspective
                                ? glm::length(camera.target_mm - camera.eye_mm)
                                : 1.0;
    return focal_mm * (view.top - view.bottom) / size_px.y;
}

bool holds_samples(const Grid& grid, glm::dvec3 direction) {
    // The axes across which the plane extends stand on its normal.
    const glm::dmat3 m(grid.world_from_index);
    int across = 0;
    for (int i = 0; i < 3; ++i)
        across += std::abs(glm::dot(glm::normalize(m[i]), direction)) < 1e-6;
    return across == 2;
}

std::string place_text(const Grid& grid, glm::dvec3 point_mm, glm::dvec3 normal) {
    normal = glm::normalize(normal);
    const int axis = strongest_axis(normal);
    // The plane meets that axis's line through the volume's centre at this value. For a plane at
    // right angles to the axis it is the point's own.
    const glm::dvec3 center = center_mm(grid);
    const double mm = center[axis] + glm::dot(point_mm - center, normal) / normal[axis];
    const char letter = (mm < 0 ? "RAI" : "LPS")[axis];
    const std::string text = fmt::format("{} {:.1f} mm", letter, std::abs(mm));
    if (!holds_samples(grid, normal))
        return text + ", turned";
    const int along = strongest_axis(glm::dmat3(index_from_world(grid)) * normal);
    const double index = index_point(grid, point_mm)[along];
    return text + fmt::format(", {:g} of {}", std::round(index) + 1.0, grid.size[along]);
}

std::string window_text(double low, double high) {
    return fmt::format("W {:g} L {:g}", std::round(10 * (high - low)) / 10,
                       std::round(5 * (low + high)) / 10);
}

std::vector<double> round_values(double low, double high, int most) {
    double step = std::pow(10.0, std::floor(std::log10((high - low) / most)));
    const auto count = [&](double s) {
        return std::floor(high / s + 1e-9) - std::ceil(low / s - 1e-9) + 1;
    };
    const double ten = step;
    for (const double times : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0})
        if (step = times * ten; count(step) <= most)
            break;
    std::vector<double> values;
    for (double k = std::ceil(low / step - 1e-9); k <= std::floor(high / step + 1e-9); ++k)
        values.push_back(k * step + 0.0); // no -0
    return values;
}

} // namespace palpate
