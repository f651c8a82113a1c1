#include <fmt/format.h>

#include <memory>

#include "apps/palpate/command.h"
#include "apps/palpate/option_checks.h"
#include "apps/palpate/output.h"
#include "engine/base/json.h"
#include "engine/base/log.h"
#include "haptics/device/registry.h"

namespace palpate {

namespace {

using haptics::DeviceCapabilities;
using haptics::DeviceEntry;

struct DevicesOptions {
    std::string name;
    bool json = false, home = false, calibrate = false;
};

std::string usage_of(const DeviceEntry& entry) {
    for (const haptics::DeviceDriver& driver : haptics::device_drivers())
        if (std::string_view(driver.name) == entry.driver && *driver.argument)
            return entry.name + ":" + driver.argument;
    return entry.name;
}

// What is 0 is not known, or not there.
std::string limits_text(const DeviceCapabilities& c) {
    const glm::dvec3 reach_mm = 2e3 * c.workspace_m;
    std::string text = fmt::format("reach {:g} x {:g} x {:g} mm, {:g} Hz", reach_mm.x, reach_mm.y,
                                   reach_mm.z, c.rate_hz);
    const auto add = [&](double value, const char* what, const char* unit) {
        if (value > 0.0)
            text += fmt::format(", {} {:g} {}", what, value, unit);
    };
    add(1e6 * c.resolution_m, "step", "um");
    add(c.max_force_n, "force up to", "N");
    add(c.max_torque_nm, "torque up to", "N m");
    add(c.max_stiffness_n_per_m, "stiffness up to", "N/m");
    add(c.max_damping_n_s_per_m, "damping up to", "N s/m");
    add(1e3 * c.delay_s, "delay", "ms");
    if (c.buttons > 0)
        text += fmt::format(", {} button{}", c.buttons, c.buttons == 1 ? "" : "s");
    if (c.senses_rotation)
        text += ", senses rotation";
    if (c.needs_homing)
        text += ", needs homing";
    if (c.paces)
        text += ", sets the pace";
    add(1e-6 * static_cast<double>(c.watchdog_ns), "own watchdog", "ms");
    return text;
}

Json json_of(const DeviceEntry& entry, size_t number) {
    const DeviceCapabilities& c = entry.capabilities;
    const glm::dvec3 reach_mm = 2e3 * c.workspace_m;
    return {{"number", number},
            {"name", usage_of(entry)},
            {"driver", entry.driver},
            {"description", c.name},
            {"workspace_mm", reach_mm},
            {"resolution_mm", 1e3 * c.resolution_m},
            {"max_force_n", c.max_force_n},
            {"max_torque_nm", c.max_torque_nm},
            {"max_stiffness_n_per_m", c.max_stiffness_n_per_m},
            {"max_damping_n_s_per_m", c.max_damping_n_s_per_m},
            {"rate_hz", c.rate_hz},
            {"delay_ms", 1e3 * c.delay_s},
            {"buttons", c.buttons},
            {"senses_rotation", c.senses_rotation},
            {"needs_homing", c.needs_homing},
            {"sets_pace", c.paces},
            {"watchdog_ms", 1e-6 * static_cast<double>(c.watchdog_ns)}};
}

Result<void> list(const std::vector<DeviceEntry>& entries, size_t first, bool as_json) {
    std::string text;
    Json all = Json::array();
    for (size_t i = 0; i < entries.size(); ++i) {
        const DeviceEntry& entry = entries[i];
        text += fmt::format("{}: {} ({}): {}; {}\n", first + i, usage_of(entry), entry.driver,
                            entry.capabilities.name, limits_text(entry.capabilities));
        all.push_back(json_of(entry, first + i));
    }
    return as_json ? print_report(json_text({{"devices", std::move(all)}})) : print_text(text);
}

Result<void> run_devices(const DevicesOptions& o) {
    std::vector<DeviceEntry> entries = haptics::list_devices();
    if (o.name.empty())
        return list(entries, 0, o.json);
    PALPATE_TRY(DeviceEntry entry, haptics::find_device(o.name));
    if (o.home || o.calibrate) {
        PALPATE_TRY(const auto device, haptics::open_device(entry, {}));
        PALPATE_TRY(o.home ? device->home() : device->calibrate());
        log::info("{} {}", entry.name, o.home ? "is being homed" : "is calibrated");
        return {};
    }
    size_t number = 0;
    while (entries[number].name != entry.name)
        ++number;
    return list({std::move(entry)}, number, o.json);
}

} // namespace

Command add_devices(CLI::App& app) {
    auto o = std::make_shared<DevicesOptions>();
    auto* name = app.add_option("DEVICE", o->name, "One device by name or number (default: all)")
                     ->check(device_name());
    app.add_flag("--json", o->json, "As JSON");
    auto* home = app.add_flag("--home", o->home, "Let it find the ends of its axes")->needs(name);
    app.add_flag("--calibrate", o->calibrate, "Take where its handle is for its known place")
        ->needs(name)
        ->excludes(home);
    return {[o] { return run_devices(*o); }, [] { return std::vector<NamedFile>(); }};
}

} // namespace palpate
