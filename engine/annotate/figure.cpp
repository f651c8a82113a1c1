#include "engine/annotate/figure.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "engine/annotate/legend_width.h"
#include "engine/annotate/measure.h"
#include "engine/annotate/strokes.h"

namespace palpate {

namespace {

constexpr double kLineShare = 1.0 / 26.0, kLeastLine_px = 10.0;

struct Box {
    glm::dvec2 low, high;
};

// How bright what a box of the picture shows is on the average, 0 .. 1.
double brightness(const Image& image, const Box& box, bool transparent) {
    const glm::dvec2 size(image.size_px);
    const glm::uvec2 low(glm::clamp(glm::floor(box.low), glm::dvec2(0.0), size));
    const glm::uvec2 high(glm::clamp(glm::ceil(box.high), glm::dvec2(0.0), size));
    const auto alpha = channel_index(image, "A");
    double sum = 0.0, count = 0.0;
    for (uint32_t y = low.y; y < high.y; ++y)
        for (uint32_t x = low.x; x < high.x; ++x, ++count) {
            sum += 0.2126 * double(image.at(x, y, 0)) + 0.7152 * double(image.at(x, y, 1)) +
                   0.0722 * double(image.at(x, y, 2));
            if (transparent && alpha)
                sum += 1.0 - double(image.at(x, y, *alpha));
        }
    return count > 0.0 ? sum / count : 0.0;
}

double width_px(const std::string& text, double line) {
    return text_width(text) * line / kLine;
}

// With ".." at its end where it has no room.
std::string shortened(std::string text, double line, double most_px) {
    while (width_px(text, line) > most_px && text.size() > 3)
        text.replace(text.size() - 3, 3, "..");
    return text;
}

double line_of(const Figure& figure, glm::uvec2 size_px) {
    return figure.line_px > 0.0 ? figure.line_px : std::max(kLeastLine_px, kLineShare * size_px.y);
}
double edge_of(double line) {
    return std::round(0.6 * line);
}

// The entries of a legend that the picture has room for, in columns. Where all do not fit in
// letters of the figure, the legend's are smaller, down to half.
struct LegendRows {
    std::vector<std::string> texts; // column by column; none where the picture is too small
    size_t whole = 0;               // so many are names; one more counts the others
    size_t rows = 0;                // of a column
    double line = 0.0;              // height of a row
    std::vector<double> lefts;      // where columns begin, behind the first
    double all = 0.0;               // width of all columns, with their patches of colour
};
LegendRows legend_of_line(const std::vector<LegendEntry>& entries, double line, double edge,
                          glm::dvec2 size) {
    const double patch = 1.12 * line, gap = line;
    const double room_px = 0.45 * size.x - edge; // not to the letter below
    const auto rows = static_cast<size_t>(std::max(0.0, (0.42 * size.y - edge) / line));
    LegendRows out{.line = line};
    if (entries.empty() || rows < 2)
        return out;
    out.rows = std::min(rows, entries.size());
    while (out.whole < entries.size()) { // one more column, as wide as its longest name
        const double left = out.lefts.empty() ? 0.0 : out.all + gap;
        double width = 0.0;
        const size_t end = std::min(entries.size(), out.whole + rows);
        for (size_t i = out.whole; i < end; ++i)
            width = std::max(width, width_px(entries[i].name, line));
        width = std::min(width, room_px - patch);
        if (!out.lefts.empty() && left + patch + width > room_px)
            break;
        out.lefts.push_back(left);
        out.all = left + patch + width;
        for (; out.whole < end; ++out.whole)
            out.texts.push_back(shortened(entries[out.whole].name, line, room_px - patch));
    }
    if (out.whole < entries.size()) {
        --out.whole;
        out.texts.back() = fmt::format("and {} more", entries.size() - out.whole);
        out.all = std::max(out.all, out.lefts.back() + patch + width_px(out.texts.back(), line));
    }
    return out;
}
LegendRows legend_rows(const std::vector<LegendEntry>& entries, double line, double edge,
                       glm::dvec2 size) {
    LegendRows out = legend_of_line(entries, line, edge, size);
    for (const double smaller : {0.8, 0.65, 0.5}) {
        if (out.whole == entries.size() || smaller * line < kLeastLine_px)
            break;
        out = legend_of_line(entries, std::round(smaller * line), edge, size);
    }
    return out;
}

struct Marks {
    std::span<Image> eyes;
    const Figure& figure;
    double line; // height of a line
    double edge; // room between marks and the picture's edge

