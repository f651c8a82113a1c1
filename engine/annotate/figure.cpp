#include "engine/annotate/figure.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "engine/annotate/measure.h"
#include "engine/annotate/strokes.h"

namespace palpate {

namespace {

constexpr double kLineShare = 1.0 / 26.0, kLeastLine_px = 10.0;

struct Marks {
    Image& image;
    Pen pen;
    glm::dvec2 size;
    double edge; // room between marks and the picture's edge

    void letters(const View& view) const {
        Pen large = pen;
        large.line_px *= 1.3;
        const glm::dvec2 middle = 0.5 * size;
        const auto at = [&](glm::dvec2 place, glm::dvec2 anchor, glm::dvec3 towards) {
            draw_text(image, place, anchor, letters_of(towards), large);
        };
        at({edge, middle.y}, {0.0, 0.5}, -view.right);
        at({size.x - edge, middle.y}, {1.0, 0.5}, view.right);
        at({middle.x, edge}, {0.5, 0.0}, view.up);
        at({middle.x, size.y - edge}, {0.5, 1.0}, -view.up);
    }

    void scale_bar(const Camera& camera) const {
        const ScaleBar bar = palpate::scale_bar(mm_per_px(camera, image.size_px), 0.3 * size.x);
        const glm::dvec2 high = size - edge, rim(pen.rim_px());
        const glm::dvec2 low = high - glm::dvec2(bar.px, 0.2 * pen.line_px);
        fill_box(image, low - rim, high + rim, pen.rim);
        fill_box(image, low, high, pen.ink);
        const bool flat = camera.projection == Projection::orthographic;
        const std::string text = length_text(bar.mm) + (flat ? "" : " in the focal plane");
        const double middle =
            std::min(0.5 * (low.x + high.x), high.x - 0.5 * text_width_px(text, pen));
        draw_text(image, {middle, low.y - 0.3 * pen.line_px}, {0.5, 1.0}, text, pen);
    }

    void color_bar(const TransferFunction& function, const std::string& unit) const {
        const double least = function.colors.front().value, most = function.colors.back().value;
        const double line = pen.line_px;
        const glm::dvec2 high(std::floor(size.x - edge), std::floor(0.44 * size.y));
        const glm::dvec2 low(std::floor(high.x - 0.8 * line),
                             std::ceil(edge + (unit.empty() ? 0.0 : line)));
        if (high.y < low.y + 3.0 * line)
            return; // the picture is too small for it
        const auto y_of = [&](double value) {
            return glm::mix(high.y, low.y, (value - least) / (most - least));
        };
        fill_box(image, low - pen.rim_px() - 1.0, high + pen.rim_px() + 1.0, pen.rim);
        fill_box(image, low - 1.0, high + 1.0, pen.ink);
        for (double y = low.y; y < high.y; ++y)
            fill_box(
                image, {low.x, y}, {high.x, y + 1.0},
                color_at(function, glm::mix(most, least, (y + 0.5 - low.y) / (high.y - low.y))));
        const int room = std::max(2, static_cast<int>((high.y - low.y) / (1.6 * line)));
        for (const double value : round_values(least, most, std::min(room, 6))) {
            const glm::dvec2 tick(low.x - 1.0, y_of(value));
            const Segment stroke{tick, tick - glm::dvec2(0.25 * line, 0.0)};
            draw_strokes(image, std::span(&stroke, 1), pen);
            draw_text(image, tick - glm::dvec2(0.5 * line, 0.0), {1.0, 0.5},
                      fmt::format("{:.6g}", value), pen);
        }
        draw_text(image, {high.x, edge}, {1.0, 0.0}, unit, pen);
    }

    void note(const std::vector<std::string>& lines) const {
        for (size_t i = 0; i < lines.size(); ++i)
            draw_text(image, {edge, edge + static_cast<double>(i) * pen.line_px}, {0.0, 0.0},
                      lines[i], pen);
    }
};

} // namespace

void annotate(Image& eye, const Scene& scene, const Figure& figure) {
    const double line_px =
        figure.line_px > 0.0 ? figure.line_px : std::max(kLeastLine_px, kLineShare * eye.size_px.y);
    const glm::dvec3 dark(0.0), bright(1.0);
    const Pen pen{line_px, figure.dark_ink ? dark : bright, figure.dark_ink ? bright : dark};
    const Marks marks{eye, pen, glm::dvec2(eye.size_px), std::round(0.6 * line_px)};
    if (figure.letters)
        marks.letters(make_view(scene.camera, eye.size_px));
    if (figure.scale_bar)
        marks.scale_bar(scene.camera);
    if (const TransferFunction* function = color_function(scene); function && figure.color_bar)
        marks.color_bar(*function, figure.unit);
    marks.note(figure.note);
}

const TransferFunction* color_function(const Scene& scene) {
    const TransferFunction* function = nullptr;
    if (!scene.slices.empty())
        function = &scene.slice_transfer;
    else if (scene.ray_cast && scene.ray_cast->mode != RayMode::iso)
        function = &scene.ray_cast->transfer;
    const bool has_range = function && !function->colors.empty() &&
                           function->colors.front().value < function->colors.back().value;
    return has_range ? function : nullptr;
}

std::vector<std::string> note_of(const Scene& scene, const Grid& grid, const std::string& name,
                                 const std::string& unit) {
    std::vector<std::string> lines{name};
    for (const SliceLayer& slice : scene.slices)
        lines.push_back(place_text(grid, slice.point_mm, slice.normal) +
                        (slice.slab_mm > 0.0 ? fmt::format(", slab {:g} mm", slice.slab_mm) : ""));
    const TransferFunction* function = color_function(scene);
    if (function && function->colors.size() == 2)
        lines.push_back(window_text(function->colors.front().value, function->colors.back().value));
    if (scene.ray_cast && scene.ray_cast->mode == RayMode::iso) {
        std::vector<double> values;
        for (const IsoSurface& surface : scene.ray_cast->isos)
            values.push_back(surface.value);
        lines.push_back(
            fmt::format("iso {:g}{}{}", fmt::join(values, ", "), unit.empty() ? "" : " ", unit));
    }
    return lines;
}

} // namespace palpate
