#include "haptics/device/registry.h"

#include <fmt/ranges.h>

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "haptics/device/adapter/adapter.h"
#include "haptics/device/falcon/falcon.h"
#include "haptics/device/gamepad/gamepad.h"
#include "haptics/device/recorded.h"
#include "haptics/device/spacemouse/spacemouse.h"
#include "haptics/device/spacenav/spacenav.h"
#include "haptics/device/transport/hid.h"
#include "haptics/device/transport/usb.h"
#include "haptics/device/wooden/wooden.h"

namespace palpate::haptics {

namespace {

using Opened = Result<std::unique_ptr<HapticDevice>>;

std::vector<DeviceEntry> list_simulated() {
    std::vector<DeviceEntry> entries;
    for (const DevicePreset& preset : device_presets())
        entries.push_back({.name = preset.name, .capabilities = preset.capabilities});
    return entries;
}

Opened open_simulated(const DeviceEntry& entry, const DeviceSetup& setup) {
    const DevicePreset* known = find_device_preset(entry.name);
    if (!known)
        return fail("a simulated device: expected one that is listed, found '{}'", entry.name);
    DevicePreset preset = *known;
    preset.plant.delay_ticks = setup.delay_ticks;
    preset.capabilities.delay_s = setup.delay_ticks / setup.rate_hz;
    return std::make_unique<SimulatedDevice>(preset, setup.hand, setup.path, setup.workspace,
                                             setup.start_ns);
}

// Without a hand there is no reach and no limit but those of the safety chain.
DeviceCapabilities boundless(const char* name) {
    DeviceCapabilities capabilities = find_device_preset("ideal")->capabilities;
    capabilities.name = name;
    capabilities.workspace_m = glm::dvec3(10.0);
    return capabilities;
}

std::vector<DeviceEntry> list_exact() {
    return {{.name = "exact", .capabilities = boundless("follows the path whatever the force")}};
}

Opened open_exact(const DeviceEntry& entry, const DeviceSetup& setup) {
    return std::make_unique<RecordedDevice>(
        entry.capabilities,
        records_of_path(setup.path, setup.workspace, std::llround(1e9 / setup.rate_hz)),
        setup.start_ns);
}

std::vector<DeviceEntry> list_recorded() {
    return {{.name = "recorded", .capabilities = boundless("plays what was recorded")}};
}

Opened open_recorded(const DeviceEntry& entry, const DeviceSetup& setup) {
    PALPATE_TRY(std::vector<DeviceRecord> records, load_device_log(entry.argument));
    if (records.empty())
        return fail("{}: expected at least one record, found none", entry.argument);
    return std::make_unique<RecordedDevice>(entry.capabilities, std::move(records), setup.start_ns);
}

// Several of a kind are numbered from the second on.
DeviceEntry plugged_entry(const Plugged& found, const char* name, size_t before,
                          DeviceCapabilities capabilities) {
    return {.name = before == 0 ? name : fmt::format("{}-{}", name, before + 1),
            .capabilities = std::move(capabilities),
            .node = found.node,
            .refusal = found.refusal};
}

std::vector<DeviceEntry> list_falcons() {
    std::vector<DeviceEntry> entries;
    for (const Plugged& found : plugged_usb())
        if (found.vendor == 0x0403 && found.product == 0xCB48)
            entries.push_back(
                plugged_entry(found, "novint-falcon", entries.size(), falcon_capabilities()));
    return entries;
}

Opened open_falcon(const DeviceEntry& entry, const DeviceSetup& setup) {
    std::vector<std::byte> firmware;
    if (!setup.firmware.empty()) {
        PALPATE_TRY(firmware, falcon::load_firmware(setup.firmware));
    }
    PALPATE_TRY(std::unique_ptr<Transport> transport, open_usb(entry.node, 0));
    return FalconDevice::open(std::move(transport), firmware);
}

// A maker's mice and keyboards share its numbers: the descriptor says which have six axes.
std::vector<Plugged> plugged_spacemice() {
    std::vector<Plugged> all;
    for (Plugged& found : plugged_hid())
        if ((found.vendor == 0x046D || found.vendor == 0x256F) &&
            spacemouse::describe(report_descriptor(found.node)).is_six_axis)
            all.push_back(std::move(found));
    return all;
}

std::vector<DeviceEntry> list_spacemice() {
    std::vector<DeviceEntry> entries;
    for (const Plugged& found : plugged_spacemice())
        entries.push_back(
            plugged_entry(found, "spacemouse", entries.size(), spacemouse_capabilities()));
    return entries;
}

Opened open_spacemouse(const DeviceEntry& entry, const DeviceSetup&) {
    PALPATE_TRY(std::unique_ptr<Transport> transport, open_hid(entry.node));
    return std::make_unique<SpaceMouseDevice>(std::move(transport),
                                              spacemouse::describe(report_descriptor(entry.node)));
}

// The board of an older one, and a Teensy's, whose reports have 64 bytes. Which of the two devices
// it is only the owner knows.
constexpr struct {
    uint16_t vendor, product;
    size_t report_bytes;
} kWoodenBoards[] = {{0x1234, 0x0006, wooden::kReport}, {0x16C0, 0x0486, 64}};

constexpr struct {
    const char* name;
    const wooden::Geometry& geometry;
} kWooden[] = {{"woodenhaptics", wooden::kWoodenHaptics}, {"polhem", wooden::kPolhem}};

std::vector<DeviceEntry> list_wooden() {
    std::vector<DeviceEntry> entries;
    size_t boards = 0;
    for (const Plugged& found : plugged_hid())
        for (const auto& board : kWoodenBoards)
            if (found.vendor == board.vendor && found.product == board.product) {
                for (const auto& device : kWooden)
                    entries.push_back(plugged_entry(found, device.name, boards,
                                                    wooden_capabilities(device.geometry)));
                ++boards;
            }
    return entries;
}

Opened open_wooden(const DeviceEntry& entry, const DeviceSetup&) {
    for (const Plugged& found : plugged_hid())
        for (const auto& board : kWoodenBoards)
            for (const auto& device : kWooden)
                if (found.node == entry.node && found.vendor == board.vendor &&
                    found.product == board.product && entry.name.starts_with(device.name)) {
                    PALPATE_TRY(std::unique_ptr<Transport> transport, open_hid(entry.node));
                    return WoodenDevice::open(std::move(transport), device.geometry,
                                              board.report_bytes);
                }
    return fail("{}: unplugged", entry.name);
}

std::vector<DeviceEntry> list_spacenav() {
    if (::access(SpacenavDevice::kSocket, F_OK) != 0)
        return {};
    return {{.name = "spacenav",
             .capabilities = spacenav_capabilities(),
             .node = SpacenavDevice::kSocket,
             .refusal = refusal_of_node(SpacenavDevice::kSocket)}};
}

Opened open_spacenav(const DeviceEntry& entry, const DeviceSetup&) {
    return SpacenavDevice::open(entry.node);
}

std::vector<DeviceEntry> list_gamepads() {
    std::vector<DeviceEntry> entries;
    for (const Plugged& found : plugged_gamepads())
        entries.push_back(plugged_entry(found, "gamepad", entries.size(), gamepad_capabilities()));
    return entries;
}

Opened open_gamepad(const DeviceEntry& entry, const DeviceSetup&) {
    return GamepadDevice::open(entry.node);
}

std::vector<DeviceEntry> list_adapter() {
    DeviceCapabilities unknown;
    unknown.name = "what the library says";
    return {{.name = "adapter", .capabilities = std::move(unknown)}};
}

Opened open_adapter(const DeviceEntry& entry, const DeviceSetup&) {
    return AdapterDevice::open(entry.argument);
}

const DeviceDriver kDrivers[] = {
    {"simulated", "a mass with a hand on it", "", list_simulated, open_simulated},
    {"exact", "a hand that no force moves", "", list_exact, open_exact},
    {"adapter", "a maker's closed software, by palpate_device.h", "LIBRARY", list_adapter,
     open_adapter},
    {"recorded", "what `palpate touch --record` wrote", "FILE", list_recorded, open_recorded},
    {"novint", "Novint Falcon", "", list_falcons, open_falcon, usb_refusal()},
    {"3dconnexion", "SpaceMouse and its kin, without force", "", list_spacemice, open_spacemouse,
     hid_refusal()},
    {"wooden", "WoodenHaptics and Polhem", "", list_wooden, open_wooden, hid_refusal()},
    {"spacenavd", "a 6-axis device of the daemon spacenavd, without force", "", list_spacenav,
     open_spacenav},
    {"gamepad", "gamepads, without force", "", list_gamepads, open_gamepad},
};

// Devices that are listed while they are plugged in only.
constexpr struct {
    const char *name, *driver, *what;
} kPluggedIn[] = {{"novint-falcon", "novint", "a Novint Falcon that is plugged in"},
                  {"spacemouse", "3dconnexion", "a SpaceMouse that is plugged in"},
                  {"woodenhaptics", "wooden", "a WoodenHaptics that is plugged in"},
                  {"polhem", "wooden", "a Polhem that is plugged in"},
                  {"spacenav", "spacenavd", "the daemon spacenavd, running"},
                  {"gamepad", "gamepad", "a gamepad that is plugged in"}};

// Why a device of that name is not in the list; empty: no device has such a name.
std::string why_absent(std::string_view name) {
    for (const auto& plugged : kPluggedIn)
        if (name.starts_with(plugged.name))
            for (const DeviceDriver& driver : kDrivers)
                if (std::string_view(driver.name) == plugged.driver)
                    return driver.refusal ? fmt::format("{}: {}", name, driver.refusal)
                                          : fmt::format(
                                                "{}: expected {}, found none; check its cable and "
                                                "power, and see `palpate devices`",
                                                name, plugged.what);
    return {};
}

// Null where there is none.
const DeviceDriver* driver_of(const DeviceEntry& entry) {
    const auto* found = std::find_if(
        std::begin(kDrivers), std::end(kDrivers),
        [&](const DeviceDriver& driver) { return std::string_view(driver.name) == entry.driver; });
    return found != std::end(kDrivers) ? found : nullptr;
}

} // namespace

std::span<const DeviceDriver> device_drivers() {
    return kDrivers;
}

std::vector<DeviceEntry> list_devices() {
    std::vector<DeviceEntry> all;
    for (const DeviceDriver& driver : kDrivers)
        for (DeviceEntry& entry : driver.list()) {
            entry.driver = driver.name;
            all.push_back(std::move(entry));
        }
    return all;
}

Result<DeviceEntry> find_device(std::string_view text) {
    const size_t colon = text.find(':');
    const std::string_view name = text.substr(0, colon);
    std::vector<DeviceEntry> all = list_devices();
    size_t number = all.size();
    if (const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
        error != std::errc() || end != name.data() + name.size())
        number = all.size();
    std::vector<std::string> names;
    for (size_t i = 0; i < all.size(); ++i) {
        const std::string argument = driver_of(all[i])->argument;
        const std::string usage = all[i].name + (argument.empty() ? "" : ":") + argument;
        names.push_back(usage);
        if (i != number && all[i].name != name)
            continue;
        if (argument.empty() != (colon == text.npos) || (colon + 1 == text.size()))
            return fail("expected the device {}, found '{}'", usage, text);
        if (colon != text.npos)
            all[i].argument = text.substr(colon + 1);
        if (all[i].driver == std::string_view("adapter"))
            all[i].node = all[i].argument; // a person moves it
        return all[i];
    }
    if (const std::string why = why_absent(name); !why.empty())
        return fail("{}", why);
    return fail("expected a device, one of {} or its number, found '{}'", fmt::join(names, ", "),
                text);
}

Result<std::unique_ptr<HapticDevice>> open_device(const DeviceEntry& entry,
                                                  const DeviceSetup& setup) {
    const DeviceDriver* driver = driver_of(entry);
    if (!driver)
        return fail("a device: expected one that is listed, found one of the driver '{}'",
                    entry.driver);
    if (!(setup.rate_hz >= 1.0 && setup.rate_hz <= 1e6))
        return fail("a device: expected a rate of 1 to 1000000 Hz, found {}", setup.rate_hz);
    if (setup.delay_ticks > DevicePlant::kMostDelayTicks)
        return fail("a device: expected a delay of 0 to {} ticks, found {}",
                    DevicePlant::kMostDelayTicks, setup.delay_ticks);
    return driver->open(entry, setup);
}

} // namespace palpate::haptics
