#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "apps/palpate/command.h"
#include "engine/base/memory.h"
#include "engine/gpu/device.h"
#include "engine/gpu/error.h"
#include "haptics/device/registry.h"

namespace palpate {

namespace {

const char* kind_of(const DeviceInfo& info) {
    switch (info.type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return "discrete GPU";
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return "integrated GPU";
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return "virtual GPU";
        case VK_PHYSICAL_DEVICE_TYPE_CPU:
            return "CPU";
        default:
            return "other";
    }
}

// True where a device can be used.
bool report_devices() {
    bool usable = false;
    try {
        const auto devices = list_devices();
        fmt::print("Vulkan devices:{}\n", devices.empty() ? " none" : "");
        for (const DeviceInfo& device : devices) {
            fmt::print("  {}: {} ({}, {}), {} MiB, Vulkan {}.{}: {}\n", device.index, device.name,
                       kind_of(device), device.driver, device.memory_bytes >> 20,
                       VK_API_VERSION_MAJOR(device.api_version),
                       VK_API_VERSION_MINOR(device.api_version),
                       device.refusal.empty() ? "can be used" : device.refusal);
            usable = usable || device.refusal.empty();
        }
        if (!usable)
            fmt::print("  Without a GPU, the package mesa-vulkan-drivers brings lavapipe.\n");
        else
            fmt::print("  chosen by default: {}\n", GpuDevice(DeviceOptions{}).info().name);
    } catch (const GpuError& error) {
        fmt::print("Vulkan devices: {}\n", error.what());
    }
    return usable;
}

void report_validation() {
    try {
        const GpuDevice device({.validation = true});
        fmt::print("Vulkan validation: installed\n");
    } catch (const GpuError& error) {
        fmt::print("Vulkan validation: not available ({}); only tests need it\n", error.what());
    }
}

void report_real_time() {
    rlimit priority{}, locked{};
    ::getrlimit(RLIMIT_RTPRIO, &priority);
    ::getrlimit(RLIMIT_MEMLOCK, &locked);
    const sched_param wish{.sched_priority = 1};
    const sched_param normal{.sched_priority = 0};
    const bool allowed = ::sched_setscheduler(0, SCHED_FIFO, &wish) == 0;
    if (allowed)
        ::sched_setscheduler(0, SCHED_OTHER, &normal);
    fmt::print("Real-time policy: {}\n",
               allowed ? "permitted"
                       : "not permitted; add '@audio - rtprio 80' to /etc/security/limits.d and "
                         "join that group");
    if (locked.rlim_cur == RLIM_INFINITY)
        fmt::print("Lockable memory: unlimited\n");
    else
        fmt::print("Lockable memory: {} KiB\n", locked.rlim_cur >> 10);
}

void report_haptic_devices() {
    std::string found;
    for (const haptics::DeviceEntry& entry : haptics::list_devices())
        if (!entry.node.empty())
            found += fmt::format("  {}: {}\n", entry.name,
                                 entry.refusal.empty() ? "can be used" : entry.refusal);
    fmt::print("Haptic devices:{}\n{}", found.empty() ? " none is plugged in" : "", found);
    for (const haptics::DeviceDriver& driver : haptics::device_drivers())
        if (driver.refusal)
            fmt::print("  {}: {}\n", driver.purpose, driver.refusal);
    if (found.find("novint-falcon") != std::string::npos)
        fmt::print(
            "Firmware of a Novint Falcon: Palpate has none; `palpate devices novint-falcon "
            "--firmware FILE` loads that of its owner's software\n");
    bool has_rules = false;
    for (const char* folder : {"/etc/udev/rules.d", "/lib/udev/rules.d", "/usr/lib/udev/rules.d",
                               "/usr/local/lib/udev/rules.d", "/run/udev/rules.d"})
        has_rules = has_rules ||
                    std::filesystem::exists(std::filesystem::path(folder) / "70-palpate.rules");
    fmt::print("Permission for haptic devices (70-palpate.rules): {}\n",
               has_rules ? "installed"
                         : "not installed; copy share/palpate/udev/70-palpate.rules to "
                           "/etc/udev/rules.d and plug the device in again");
}

void report_display() {
    const char *x11 = std::getenv("DISPLAY"), *wayland = std::getenv("WAYLAND_DISPLAY");
    const bool has_one = (x11 && *x11) || (wayland && *wayland);
    fmt::print("Display for `palpate view`: {}\n",
               has_one ? (wayland && *wayland ? wayland : x11)
                       : "none; DISPLAY and WAYLAND_DISPLAY are not set");
}

Result<void> run_doctor() {
    const bool usable = report_devices();
    report_validation();
    fmt::print("Memory: {} MiB\n", physical_memory_bytes() >> 20);
    report_real_time();
    report_display();
    report_haptic_devices();
    std::fflush(stdout);
    if (!usable)
        return fail("no Vulkan device can be used; pictures cannot be drawn");
    return {};
}

} // namespace

Command add_doctor(CLI::App&) {
    return {[] { return run_doctor(); }, [] { return std::vector<NamedFile>(); }};
}

} // namespace palpate
