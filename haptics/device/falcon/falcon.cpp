#include "haptics/device/falcon/falcon.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "haptics/device/falcon/bridge.h"
#include "haptics/device/falcon/kinematics.h"

namespace palpate::haptics {

using namespace falcon;

namespace {

constexpr double kNsPerS = 1e9;
constexpr glm::dvec3 kMiddle_m{0.0, 0.0, kCentre_m};
constexpr int kMostFailures = 3; // of the bus in one wait(), which then lets the time pass

Angles angles_of(const Counts& counts) {
    return {angle_of_count(counts[0]), angle_of_count(counts[1]), angle_of_count(counts[2])};
}

bool are_possible(const Counts& counts) {
    return std::all_of(counts.begin(), counts.end(),
                       [](int count) { return std::abs(count) <= falcon::kMostCounts; });
}

} // namespace

DeviceCapabilities falcon_capabilities() {
    return {.name = "Novint Falcon",
            .workspace_m = glm::dvec3(kReach_m),
            .resolution_m = 48.5e-6,
            .max_force_n = kForce_n,
            .max_stiffness_n_per_m = 3000.0,
            .max_damping_n_s_per_m = 20.0,
            .rate_hz = 1000.0,
            .delay_s = 0.001,
            .buttons = 4,
            .paces = true,
            .needs_homing = true};
}

FalconDevice::FalconDevice(std::unique_ptr<Transport> transport, Started started)
    : capabilities_(falcon_capabilities()),
      transport_(std::move(transport)),
      started_(started),
      out_(transport_->transfer(kOutSlot)),
      in_(transport_->transfer(kInSlot)),
      place_m_(falcon::home()),
      estimator_(capabilities_.resolution_m) {
    in_.status = TransferStatus::idle; // start() has read what it holds
}

Result<std::unique_ptr<FalconDevice>> FalconDevice::open(std::unique_ptr<Transport> transport,
                                                         std::span<const std::byte> firmware,
                                                         const std::stop_token& stop) {
    PALPATE_TRY(const Started started, start(*transport, firmware, stop));
    PALPATE_TRY(transport->prepare_halt(kOutEndpoint, encode(Command{})));
    std::unique_ptr<FalconDevice> device(new FalconDevice(std::move(transport), started));
    // Whether its axes are homed.
    constexpr int64_t kAnswer_ns = 50'000'000;
    const int64_t until_ns = device->transport_->clock().now_ns() + kAnswer_ns;
    while (!device->wait(until_ns) && device->transport_->clock().now_ns() < until_ns)
        if (device->transport_->gone())
            return fail("{}: unplugged while it was being set up", device->capabilities_.name);
    return device;
}

FalconDevice::~FalconDevice() {
    send({});
    constexpr int64_t kPatience_ns = 5'000'000;
    const int64_t until_ns = transport_->clock().now_ns() + kPatience_ns;
    while ((waiting_ || out_.status == TransferStatus::pending) &&
           transport_->clock().now_ns() < until_ns)
        poll(until_ns);
}

Result<void> FalconDevice::home() {
    homing_ = true;
    return {};
}

void FalconDevice::submit() noexcept {
    waiting_ = false;
    const Packet packet = encode(next_);
    std::copy(packet.begin(), packet.end(), out_.bytes.begin());
    out_.kind = TransferKind::bulk;
    out_.endpoint = kOutEndpoint;
    out_.size = packet.size();
    transport_->submit(out_);
}

// At once, or when the transfer before has ended: that one is cancelled, because it holds an older
// force that is not wanted any more.
void FalconDevice::send(const Command& command) noexcept {
    next_ = command;
    if (asked_ns_ == 0)
        asked_ns_ = transport_->clock().now_ns();
    if (out_.status == TransferStatus::pending) {
        waiting_ = true;
        transport_->cancel(out_);
    } else {
        submit();
    }
}

// Takes what has come. True: a packet among it.
bool FalconDevice::poll(int64_t until_ns) noexcept {
    const bool was_sending = out_.status == TransferStatus::pending;
    transport_->reap(until_ns);
    if (was_sending && out_.status != TransferStatus::pending &&
        out_.status != TransferStatus::done && out_.status != TransferStatus::cancelled)
        ++failures_;
    if (waiting_ && out_.status != TransferStatus::pending)
        submit();
    if (in_.status == TransferStatus::pending)
        return false;
    bool any = false;
    if (in_.status == TransferStatus::done) {
        Packet packet;
        for (const std::byte byte : payload_of(in_.received()))
            if (framer_.add(byte, packet) && decode(packet, state_)) {
                any = true;
                ++packets_;
            }
    } else if (in_.status != TransferStatus::idle) {
        ++failures_;
    }
    if (any) {
        fresh_ = true;
        asked_ns_ = 0;
    }
    in_.kind = TransferKind::bulk;
    in_.endpoint = kInEndpoint;
    in_.size = kUsbPacket;
    transport_->submit(in_);
    return any;
}

bool FalconDevice::wait(int64_t until_ns) noexcept {
    if (asked_ns_ == 0 && !fresh_) // nothing would answer
        write(transport_->clock().now_ns(), {});
    const uint64_t failures = failures_;
    while (!fresh_ && !transport_->gone() && failures_ - failures < kMostFailures) {
        poll(until_ns);
        if (transport_->clock().now_ns() >= until_ns)
            break;
    }
    return fresh_ && !transport_->gone();
}

DeviceStatus FalconDevice::read(int64_t now_ns, DeviceSample& sample) noexcept {
    sample.time_ns = now_ns;
    poll(0);
    if (transport_->gone())
        return DeviceStatus::gone;
    if (!fresh_)
        return asked_ns_ != 0 && now_ns - asked_ns_ > kSilent_ns ? DeviceStatus::gone
                                                                 : DeviceStatus::stale;
    fresh_ = false;
    if (!is_homed()) {
        has_place_ = false;
        estimator_.reset();
        return DeviceStatus::not_homed;
    }
    homing_ = false;
    const std::optional<glm::dvec3> place = are_possible(state_.encoders)
                                                ? forward(angles_of(state_.encoders), place_m_)
                                                : std::nullopt;
    if (!place) {
        ++impossible_;
        has_place_ = false; // and torques cannot be known
        place_m_ = falcon::home();
        return DeviceStatus::stale;
    }
    place_m_ = *place;
    sample.position_m = *place - kMiddle_m;
    const int64_t since_ns = has_place_ ? std::max<int64_t>(now_ns - sampled_ns_, 1) : 1;
    if (!has_place_)
        estimator_.reset();
    sample.velocity_m_per_s =
        estimator_.add(sample.position_m, static_cast<double>(since_ns) / kNsPerS);
    sampled_ns_ = now_ns;
    has_place_ = true;
    sample.rotation = {1.0, 0.0, 0.0, 0.0};
    sample.buttons = state_.buttons;
    return DeviceStatus::ok;
}

std::array<int16_t, 3> FalconDevice::motor_counts(glm::dvec3 position_m,
                                                  glm::dvec3 force_n) noexcept {
    const glm::dvec3 place = position_m + kMiddle_m;
    const std::optional<Angles> angles = inverse(place);
    const std::optional<glm::dmat3> by_angle =
        angles ? jacobian(*angles, place) : std::optional<glm::dmat3>();
    if (!by_angle)
        return {};
    glm::dvec3 counts = kCountsPerNm * (glm::transpose(*by_angle) * force_n);
    const double largest = std::max({std::abs(counts.x), std::abs(counts.y), std::abs(counts.z)});
    if (!std::isfinite(largest))
        return {};
    if (largest > kMostCounts)
        counts *= kMostCounts / largest;
    std::array<int16_t, 3> rounded{};
    for (int axis = 0; axis < 3; ++axis)
        rounded[static_cast<size_t>(axis)] = static_cast<int16_t>(std::lround(counts[axis]));
    return rounded;
}

DeviceStatus FalconDevice::write(int64_t, const Wrench& wrench) noexcept {
    if (transport_->gone())
        return DeviceStatus::gone;
    Command command;
    if (is_homed() && has_place_)
        command.motors = motor_counts(place_m_ - kMiddle_m, wrench.force_n);
    command.lights = shown_ >= 0  ? static_cast<uint8_t>(shown_ & (kGreen | kBlue | kRed))
                     : is_homed() ? kGreen
                     : homing_    ? kRed | kHoming
                                  : kRed;
    send(command);
    return is_homed() ? DeviceStatus::ok : DeviceStatus::not_homed;
}

void FalconDevice::halt(int64_t) noexcept {
    transport_->halt();
}

FalconDevice::Counters FalconDevice::counters() const noexcept {
    return {.packets = packets_,
            .lost_bytes = framer_.lost_bytes(),
            .failures = failures_,
            .impossible = impossible_};
}

} // namespace palpate::haptics