    glm::dvec2 size() const { return glm::dvec2(eyes.front().size_px); }
    double width_of(const std::string& text) const { return width_px(text, line); }

    // For what covers this box, in both eyes.
    Pen pen_on(const Box& box, double line_px) const {
        const bool dark = figure.ink == FigureInk::dark ||
                          (figure.ink == FigureInk::by_picture &&
                           brightness(eyes.front(), box, figure.transparent) > 0.5);
        return {line_px, glm::dvec3(dark ? 0.0 : 1.0), glm::dvec3(dark ? 1.0 : 0.0)};
    }
    void write(glm::dvec2 at, glm::dvec2 anchor, const std::string& text, const Pen& pen) const {
        for (Image& eye : eyes)
            draw_text(eye, at, anchor, text, pen);
    }
    void fill(glm::dvec2 low, glm::dvec2 high, glm::dvec3 color) const {
        for (Image& eye : eyes)
            fill_box(eye, low, high, color);
    }

    void letters(const View& view) const {
        const double large = 1.3 * line;
        const auto letter = [&](glm::dvec2 at, glm::dvec2 anchor, glm::dvec3 towards) {
            const std::string text = letters_of(towards);
            const glm::dvec2 extent = large / kLine * glm::dvec2(text_width(text), kCapital);
            const glm::dvec2 low = at - anchor * extent;
            write(at, anchor, text, pen_on({low, low + extent}, large));
        };
        const glm::dvec2 middle = 0.5 * size();
        letter({edge, middle.y}, {0.0, 0.5}, -view.right);
        letter({size().x - edge, middle.y}, {1.0, 0.5}, view.right);
        letter({middle.x, edge}, {0.5, 0.0}, view.up);
        letter({middle.x, size().y - edge}, {0.5, 1.0}, -view.up);
    }

    void scale_bar(const Camera& camera) const {
        const ScaleBar bar =
            palpate::scale_bar(mm_per_px(camera, eyes.front().size_px), 0.3 * size().x);
        const glm::dvec2 high = size() - edge, low = high - glm::dvec2(bar.px, 0.2 * line);
        std::vector<std::string> lines{length_text(bar.mm)}; // from above
        if (camera.projection == Projection::perspective)
            lines.emplace_back("focal plane");
        double width = bar.px;
        for (const std::string& text : lines)
            width = std::max(width, width_of(text));
        const double top = low.y - static_cast<double>(lines.size()) * line;
        const Pen pen = pen_on({{high.x - width, top}, high}, line);
        const glm::dvec2 rim(pen.rim_px());
        fill(low - rim, high + rim, pen.rim);
        fill(low, high, pen.ink);
        double foot = low.y - 0.3 * line;
        for (size_t i = lines.size(); i-- > 0; foot -= line) {
            const double middle =
                std::min(0.5 * (low.x + high.x), high.x - 0.5 * width_of(lines[i]));
            write({middle, foot}, {0.5, 1.0}, lines[i], pen);
        }
    }

