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
      range_(std::max(description.range, 1)),
      hand_(capabilities_.workspace_m) {
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
    hand_.reset();
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
    const auto share = [&](size_t axis) { return static_cast<double>(state_.axes[axis]) / range_; };
    hand_.move(now_ns, turned(share(0), share(1), share(2)), turned(share(3), share(4), share(5)),
               sample);
    sample.buttons = state_.buttons;
    return DeviceStatus::ok;
}

DeviceStatus SpaceMouseDevice::write(int64_t, const Wrench&) noexcept {
    return transport_->gone() ? DeviceStatus::gone : DeviceStatus::ok;
}

} // namespace palpate::haptics
