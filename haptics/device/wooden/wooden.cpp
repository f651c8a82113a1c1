#include "haptics/device/wooden/wooden.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

using namespace wooden;

namespace {

constexpr int64_t kPatience_ns = 20'000'000; // for a report, while it is set up

// The step of a count at the grip: the farther link's, in the middle of the workspace.
double resolution_m(const Geometry& g) {
    const glm::dmat3 by_angle = jacobian(g, *inverse(g, glm::dvec3(0.0)));
    const Angles step = angles_of(g, {1, 1, 1});
    double most = 0.0;
    for (int i = 0; i < 3; ++i)
        most = std::max(most, glm::length(by_angle[i]) * std::abs(step[static_cast<size_t>(i)]));
    return most;
}

} // namespace

DeviceCapabilities wooden_capabilities(const Geometry& geometry) {
    return {.name = geometry.name,
            .workspace_m = glm::dvec3(0.08), // a box well within reach of both geometries
            .resolution_m = resolution_m(geometry),
            .max_force_n = geometry.max_force_n,
            .max_stiffness_n_per_m = geometry.max_stiffness_n_per_m,
            .max_damping_n_s_per_m = geometry.max_damping_n_s_per_m,
            .rate_hz = 1000.0,
            .delay_s = 0.001,
            .watchdog_ns = 500'000'000};
}

WoodenDevice::WoodenDevice(std::unique_ptr<Transport> transport, const Geometry& geometry,
                           size_t report_bytes)
    : capabilities_(wooden_capabilities(geometry)),
      geometry_(geometry),
      transport_(std::move(transport)),
      in_(transport_->transfer(0)),
      out_(transport_->transfer(1)),
      report_bytes_(report_bytes),
      estimator_(capabilities_.resolution_m) {}

void WoodenDevice::put(const Command& command, Transfer& transfer) const noexcept {
    transfer.kind = TransferKind::hid_report;
    transfer.endpoint = 0x02;
    transfer.size = 1 + report_bytes_;
    std::fill_n(transfer.bytes.begin(), transfer.size,
                std::byte{0}); // its number, and what is left
    const auto report = encode(command);
    std::copy(report.begin(), report.end(), transfer.bytes.begin() + 1);
}

Result<std::unique_ptr<WoodenDevice>> WoodenDevice::open(std::unique_ptr<Transport> transport,
                                                         const Geometry& geometry,
                                                         size_t report_bytes) {
    std::unique_ptr<WoodenDevice> device(
        new WoodenDevice(std::move(transport), geometry, report_bytes));
    device->put({}, device->out_);
    PALPATE_TRY(device->transport_->prepare_halt(
        0x02, std::span(device->out_.bytes).first(device->out_.size)));
    device->in_.kind = TransferKind::hid_report;
    device->in_.endpoint = 0x81;
    device->in_.size = 64;
    constexpr int kMostAttempts = 10; // what was sent before it was opened may come first
    State state;
    for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
        run_transfer(*device->transport_, device->out_, kPatience_ns);
        if (run_transfer(*device->transport_, device->in_, kPatience_ns) == TransferStatus::done &&
            decode(device->in_.received(), state)) {
            device->in_.status = TransferStatus::idle;
            return device;
        }
        if (device->transport_->gone())
            return fail("{}: unplugged while it was being set up", geometry.name);
    }
    return fail("{}: expected reports of {} bytes, found none; is its power supply plugged in?",
                geometry.name, kReport);
}

WoodenDevice::~WoodenDevice() {
    put({}, out_);
    if (out_.status != TransferStatus::pending)
        run_transfer(*transport_, out_, kPatience_ns);
}

Result<void> WoodenDevice::calibrate() {
    put({.order = kSetEncoders}, out_);
    if (run_transfer(*transport_, out_, kPatience_ns) != TransferStatus::done)
        return fail("{}: it could not be told where its handle is: {}", geometry_.name,
                    text_of(out_.status));
    has_place_ = false;
    estimator_.reset();
    return {};
}

DeviceStatus WoodenDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    sample.time_ns = now_ns;
    constexpr int kMostReports = 16; // of a tick; a flood is read in the next ones
    State state;
    bool is_fresh = false;
    for (int i = 0; i < kMostReports; ++i) {
        if (in_.status != TransferStatus::pending)
            transport_->submit(in_);
        if (!transport_->reap(0) || in_.status == TransferStatus::pending)
            break;
        if (in_.status != TransferStatus::done)
            break;
        is_fresh = decode(in_.received(), state) || is_fresh;
    }
    if (transport_->gone())
        return DeviceStatus::gone;
    if (!is_fresh)
        return asked_ns_ != 0 && now_ns - asked_ns_ > kSilent_ns ? DeviceStatus::gone
                                                                 : DeviceStatus::stale;
    asked_ns_ = 0;
    angles_ = angles_of(geometry_, {state.encoders[0], state.encoders[1], state.encoders[2]});
    sample.position_m = forward(geometry_, angles_);
    if (!has_place_)
        estimator_.reset();
    const double dt_s =
        1e-9 * static_cast<double>(has_place_ ? std::max<int64_t>(now_ns - sampled_ns_, 1) : 1);
    sample.velocity_m_per_s = estimator_.add(sample.position_m, dt_s);
    sample.rotation = {1.0, 0.0, 0.0, 0.0};
    sample.buttons = 0;
    sampled_ns_ = now_ns;
    has_place_ = true;
    return DeviceStatus::ok;
}

std::array<int16_t, 3> WoodenDevice::motor_currents(const Geometry& geometry, const Angles& angles,
                                                    glm::dvec3 force_n) noexcept {
    glm::dvec3 ma = 1e3 * currents(geometry, angles, force_n);
    const double largest = std::max({std::abs(ma.x), std::abs(ma.y), std::abs(ma.z)});
    if (!std::isfinite(largest) || !std::isfinite(ma.x + ma.y + ma.z))
        return {};
    if (largest > kMost_ma)
        ma *= kMost_ma / largest;
    return {static_cast<int16_t>(std::lround(ma.x)), static_cast<int16_t>(std::lround(ma.y)),
            static_cast<int16_t>(std::lround(ma.z))};
}

DeviceStatus WoodenDevice::write(int64_t now_ns, const Wrench& wrench) noexcept {
    if (transport_->gone())
        return DeviceStatus::gone;
    if (out_.status == TransferStatus::pending) // an older force that is not wanted any more
        transport_->cancel(out_), transport_->reap(0);
    if (out_.status == TransferStatus::pending)
        return DeviceStatus::stale;
    Command command;
    if (has_place_)
        command.motors_ma = motor_currents(geometry_, angles_, wrench.force_n);
    put(command, out_);
    transport_->submit(out_);
    if (asked_ns_ == 0)
        asked_ns_ = now_ns;
    return transport_->gone() ? DeviceStatus::gone : DeviceStatus::ok;
}

} // namespace palpate::haptics
