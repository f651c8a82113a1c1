#include "haptics/device/falcon/fake_falcon.h"

#include <algorithm>
#include <cmath>

#include "haptics/device/falcon/falcon.h"

namespace palpate::haptics::falcon {

namespace {

constexpr glm::dvec3 kCentreOfWork_m{0.0, 0.0, kCentre_m};
constexpr int64_t kAnswers_ns = 20'000; // of the firmware, from a command to its answer
constexpr size_t kLineBuffer = 384;     // bytes on their way to the device
constexpr std::array kHello{std::byte{0x0A}, std::byte{0x43}, std::byte{0x0D}};
constexpr std::array kHelloAnswer{std::byte{0x00}, std::byte{0x0A}, std::byte{0x44},
                                  std::byte{0x2C}, std::byte{0x0D}};

} // namespace

DevicePreset FakeFalcon::plant_preset() {
    DevicePreset preset = *find_device_preset("falcon");
    preset.capabilities.workspace_m = glm::dvec3(kReach_m);
    preset.capabilities.max_force_n = 1000.0;
    preset.plant.encoder_step_m = 0.0;
    return preset;
}

FakeFalcon::FakeFalcon(FakeFalconSetup setup)
    : setup_(std::move(setup)),
      plant_(plant_preset(), setup_.hand, setup_.path, Workspace(glm::dvec3(0.0), 1.0)),
      mode_(setup_.is_loaded ? Mode::running : Mode::off),
      homed_(setup_.is_loaded && setup_.is_homed ? State::kAllHomed : 0) {
    if (!homed_)
        zero_ = {312, -87, 1004}; // wherever the encoders woke up
}

void FakeFalcon::plugged() {
    mode_ = Mode::off;
    homed_ = 0;
    homing_ = 0;
    zero_ = {-40, 650, 211};
    command_ = {};
    to_device_.clear();
    to_bridge_.clear();
    received_.clear();
    divisor_ = kBaud9600;
    latency_ms_ = 16;
    event_ = 0;
    dtr_ = has_event_ = false;
    apply_motors();
}

int64_t FakeFalcon::byte_ns(uint16_t divisor) {
    // 10 bits. The upper two bits of the divisor are eighths; 0x4138 means 312.5.
    const double whole = divisor & 0x3FFF, part = (divisor & 0xC000) == 0x4000 ? 0.5 : 0.0;
    return std::llround(10.0 * (whole + part) / 3e6 * 1e9);
}

uint16_t FakeFalcon::own_divisor() const {
    return mode_ == Mode::running                           ? kBaudRun
           : mode_ == Mode::begin || mode_ == Mode::loading ? kBaudLoad
                                                            : kBaud9600;
}

std::byte FakeFalcon::through_line(std::byte byte) const {
    if (own_divisor() == divisor_)
        return byte;
    return static_cast<std::byte>(std::to_integer<unsigned>(byte) * 167u + 0xF5u);
}

bool FakeFalcon::control(const UsbSetup& setup, std::span<const std::byte>) {
    if (setup.type != 0x40)
        return false;
    switch (static_cast<BridgeRequest>(setup.request)) {
        case BridgeRequest::reset:
            if (setup.value != 2) {
                received_.clear();
                has_event_ = false;
            }
            if (setup.value != 1)
                to_device_.clear();
            return true;
        case BridgeRequest::modem:
            if (setup.value == kDtrLow && dtr_ && mode_ == Mode::hello &&
                greeting_.empty()) // greeted: it waits for firmware
                mode_ = Mode::begin;
            if (setup.value == kDtrHigh && !dtr_) { // reset
                mode_ = Mode::hello;
                homed_ = 0;
                greeting_.assign(1, std::byte{0xFF}); // no greeting yet
                image_.clear();
                command_ = {};
                apply_motors();
            }
            if (setup.value == kDtrLow || setup.value == kDtrHigh)
                dtr_ = setup.value == kDtrHigh;
            return true;
        case BridgeRequest::divisor:
            divisor_ = setup.value;
            return true;
        case BridgeRequest::event:
            event_ = setup.value;
            return true;
        case BridgeRequest::latency:
            latency_ms_ = setup.value;
            return setup.value >= 1 && setup.value <= 255;
        case BridgeRequest::flow:
        case BridgeRequest::format:
            return true;
    }
    return false;
}

bool FakeFalcon::out(uint8_t endpoint, std::span<const std::byte> bytes) {
    if (endpoint != kOutEndpoint || to_device_.size() + bytes.size() > kLineBuffer)
        return false;
    for (const std::byte byte : bytes) {
        const int64_t begins_ns =
            to_device_.empty() ? now_ns_ : std::max(now_ns_, to_device_.back().at_ns);
        to_device_.push_back({begins_ns + byte_ns(divisor_), byte});
    }
    return true;
}

void FakeFalcon::answer(std::span<const std::byte> bytes, int64_t at_ns) {
    for (const std::byte byte : bytes) {
        const int64_t begins_ns =
            to_bridge_.empty() ? at_ns : std::max(at_ns, to_bridge_.back().at_ns);
        to_bridge_.push_back({begins_ns + byte_ns(own_divisor()), byte});
    }
}

void FakeFalcon::take(std::byte raw, int64_t at_ns) {
    const std::byte byte = through_line(raw);
    switch (mode_) {
        case Mode::off:
        case Mode::dead:
            break;
        case Mode::hello:
            if (greeting_.size() == 1 && greeting_[0] == std::byte{0xFF})
                greeting_.clear();
            greeting_.push_back(byte);
            if (greeting_.size() > kHello.size())
                greeting_.erase(greeting_.begin());
            if (std::equal(greeting_.begin(), greeting_.end(), kHello.begin(), kHello.end())) {
                answer(kHelloAnswer, at_ns);
                greeting_.clear();
            }
            break;
        case Mode::begin:
            if (byte == std::byte{0x41}) {
                mode_ = Mode::loading;
                answer(std::array{byte}, at_ns);
            }
            break;
        case Mode::loading:
            answer(std::array{byte}, at_ns);
            image_.push_back(byte);
            if (image_.size() == setup_.firmware.size()) {
                mode_ = image_ == setup_.firmware ? Mode::running : Mode::dead;
                framer_.reset();
            }
            break;
        case Mode::running:
            if (Packet packet; framer_.add(byte, packet))
                run_command(packet, at_ns);
            break;
    }
}

void FakeFalcon::run_command(const Packet& packet, int64_t at_ns) {
    if (silent || !decode(packet, command_))
        return;
    ++commands_;
    for (size_t i = 0; i < 3; ++i) // -32768 has no counterpart in 16 bits
        most_motors_[i] = static_cast<int16_t>(
            std::min(32767, std::max<int>(most_motors_[i], std::abs(int{command_.motors[i]}))));
    if (command_.lights & kHoming && homed_ != State::kAllHomed &&
        ++homing_ >= setup_.homing_packets) {
        homed_ = State::kAllHomed;
        zero_ = {}; // the encoders jump
    }
    apply_motors();
    answer(encode(State{encoders(), buttons, homed_}), at_ns + kAnswers_ns);
}

Counts FakeFalcon::encoders() {
    if (const std::optional<Angles> angles = inverse(plant_.true_position_m() + kCentreOfWork_m))
        angles_ = *angles;
    if (!encoders_stuck)
        for (size_t axis = 0; axis < 3; ++axis)
            last_encoders_[axis] = static_cast<int16_t>(std::lround(count_of_angle(angles_[axis])) +
                                                        zero_[axis] + encoder_shift[axis]);
    return last_encoders_;
}

// Torques that are held push the grip, wherever it is by now.
void FakeFalcon::apply_motors() {
    const glm::dvec3 place = plant_.true_position_m() + kCentreOfWork_m;
    const glm::dvec3 torque_nm =
        glm::dvec3(command_.motors[0], command_.motors[1], command_.motors[2]) /
        FalconDevice::kCountsPerNm;
    force_n_ = glm::dvec3(0.0);
    if (const std::optional<Angles> angles = inverse(place))
        if (const std::optional<glm::dmat3> by_angle = jacobian(*angles, place))
            force_n_ = glm::inverse(glm::transpose(*by_angle)) * torque_nm;
    plant_.write(now_ns_, {.force_n = force_n_});
}

void FakeFalcon::advance(int64_t to_ns) {
    while (!to_device_.empty() && to_device_.front().at_ns <= to_ns) {
        const Timed timed = to_device_.front();
        to_device_.pop_front();
        now_ns_ = std::max(now_ns_, timed.at_ns);
        take(timed.byte, timed.at_ns);
    }
    now_ns_ = std::max(now_ns_, to_ns);
    apply_motors();
    while (!to_bridge_.empty() && to_bridge_.front().at_ns <= to_ns) {
        const std::byte byte = to_bridge_.front().byte;
        to_bridge_.pop_front();
        // The event character flushes unless it is the first in the buffer.
        if ((event_ & 0x100) && !received_.empty() &&
            std::to_integer<unsigned>(byte) == (event_ & 0xFFu))
            has_event_ = true;
        received_.push_back(byte);
    }
}

int FakeFalcon::in(uint8_t endpoint, std::span<std::byte> room) {
    const bool is_due = now_ns_ - flushed_ns_ >= int64_t{latency_ms_} * 1'000'000;
    if (endpoint != kInEndpoint || !(is_due || has_event_ || received_.size() >= kPayload))
        return -1;
    flushed_ns_ = now_ns_;
    const size_t count = std::min({received_.size(), kPayload, room.size() - 2});
    room[0] = std::byte{0x01};
    room[1] = std::byte{0x60};
    std::copy_n(received_.begin(), count, room.begin() + 2);
    received_.erase(received_.begin(), received_.begin() + static_cast<long>(count));
    if (received_.empty())
        has_event_ = false;
    return static_cast<int>(count + 2);
}

} // namespace palpate::haptics::falcon
