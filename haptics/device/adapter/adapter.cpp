#include "haptics/device/adapter/adapter.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <span>

namespace palpate::haptics {

namespace {

DeviceStatus status_of(int status) {
    switch (status) {
        case PALPATE_DEVICE_OK:
            return DeviceStatus::ok;
        case PALPATE_DEVICE_STALE:
            return DeviceStatus::stale;
        case PALPATE_DEVICE_NOT_HOMED:
            return DeviceStatus::not_homed;
        default: // also what this version does not know
            return DeviceStatus::gone;
    }
}

bool is_positive(double value) {
    return std::isfinite(value) && value > 0.0;
}
bool is_limit(double value) {
    return std::isfinite(value) && value >= 0.0;
}

Result<DeviceCapabilities> checked(const palpate_device_capabilities& c, const std::string& file) {
    const std::span name(c.name);
    const auto end = std::find(name.begin(), name.end(), '\0');
    if (end == name.end() || end == name.begin())
        return fail("{}: expected a device with a name of 1 to 63 bytes, found none", file);
    const bool is_sound = is_positive(c.workspace_m[0]) && is_positive(c.workspace_m[1]) &&
                          is_positive(c.workspace_m[2]) && is_positive(c.rate_hz) &&
                          is_limit(c.resolution_m) && is_limit(c.max_force_n) &&
                          is_limit(c.max_torque_nm) && is_limit(c.max_stiffness_n_per_m) &&
                          is_limit(c.max_damping_n_s_per_m) && is_limit(c.watchdog_s) &&
                          c.watchdog_s < 1e6 && c.buttons <= 32 && c.senses_rotation <= 1;
    if (!is_sound)
        return fail(
            "{}: expected a workspace and a rate above 0, limits of at least 0 and at most 32 "
            "buttons, found others for the device {}",
            file, c.name);
    return DeviceCapabilities{.name = std::string(name.begin(), end),
                              .workspace_m = {c.workspace_m[0], c.workspace_m[1], c.workspace_m[2]},
                              .resolution_m = c.resolution_m,
                              .max_force_n = c.max_force_n,
                              .max_torque_nm = c.max_torque_nm,
                              .max_stiffness_n_per_m = c.max_stiffness_n_per_m,
                              .max_damping_n_s_per_m = c.max_damping_n_s_per_m,
                              .rate_hz = c.rate_hz,
                              .buttons = c.buttons,
                              .senses_rotation = c.senses_rotation != 0,
                              .watchdog_ns = std::llround(1e9 * c.watchdog_s)};
}

} // namespace

Result<std::unique_ptr<AdapterDevice>> AdapterDevice::open(const std::string& file) {
    // With a slash in it, so that nothing is looked for elsewhere. It stays loaded: threads of the
    // maker's software may outlive the device.
    const std::string path = std::filesystem::absolute(file).string();
    void* const library = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library)
        return fail("{}: expected a shared library with a device, found none: {}", file,
                    ::dlerror());
    const auto find =
        reinterpret_cast<decltype(&palpate_device_entry)>(::dlsym(library, "palpate_device_entry"));
    const palpate_device* const entry = find ? find() : nullptr;
    if (!entry || entry->abi != PALPATE_DEVICE_ABI || !entry->open || !entry->close ||
        !entry->read || !entry->write || !entry->halt)
        return fail("{}: expected palpate_device_entry() of interface {}, found {}", file,
                    PALPATE_DEVICE_ABI,
                    !entry                             ? "none"
                    : entry->abi != PALPATE_DEVICE_ABI ? fmt::format("interface {}", entry->abi)
                                                       : "one without all functions");
    palpate_device_capabilities told{};
    std::array<char, 256> why{};
    void* const device = entry->open(&told, why.data(), why.size());
    why.back() = '\0';
    if (!device)
        return fail("{}: {}", file, why.front() ? why.data() : "the device cannot be opened");
    Result<DeviceCapabilities> capabilities = checked(told, file);
    if (!capabilities) {
        entry->close(device);
        return pass_on(capabilities);
    }
    return std::unique_ptr<AdapterDevice>(
        new AdapterDevice(entry, device, std::move(*capabilities)));
}

AdapterDevice::AdapterDevice(const palpate_device* entry, void* device,
                             DeviceCapabilities capabilities)
    : entry_(entry),
      device_(device),
      capabilities_(std::move(capabilities)),
      estimator_(capabilities_.resolution_m) {}

AdapterDevice::~AdapterDevice() {
    entry_->halt(device_);
    entry_->close(device_);
}

DeviceStatus AdapterDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    sample.time_ns = now_ns;
    palpate_device_sample told{};
    told.rotation[0] = 1.0;
    const DeviceStatus status = status_of(entry_->read(device_, &told));
    if (status != DeviceStatus::ok)
        return status;
    const glm::dvec3 place{told.position_m[0], told.position_m[1], told.position_m[2]};
    glm::dquat rotation{told.rotation[0], told.rotation[1], told.rotation[2], told.rotation[3]};
    const double length = glm::length(rotation);
    if (!std::isfinite(place.x + place.y + place.z) || !(std::abs(length - 1.0) < 1e-3))
        return DeviceStatus::stale;
    if (!has_place_)
        estimator_.reset();
    const double dt_s =
        1e-9 * static_cast<double>(has_place_ ? std::max<int64_t>(now_ns - sampled_ns_, 1) : 1);
    sample.position_m = place;
    sample.rotation = rotation / length;
    sample.velocity_m_per_s = estimator_.add(place, dt_s);
    sample.buttons = told.buttons;
    sampled_ns_ = now_ns;
    has_place_ = true;
    return DeviceStatus::ok;
}

DeviceStatus AdapterDevice::write(int64_t, const Wrench& wrench) noexcept {
    const auto limited = [](glm::dvec3 v, double most) {
        const double size = glm::length(v);
        if (!std::isfinite(size))
            return glm::dvec3(0.0);
        return size > most ? v * (most / size) : v;
    };
    const glm::dvec3 force = limited(wrench.force_n, capabilities_.max_force_n);
    const glm::dvec3 torque = limited(wrench.torque_nm, capabilities_.max_torque_nm);
    const double force_n[3] = {force.x, force.y, force.z};
    const double torque_nm[3] = {torque.x, torque.y, torque.z};
    return status_of(entry_->write(device_, force_n, torque_nm));
}

} // namespace palpate::haptics
