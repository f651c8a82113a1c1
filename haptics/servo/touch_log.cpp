#include "haptics/servo/touch_log.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

namespace {

const char* contact_name(Contact contact) {
    constexpr const char* kNames[] = {"free",      "touching", "yielding",
                                      "submerged", "behind",   "unknown"};
    return kNames[static_cast<size_t>(contact)];
}

// Names joined by '+', so that they stay in one cell.
std::string cell_of(uint32_t faults) {
    std::string text;
    for (const char c : faults ? fault_text(faults) : std::string())
        if (c != ' ')
            text.push_back(c == ',' ? '+' : c);
    return text;
}

std::span<const ServoTick> from(std::span<const ServoTick> ticks, int64_t start_ns) {
    const auto first = std::find_if(ticks.begin(), ticks.end(),
                                    [&](const ServoTick& t) { return t.now_ns >= start_ns; });
    return ticks.subspan(static_cast<size_t>(first - ticks.begin()));
}

} // namespace

std::string touch_csv(std::span<const ServoTick> ticks, int64_t start_ns) {
    std::string text =
        "time_s,probe_x_mm,probe_y_mm,probe_z_mm,proxy_x_mm,proxy_y_mm,proxy_z_mm,"
        "force_x_n,force_y_n,force_z_n,energy_mj,cpu_us,volume_version,depth_mm,"
        "normal_x,normal_y,normal_z,contact,share,faults,buttons,"
        "rendered_x_n,rendered_y_n,rendered_z_n,damping_n,"
        "torque_x_nm,torque_y_nm,torque_z_nm,label\n";
    const auto out = std::back_inserter(text);
    const auto put = [&](glm::dvec3 v) { fmt::format_to(out, "{},{},{},", v.x, v.y, v.z); };
    for (const ServoTick& t : from(ticks, start_ns)) {
        fmt::format_to(out, "{},", static_cast<double>(t.now_ns - start_ns) * 1e-9);
        put(t.tool.position_mm);
        put(t.usable ? t.touched.proxy.position_mm : t.tool.position_mm);
        put(t.sent_world_n);
        fmt::format_to(out, "{},{},{},{},", t.energy_mj, static_cast<double>(t.cpu_ns) * 1e-3,
                       t.scene_version, t.touched.depth_mm);
        put(t.touched.normal);
        fmt::format_to(out, "{},{},{},{},", contact_name(t.touched.contact), t.share,
                       cell_of(t.faults), t.buttons);
        put(t.rendered_world_n);
        fmt::format_to(out, "{},", t.damping_n);
        put(t.sent.torque_nm);
        fmt::format_to(out, "{}\n", t.touched.label);
    }
    return text;
}

TouchSummary summarise(std::span<const ServoTick> ticks, int64_t start_ns) {
    TouchSummary s;
    const auto began =
        std::find_if(ticks.begin(), ticks.end(), [](const ServoTick& t) { return t.share > 0.0; });
    s.began_s = began == ticks.end()
                    ? INFINITY
                    : std::max(0.0, static_cast<double>(began->now_ns - start_ns) * 1e-9);
    glm::dvec3 before(0.0);
    for (const ServoTick& t : from(ticks, start_ns)) {
        if (s.ticks++ > 0)
            s.largest_step_n = std::max(s.largest_step_n, glm::length(t.sent_world_n - before));
        before = t.sent_world_n;
        s.contact_ticks += t.touched.contact != Contact::free;
        s.most_force_n = std::max(s.most_force_n, glm::length(t.sent_world_n));
        s.most_depth_mm = std::max(s.most_depth_mm, t.touched.depth_mm);
        s.energy_mj = t.energy_mj;
        s.faults |= t.faults;
    }
    return s;
}

} // namespace palpate::haptics