    void color_bar(const TransferFunction& function) const {
        const double least = function.colors.front().value, most = function.colors.back().value;
        const glm::dvec2 high(std::floor(size().x - edge), std::floor(0.44 * size().y));
        const glm::dvec2 low(std::floor(high.x - 0.8 * line),
                             std::ceil(edge + (figure.unit.empty() ? 0.0 : line)));
        if (high.y < low.y + 3.0 * line)
            return; // the picture is too small for it
        const int room = std::clamp(static_cast<int>((high.y - low.y) / (1.6 * line)), 2, 6);
        const std::vector<double> values = round_values(least, most, room);
        double width = 0.0;
        for (const double value : values)
            width = std::max(width, width_of(fmt::format("{:.6g}", value)));
        const Pen pen = pen_on({{low.x - 0.5 * line - width, edge}, high}, line);
        fill(low - pen.rim_px() - 1.0, high + pen.rim_px() + 1.0, pen.rim);
        fill(low - 1.0, high + 1.0, pen.ink);
        for (double y = low.y; y < high.y; ++y)
            fill({low.x, y}, {high.x, y + 1.0},
                 color_at(function, glm::mix(most, least, (y + 0.5 - low.y) / (high.y - low.y))));
        for (const double value : values) {
            const double share = (value - least) / (most - least);
            const glm::dvec2 tick(low.x - 1.0, glm::mix(high.y, low.y, share));
            const Segment stroke{tick, tick - glm::dvec2(0.25 * line, 0.0)};
            for (Image& eye : eyes)
                draw_strokes(eye, std::span(&stroke, 1), pen);
            write(tick - glm::dvec2(0.5 * line, 0.0), {1.0, 0.5}, fmt::format("{:.6g}", value),
                  pen);
        }
        write({high.x, edge}, {1.0, 0.0}, figure.unit, pen);
    }

    void legend() const {
        const std::vector<LegendEntry>& entries = figure.legend;
        const LegendRows rows = legend_rows(entries, line, edge, size());
        if (rows.texts.empty())
            return;
        const double side = 0.7 * rows.line; // of a patch of colour
        const double foot = size().y - edge;
        const double top = foot - static_cast<double>(rows.rows) * rows.line;
        const Pen pen = pen_on({{edge, top}, {edge + rows.all, foot}}, rows.line);
        for (size_t i = 0; i < rows.texts.size(); ++i) {
            const double left = std::round(edge + rows.lefts[i / rows.rows]);
            const double middle =
                std::round(top + (static_cast<double>(i % rows.rows) + 0.5) * rows.line);
            if (i < rows.whole) {
                const glm::dvec2 low(left, std::round(middle - 0.5 * side));
                fill(low - pen.rim_px(), low + std::round(side) + pen.rim_px(), pen.rim);
                fill(low, low + std::round(side), entries[i].color);
            }
            write({left + 1.6 * side, middle}, {0.0, 0.5}, rows.texts[i], pen);
        }
    }

    void note() const {
        const double most_px = 0.45 * size().x - edge; // not to the letter in the middle
        std::vector<std::string> lines = figure.note;
        double width = 0.0;
        for (std::string& text : lines) {
            text = shortened(text, line, most_px);
            width = std::max(width, width_of(text));
        }
        const double height = static_cast<double>(lines.size()) * line;
        const Pen pen = pen_on({{edge, edge}, {edge + width, edge + height}}, line);
        for (size_t i = 0; i < lines.size(); ++i)
            write({edge, edge + static_cast<double>(i) * line}, {0.0, 0.0}, lines[i], pen);
    }
};

} // namespace

void annotate(std::span<Image> eyes, const Scene& scene, const Figure& figure) {
    if (eyes.empty())
        return;
    const glm::uvec2 size = eyes.front().size_px;
    const double line = line_of(figure, size);
    const Marks marks{eyes, figure, line, edge_of(line)};
    if (figure.letters)
        marks.letters(make_view(scene.camera, size));
    if (figure.scale_bar)
        marks.scale_bar(scene.camera);
    if (const TransferFunction* function = color_function(scene); function && figure.color_bar)
        marks.color_bar(*function);
    marks.legend();
    marks.note();
}

double legend_width_px(const Figure& figure, glm::uvec2 size_px) {
    const double line = line_of(figure, size_px), edge = edge_of(line);
    const LegendRows rows = legend_rows(figure.legend, line, edge, glm::dvec2(size_px));
    return rows.texts.empty() ? 0.0 : edge + rows.all + edge;
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
