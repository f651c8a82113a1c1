#include <fmt/format.h>

#include <memory>
#include <utility>

#include "apps/palpate/command.h"
#include "apps/palpate/devices_checklist.h"
#include "engine/base/json.h"
#include "engine/base/log.h"
#include "engine/program/interrupt.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "haptics/core/clock.h"
#include "haptics/device/registry.h"

namespace palpate {

namespace {

using haptics::DeviceCapabilities;
using haptics::DeviceEntry;

constexpr const char* kTest = "test";

struct DevicesOptions {
    std::vector<std::string> words; // a device, or `test` and a device
    std::string firmware, report, page;
    bool json = false, home = false, calibrate = false, is_armed = false;
    double move_s = 15.0;

    bool tests() const { return !words.empty() && words.front() == kTest; }
    std::string name() const { return words.empty() ? "" : words.back(); }
};

// Checks the words and options together.
Result<void> check_together(const DevicesOptions& o) {
    if (o.words.size() > 1 && !o.tests())
        return fail("expected a device, or test and a device, found '{} {}'", o.words[0],
                    o.words[1]);
    if (o.tests() && o.words.size() < 2)
        return fail("test: expected the name or number of a device, found none");
    if (o.tests() && (o.json || o.home || o.calibrate))
        return fail("test: expected no --json, --home or --calibrate; it homes by itself");
    if (!o.tests() && (o.is_armed || !o.report.empty() || !o.page.empty()))
        return fail("--arm, --report and --page: expected with test DEVICE");
    return {};
}

std::string usage_of(const DeviceEntry& entry) {
    for (const haptics::DeviceDriver& driver : haptics::device_drivers())
        if (std::string_view(driver.name) == entry.driver && *driver.argument)
            return entry.name + ":" + driver.argument;
    return entry.name;
}

// A figure of 0 is not known, or its feature is not there.
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
            {"node", entry.node},
            {"refusal", entry.refusal},
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
        text += fmt::format("{}: {} ({}): {}; {}{}\n", first + i, usage_of(entry), entry.driver,
                            entry.capabilities.name, limits_text(entry.capabilities),
                            entry.refusal.empty() ? "" : "; cannot be used: " + entry.refusal);
        all.push_back(json_of(entry, first + i));
    }
    return as_json ? print_report(json_text({{"devices", std::move(all)}})) : print_text(text);
}

// Exchanges samples without force until the device knows where it is.
Result<void> wait_until_homed(haptics::HapticDevice& device, const std::string& name) {
    constexpr int64_t kPatience_ns = 60'000'000'000, kTick_ns = 1'000'000;
    const Interrupt interrupt;
    const int64_t until_ns = haptics::monotonic_ns() + kPatience_ns;
    bool told = false;
    for (int64_t now_ns = haptics::monotonic_ns(); now_ns < until_ns;) {
        if (device.capabilities().paces)
            device.wait(now_ns + kTick_ns);
        haptics::sleep_until(now_ns + kTick_ns);
        now_ns = haptics::monotonic_ns();
        haptics::DeviceSample sample;
        switch (device.read(now_ns, sample)) {
            case haptics::DeviceStatus::ok:
                log::info("{} is homed", name);
                return {};
            case haptics::DeviceStatus::gone:
                return fail("{}: unplugged, or it does not answer any more", name);
            default:
                break;
        }
        device.write(now_ns, {});
        if (!std::exchange(told, true))
            log::info("{}: pull the grip all the way out, then push it in", name);
        if (interrupt.token().stop_requested())
            return fail("{}: interrupted before it was homed", name);
    }
    return fail("{}: not homed within {} s", name, kPatience_ns / 1'000'000'000);
}

Result<void> run_devices(const DevicesOptions& o) {
    std::vector<DeviceEntry> entries = haptics::list_devices();
    if (o.words.empty()) {
        for (const haptics::DeviceDriver& driver : haptics::device_drivers())
            if (driver.refusal)
                log::warning("{}: {}", driver.purpose, driver.refusal);
        return list(entries, 0, o.json);
    }
    PALPATE_TRY(DeviceEntry entry, haptics::find_device(o.name()));
    if (o.tests()) {
        Json described = json_of(entry, 0);
        described.members.erase(described.members.begin()); // its number depends on the others
        return run_devices_test({.name = o.name(),
                                 .firmware = o.firmware,
                                 .report = o.report,
                                 .page = o.page,
                                 .is_armed = o.is_armed,
                                 .move_s = o.move_s},
                                entry, std::move(described));
    }
    if (o.home || o.calibrate || !o.firmware.empty()) {
        PALPATE_TRY(const auto device, haptics::open_device(entry, {.firmware = o.firmware}));
        if (!o.firmware.empty())
            log::info("{} runs its firmware", entry.name);
        if (o.calibrate) {
            PALPATE_TRY(device->calibrate());
            log::info("{} is calibrated", entry.name);
        }
        if (o.home) {
            PALPATE_TRY(device->home());
            PALPATE_TRY(wait_until_homed(*device, entry.name));
        }
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
    const CLI::Validator is_device = device_name();
    auto* name = app.add_option("DEVICE", o->words,
                                "One device by name or number (default: all); test DEVICE runs the "
                                "owner's checklist and prints what it found")
                     ->expected(0, 2)
                     ->check(CLI::Validator(
                         [is_device](std::string& text) {
                             return text == kTest ? std::string() : is_device(text);
                         },
                         ""));
    app.add_flag("--json", o->json, "As JSON");
    auto* home = app.add_flag("--home", o->home, "Let it find the ends of its axes")->needs(name);
    app.add_option("--firmware", o->firmware,
                   "The maker's firmware of a Novint Falcon, from its owner's software; it is kept "
                   "until the device's power goes")
        ->type_name("FILE")
        ->needs(name);
    app.add_flag("--calibrate", o->calibrate, "Take where its handle is for its known place")
        ->needs(name)
        ->excludes(home);
    app.add_flag("--arm", o->is_armed,
                 "Let test push the handle with 1 N without asking; somebody holds it");
    app.add_option("--move", o->move_s,
                   "How long test waits for the handle to be moved to its ends, s; 0: not at all")
        ->check(within(0.0, 600.0))
        ->capture_default_str();
    app.add_option("--report", o->report, "What test found, as JSON (default: standard output)")
        ->type_name("FILE.json");
    app.add_option("--page", o->page, "What test found, as one HTML page (default: none)")
        ->type_name("FILE.html");
    refuse_where_wrong(app, [o] { return check_together(*o); });
    return {[o] { return run_devices(*o); },
            [o] {
                return std::vector<NamedFile>{{"--firmware", o->firmware},
                                              {"--report", o->report, FileUse::write_text},
                                              {"--page", o->page, FileUse::write}};
            }};
}

} // namespace palpate
