#include "apps/palpate/touch_page.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "apps/palpate/touch_page_script.h"
#include "engine/page/page_of.h"
#include "haptics/servo/touch_log.h"

namespace palpate {

namespace {

using haptics::ServoTick;

constexpr size_t kColumns = 888; // a pixel each

struct Curve {
    const char* name;
    int color; // of the page's
    std::function<double(const ServoTick&)> value;
    bool dashed = false;
};

Json curve_json(std::span<const ServoTick> ticks, const Curve& curve) {
    std::vector<double> low(kColumns, NAN), high(kColumns, NAN); // not a number becomes null
    for (size_t i = 0; i < ticks.size(); ++i) {
        const size_t column = i * kColumns / ticks.size();
        const double value = curve.value(ticks[i]);
        if (!std::isfinite(value))
            continue;
        low[column] = std::fmin(low[column], value);
        high[column] = std::fmax(high[column], value);
    }
    return {{"name", curve.name},
            {"color", curve.color},
            {"dashed", curve.dashed},
            {"low", low},
            {"high", high}};
}

Json panel_json(std::span<const ServoTick> ticks, const std::string& title,
                const std::vector<Curve>& curves) {
    Json all = Json::array();
    for (const Curve& curve : curves)
        all.push_back(curve_json(ticks, curve));
    return {{"title", title}, {"curves", all}};
}

std::string summary_text(const haptics::TouchSummary& s) {
    return fmt::format(
        "{} ticks, {:.1f} % in contact; largest force {:.3g} N, largest change of force from one "
        "tick to the next {:.3g} N; largest distance from probe to proxy {:.3g} mm; work {:.3g} "
        "mJ; faults: {}.",
        s.ticks,
        s.ticks ? 100.0 * static_cast<double>(s.contact_ticks) / static_cast<double>(s.ticks) : 0.0,
        s.most_force_n, s.largest_step_n, s.most_depth_mm, s.energy_mj,
        haptics::fault_text(s.faults));
}

} // namespace

std::string touch_page(std::span<const ServoTick> ticks, int64_t start_ns,
                       const std::string& title) {
    while (!ticks.empty() && ticks.front().now_ns < start_ns)
        ticks = ticks.subspan(1);
    const auto seconds = [&](const ServoTick& t) {
        return static_cast<double>(t.now_ns - start_ns) * 1e-9;
    };
    // Positions beside the first one: a path of millimetres may lie anywhere in a volume.
    const auto first =
        std::find_if(ticks.begin(), ticks.end(), [](const ServoTick& t) { return t.usable; });
    const glm::dvec3 origin_mm = first == ticks.end() ? glm::dvec3(0.0) : first->tool.position_mm;
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
    Json panels = Json::array();
    panels.push_back(panel_json(ticks,
                                fmt::format("Position, mm, from {:.1f}, {:.1f}, {:.1f}",
                                            origin_mm.x, origin_mm.y, origin_mm.z),
                                {{"proxy x", 0, proxy(0), true},
                                 {"proxy y", 1, proxy(1), true},
                                 {"proxy z", 2, proxy(2), true},
                                 {"probe x", 0, probe(0)},
                                 {"probe y", 1, probe(1)},
                                 {"probe z", 2, probe(2)}}));
    panels.push_back(
        panel_json(ticks, "Force on the hand, N",
                   {{"x", 0, force(0)},
                    {"y", 1, force(1)},
                    {"z", 2, force(2)},
                    {"size", 3, [](const ServoTick& t) { return glm::length(t.sent_world_n); }}}));
    panels.push_back(panel_json(ticks,
                                "Work done on the hand, mJ (above 0: the simulation added energy)",
                                {{"energy", 3, [](const ServoTick& t) { return t.energy_mj; }}}));
    panels.push_back(panel_json(
        ticks, "Penetration of the probe, mm",
        {{"distance to the proxy", 1, [](const ServoTick& t) { return t.touched.depth_mm; }}}));
    panels.push_back(panel_json(ticks, "Processor time of a tick, us",
                                {{"thread clock", 0, [](const ServoTick& t) {
                                      return static_cast<double>(t.cpu_ns) * 1e-3;
                                  }}}));
    const Json run{{"title", title},
                   {"summary", summary_text(haptics::summarise(ticks, start_ns))},
                   {"from_s", ticks.empty() ? 0.0 : seconds(ticks.front())},
                   {"to_s", ticks.empty() ? 1.0 : seconds(ticks.back())},
                   {"panels", panels}};
    return page_of(kTouchPageScript, Json::array({run}));
}

} // namespace palpate
