#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "haptics/servo/touch_log.h"

namespace palpate::haptics {

namespace {

constexpr double kWidth = 960, kHeight = 240, kLeft = 62, kRight = 950, kTop = 26, kBottom = 210;
constexpr int kColumns = 888; // a pixel each

struct Curve {
    const char* name;
    const char* color; // a class of the style below
    std::function<double(const ServoTick&)> value;
};
struct Panel {
    const char* title;
    std::vector<Curve> curves;
};

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
        switch (c) {
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '&':
                out += "&amp;";
                break;
            default:
                out.push_back(c);
        }
    return out;
}

// A round step that divides a span into 3 to 8 parts.
double round_step(double span) {
    double step = std::pow(10.0, std::floor(std::log10(span / 3.0)));
    for (const double factor : {2.0, 2.5, 2.0})
        if (span / step > 8.0)
            step *= factor;
    return step;
}

struct Column {
    double low = INFINITY, high = -INFINITY;
};

// Ticks of a curve by pixel column.
std::vector<Column> columns_of(std::span<const ServoTick> ticks, const Curve& curve) {
    std::vector<Column> columns(kColumns);
    for (size_t i = 0; i < ticks.size(); ++i) {
        Column& column = columns[i * kColumns / ticks.size()];
        const double value = curve.value(ticks[i]);
        if (!std::isfinite(value))
            continue;
        column.low = std::min(column.low, value);
        column.high = std::max(column.high, value);
    }
    return columns;
}

void draw(std::string& page, const Panel& panel, std::span<const ServoTick> ticks, double start_s,
          double end_s) {
    std::vector<std::vector<Column>> all;
    double low = 0.0, high = 0.0;
    bool any = false;
    for (const Curve& curve : panel.curves) {
        all.push_back(columns_of(ticks, curve));
        for (const Column& c : all.back())
            if (c.low <= c.high) {
                low = any ? std::min(low, c.low) : c.low;
                high = any ? std::max(high, c.high) : c.high;
                any = true;
            }
    }
    if (high - low < 1e-9 * std::max(1.0, std::abs(low)))
        high = low + 1.0;
    const double pad = 0.05 * (high - low);
    low -= pad;
    high += pad;
    const auto y = [&](double v) { return kBottom - (v - low) / (high - low) * (kBottom - kTop); };
    const auto x = [&](double s) {
        return kLeft + (s - start_s) / std::max(end_s - start_s, 1e-9) * (kRight - kLeft);
    };
    const auto out = std::back_inserter(page);
    fmt::format_to(out, "<h2>{}</h2>\n<svg viewBox=\"0 0 {} {}\" role=\"img\">\n", panel.title,
                   kWidth, kHeight);
    const double value_step = round_step(high - low);
    for (double v = std::ceil(low / value_step) * value_step; v <= high; v += value_step) {
        const double shown = std::abs(v) < 1e-9 * value_step ? 0.0 : v;
        fmt::format_to(
            out,
            "<line class=\"grid\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/>"
            "<text class=\"soft\" x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:.6g}</text>\n",
            kLeft, kRight, y(v), y(v), kLeft - 6, y(v) + 4, shown);
    }
    const double time_step = round_step(std::max(end_s - start_s, 1e-9));
    for (double s = std::ceil(start_s / time_step) * time_step; s <= end_s; s += time_step)
        fmt::format_to(
            out,
            "<line class=\"grid\" x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{}\" y2=\"{}\"/>"
            "<text class=\"soft\" x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:.6g} s</text>\n",
            x(s), x(s), kTop, kBottom, x(s), kBottom + 16, s);
    double legend = kLeft;
    for (size_t c = 0; c < panel.curves.size(); ++c) {
        page += fmt::format("<path class=\"{}\" d=\"", panel.curves[c].color);
        bool down = false;
        for (int i = 0; i < kColumns; ++i) {
            const Column& column = all[c][static_cast<size_t>(i)];
            if (column.low > column.high) {
                continue;
            }
            fmt::format_to(out, "{}{:.1f} {:.2f}V{:.2f}", down ? "L" : "M", kLeft + i + 0.5,
                           y(column.high), y(column.low));
            down = true;
        }
        page += "\"/>\n";
        fmt::format_to(out,
                       "<path class=\"{}\" d=\"M{} 12h18\"/><text x=\"{}\" y=\"16\">{}</text>\n",
                       panel.curves[c].color, legend, legend + 24, panel.curves[c].name);
        legend += 40 + 7.0 * static_cast<double>(std::string_view(panel.curves[c].name).size());
    }
    page += "</svg>\n";
}

constexpr const char* kStyle = R"(<style>
:root { color-scheme: light dark; --page: #fbfbfa; --ink: #1b1d21; --soft: #5d6470; --grid: #e3e5e9;
  --c0: #0b61c4; --c1: #b5480f; --c2: #14804a; --c3: #7a3db8; }
@media (prefers-color-scheme: dark) { :root { --page: #14161a; --ink: #e8eaee; --soft: #a2a9b5;
  --grid: #2a2e36; --c0: #6fb1ff; --c1: #ff9d66; --c2: #5fd39b; --c3: #cfa0ff; } }
body { margin: 0 auto; max-width: 1000px; padding: 20px; background: var(--page); color: var(--ink);
  font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; }
h1 { font-size: 22px; margin: 0 0 4px; } h2 { font-size: 15px; margin: 22px 0 2px; }
svg { width: 100%; height: auto; display: block; } text { fill: var(--ink); font-size: 12px; }
.soft { color: var(--soft); fill: var(--soft); } .grid { stroke: var(--grid); }
path { fill: none; stroke-width: 1.4; stroke-linejoin: round; }
.c0 { stroke: var(--c0); } .c1 { stroke: var(--c1); } .c2 { stroke: var(--c2); }
.c3 { stroke: var(--c3); } .thin { stroke: var(--soft); stroke-dasharray: 4 3; }
</style>
)";

} // namespace

std::string touch_page(std::span<const ServoTick> ticks, int64_t start_ns,
                       const std::string& title) {
    while (!ticks.empty() && ticks.front().now_ns < start_ns)
        ticks = ticks.subspan(1);
    const auto seconds = [&](const ServoTick& t) {
        return static_cast<double>(t.now_ns - start_ns) * 1e-9;
    };
    const double start_s = ticks.empty() ? 0.0 : seconds(ticks.front());
    const double end_s = ticks.empty() ? 1.0 : seconds(ticks.back());
    // A way of millimetres somewhere in a volume of decimetres: beside where it began.
    glm::dvec3 origin_mm(0.0);
    for (const ServoTick& t : ticks)
        if (t.usable) {
            origin_mm = t.tool.position_mm;
            break;
        }
    const auto probe = [=](int axis) {
        return [=](const ServoTick& t) {
            return t.usable ? t.tool.position_mm[axis] - origin_mm[axis] : NAN;
        };
    };
    const auto proxy = [=](int axis) {
        return [=](const ServoTick& t) {
            return t.usable ? t.touched.proxy.position_mm[axis] - origin_mm[axis] : NAN;
        };
    };
    const auto force = [](int axis) {
        return [axis](const ServoTick& t) { return t.sent_world_n[axis]; };
    };
    const std::string position_title =
        fmt::format("Position, mm, from where it began: {:.1f}, {:.1f}, {:.1f}", origin_mm.x,
                    origin_mm.y, origin_mm.z);
    const Panel panels[] = {
        {position_title.c_str(),
         {{"proxy x", "thin", proxy(0)},
          {"proxy y", "thin", proxy(1)},
          {"proxy z", "thin", proxy(2)},
          {"probe x", "c0", probe(0)},
          {"probe y", "c1", probe(1)},
          {"probe z", "c2", probe(2)}}},
        {"Force on the hand, N",
         {{"x", "c0", force(0)},
          {"y", "c1", force(1)},
          {"z", "c2", force(2)},
          {"size", "c3", [](const ServoTick& t) { return glm::length(t.sent_world_n); }}}},
        {"Work done on the hand, mJ (above 0: made from nothing)",
         {{"energy", "c3", [](const ServoTick& t) { return t.energy_mj; }}}},
        {"Penetration of the probe, mm",
         {{"distance to the proxy", "c1", [](const ServoTick& t) { return t.touched.depth_mm; }}}},
        {"Processor time of a tick, us",
         {{"thread clock", "c0",
           [](const ServoTick& t) { return static_cast<double>(t.cpu_ns) * 1e-3; }}}},
    };
    const TouchSummary s = summarise(ticks, start_ns);
    std::string page =
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<title>" +
        escaped(title) + "</title>\n" + kStyle + "</head><body>\n<h1>" + escaped(title) + "</h1>\n";
    page += fmt::format(
        "<p class=\"soft\">{} ticks, {:.1f} % in contact; force at most {:.3g} N, at most {:.3g} N "
        "from one tick to the next; probe at most {:.3g} mm from the proxy; work {:.3g} mJ; "
        "faults: "
        "{}.</p>\n",
        s.ticks,
        s.ticks ? 100.0 * static_cast<double>(s.contact_ticks) / static_cast<double>(s.ticks) : 0.0,
        s.most_force_n, s.largest_step_n, s.most_depth_mm, s.energy_mj, fault_text(s.faults));
    for (const Panel& panel : panels)
        draw(page, panel, ticks, start_s, end_s);
    return page + "</body></html>\n";
}

} // namespace palpate::haptics
