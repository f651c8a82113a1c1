#include <algorithm>

#include "apps/palpate/devices_checklist.h"
#include "engine/base/printable.h"

namespace palpate {

namespace {

using haptics::Checklist;

constexpr double kWidth = 640.0, kHeight = 160.0;

// Text within HTML.
std::string plain(const std::string& text) {
    std::string out;
    for (const char c : printable(text))
        out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
    return out;
}

std::string row(const std::string& name, const std::string& value) {
    return fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", name, value);
}

std::string places_text(const Checklist::Places& p) {
    const glm::dvec3 range = p.high_mm - p.low_mm;
    return fmt::format("{:.3f} x {:.3f} x {:.3f} mm; smallest steps {:.4f}, {:.4f}, {:.4f} mm",
                       range.x, range.y, range.z, p.step_mm.x, p.step_mm.y, p.step_mm.z);
}

std::string histogram(const std::vector<uint32_t>& bins) {
    const uint32_t most = std::max(1u, *std::max_element(bins.begin(), bins.end()));
    const double width = kWidth / static_cast<double>(bins.size());
    std::string svg = fmt::format("<svg viewBox='0 0 {:g} {:g}'>", kWidth, kHeight + 20);
    for (size_t i = 0; i < bins.size(); ++i) {
        const double height = kHeight * bins[i] / most;
        svg += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}'/>",
                           width * static_cast<double>(i), kHeight - height, 0.9 * width, height);
    }
    const double last_ms = Checklist::kBin_ms * static_cast<double>(bins.size());
    for (int ms = 0; ms <= static_cast<int>(last_ms); ++ms)
        svg += fmt::format("<text x='{:.1f}' y='{:g}'>{} ms</text>", kWidth * ms / last_ms,
                           kHeight + 15, ms);
    return svg + "</svg>\n";
}

std::string curve(const Checklist::Push& push) {
    double low = 0.0, high = 0.1;
    for (const double mm : push.moved_mm) {
        low = std::min(low, mm);
        high = std::max(high, mm);
    }
    std::string points;
    for (size_t i = 0; i < push.moved_mm.size(); ++i)
        points += fmt::format(
            "{:.1f},{:.1f} ",
            kWidth * static_cast<double>(i + 1) / static_cast<double>(push.moved_mm.size()),
            kHeight * (high - push.moved_mm[i]) / (high - low));
    return fmt::format(
        "<svg viewBox='0 0 {:g} {:g}'><polyline points='{}'/>"
        "<text x='0' y='12'>{:.2f} mm</text><text x='0' y='{:g}'>{:.2f} mm</text></svg>\n",
        kWidth, kHeight + 4, points, high, kHeight, low);
}

} // namespace

std::string checklist_page(const Checklist& list, const std::string& title, const Json& device) {
    const Checklist::Times& t = list.times;
    std::string html = fmt::format(
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>{0}</title><style>"
        "body{{font:15px sans-serif;max-width:680px;margin:2em auto}}"
        "th{{text-align:left;padding-right:1em;vertical-align:top}}"
        "svg{{width:100%;background:#f4f4f4}}rect{{fill:#2b6cb0}}text{{font-size:11px}}"
        "polyline{{fill:none;stroke:#c05621;stroke-width:2}}</style>\n"
        "<h1>{0}</h1>\n<table>\n",
        plain(title));
    const Json* const kind = device.find("description");
    html += row("device", kind ? plain(kind->string) : "");
    html += row("homed", list.was_homed        ? "already"
                         : list.homed_s >= 0.0 ? fmt::format("in {:.1f} s", list.homed_s)
                                               : "has no homing");
    html += row("left alone", places_text(list.rest));
    html += row("moved", places_text(list.ends));
    for (const auto& [bit, seen] : list.lights)
        html += row(fmt::format("light bit 0x{:x}", bit), seen.empty() ? "no answer" : plain(seen));
    html += "</table>\n<h2>Time from a command to its sample</h2>\n";
    html += histogram(t.bins);
    html += fmt::format(
        "<p>{} samples, {} exchanges without one. Median {:.2f} ms, 95 % {:.2f} ms, 99 % {:.2f} "
        "ms, longest {:.2f} ms. The last bar holds all that took longer.</p>\n",
        t.count, t.stale, t.p50_ms, t.p95_ms, t.p99_ms, t.max_ms);
    if (list.pushes.empty())
        html += "<h2>Pushes</h2><p>None: force was not allowed, or the device gives none.</p>\n";
    for (const Checklist::Push& push : list.pushes) {
        html +=
            fmt::format("<h2>Push of {:g} N along ({:g}, {:g}, {:g})</h2>\n", Checklist::kForce_n,
                        push.direction.x, push.direction.y, push.direction.z);
        html += curve(push);
        html += fmt::format(
            "<p>{}; to a side at most {:.2f} mm{}.</p>\n",
            push.delay_ms < 0.0 ? std::string("It did not move along")
                                : fmt::format("It moved along after {:.1f} ms", push.delay_ms),
            push.across_mm, push.was_stopped ? "; too far or too fast, so the force ended" : "");
    }
    return html + "</html>\n";
}

} // namespace palpate
