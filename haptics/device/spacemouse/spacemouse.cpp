#include "haptics/device/spacemouse/spacemouse.h"

#include <algorithm>

namespace palpate::haptics {

using namespace spacemouse;

namespace {

enum Slot : size_t { kInSlot, kLightSlot };

// The cap's axes are to the right, towards the person and down; the device's are to the right, up
// and towards the person.
glm::dvec3 turned(double x, double y, double z) {
    return {x, -z, y};
}

} // namespace

DeviceCapabilities spacemouse_capabilities() {
    return {.name = "3Dconnexion SpaceMouse",
            .workspace_m = glm::dvec3(0.05),
            .rate_hz = 1000.0,
            .buttons = 32,
            .senses_rotation = true};
}

SpaceMouseDevice::SpaceMouseDevice(std::unique_ptr<Transport> transport,
                                   const Description& description)
    : capabilities_(spacemouse_capabilities()),
      transport_(std::move(transport)),
      range_(std::max(description.range, 1)) {
    light(true);
}

SpaceMouseDevice::~SpaceMouseDevice() {
    light(false);
}

// A device without a light refuses, which changes nothing.
void SpaceMouseDevice::light(bool on) noexcept {
    Transfer& transfer = transport_->transfer(kLightSlot);
    const auto report = led_report(on);
    std::copy(report.begin(), report.end(), transfer.bytes.begin());
    transfer.kind = TransferKind::hid_report;
    transfer.endpoint = 0x02;
    transfer.size = report.size();
    run_transfer(*transport_, transfer, 20'000'000);
}

Result<void> SpaceMouseDevice::calibrate() {
    position_m_ = glm::dvec3(0.0);
    rotation_ = {1.0, 0.0, 0.0, 0.0};
    return {};
}

DeviceStatus SpaceMouseDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    sample.time_ns = now_ns;
    constexpr int kMostReports = 16; // of a tick; a flood is read in the next ones
    Transfer& in = transport_->transfer(kInSlot);
    for (int i = 0; i < kMostReports; ++i) {
        if (in.status != TransferStatus::pending) {
            in.kind = TransferKind::hid_report;
            in.endpoint = 0x81;
            in.size = 64;
            transport_->submit(in);
        }
        if (!transport_->reap(0) || in.status != TransferStatus::done)
            break;
        if (decode(in.received(), range_, state_) == Told::axes)
            told_ns_ = now_ns;
    }
    if (transport_->gone())
        return DeviceStatus::gone;
    if (now_ns - told_ns_ > kRest_ns)
        state_.axes = {};
    const double dt_s = moved_ns_ == 0 ? 0.0
                                       : std::clamp(1e-9 * static_cast<double>(now_ns - moved_ns_),
                                                    0.0, 0.01); // a stall is no motion
    moved_ns_ = now_ns;
    const auto share = [&](size_t axis) { return static_cast<double>(state_.axes[axis]) / range_; };
    const glm::dvec3 velocity = kSpeed_m_per_s * turned(share(0), share(1), share(2));
    const glm::dvec3 before = position_m_;
    position_m_ = glm::clamp(position_m_ + dt_s * velocity, -capabilities_.workspace_m,
                             capabilities_.workspace_m);
    const glm::dvec3 turn = dt_s * kTurn_rad_per_s * turned(share(3), share(4), share(5));
    if (const double angle = glm::length(turn); angle > 0.0)
        rotation_ = glm::normalize(glm::angleAxis(angle, turn / angle) * rotation_);
    sample.position_m = position_m_;
    sample.rotation = rotation_;
    sample.velocity_m_per_s = dt_s > 0.0 ? (position_m_ - before) / dt_s : glm::dvec3(0.0);
    sample.buttons = state_.buttons;
    return DeviceStatus::ok;
}

DeviceStatus SpaceMouseDevice::write(int64_t, const Wrench&) noexcept {
    return transport_->gone() ? DeviceStatus::gone : DeviceStatus::ok;
}

} // namespace palpate::haptics
