#pragma once

#include <deque>
#include <vector>

#include "haptics/device/falcon/bridge.h"
#include "haptics/device/falcon/codec.h"
#include "haptics/device/falcon/kinematics.h"
#include "haptics/device/simulated.h"
#include "haptics/device/transport/fake_transport.h"

// A Falcon without hardware, to the byte: the FTDI bridge with its latency timer, event character
// and packets, the boot program, the run-time firmware, and motors and encoders on the mechanics of
// a simulated device with a hand. For tests; a model of what is published, not of a device that
// somebody has measured.
namespace palpate::haptics::falcon {

struct FakeFalconSetup {
    std::vector<std::byte> firmware; // the image that its boot program takes
    bool is_loaded = true;           // it runs already
    bool is_homed = true;
    uint32_t homing_packets = 200; // with the request until the hand has homed it
    // Along z in the plane of the device; the hand's intention while it is not scripted.
    HandPath path{{HandPose{}}};
    HandModel hand;
};

class FakeFalcon final : public FakePeer {
 public:
    explicit FakeFalcon(FakeFalconSetup setup);

    void advance(int64_t to_ns) override;
    bool control(const UsbSetup& setup, std::span<const std::byte> bytes) override;
    bool out(uint8_t endpoint, std::span<const std::byte> bytes) override;
    int in(uint8_t endpoint, std::span<std::byte> room) override;
    void plugged() override; // the firmware is lost

    // The mechanics of the falcon preset without steps and limits, which the encoders bring.
    static DevicePreset plant_preset();

    // The truth behind the bytes.
    const SimulatedDevice& plant() const { return plant_; }
    const Command& command() const { return command_; }   // the last that arrived
    glm::dvec3 motor_force_n() const { return force_n_; } // of the motors on the grip, now
    bool runs() const { return mode_ == Mode::running; }
    // The largest count, of either sign, that each motor was told.
    const Counts& most_motors() const { return most_motors_; }
    uint64_t commands() const { return commands_; }
    uint16_t latency_ms() const { return latency_ms_; }

    // Faults that are the device's own.
    bool encoders_stuck = false;
    Counts encoder_shift{}; // added to what the encoders say, with the wrap of 16 bits
    bool silent = false;    // the firmware hangs
    uint8_t buttons = 0;

 private:
    enum class Mode { off, hello, begin, loading, dead, running };
    struct Timed {
        int64_t at_ns;
        std::byte byte;
    };
    uint16_t own_divisor() const;
    void take(std::byte byte, int64_t at_ns); // the device's end of the line
    void answer(std::span<const std::byte> bytes, int64_t at_ns);
    void run_command(const Packet& packet, int64_t at_ns);
    Counts encoders();
    void apply_motors();
    static int64_t byte_ns(uint16_t divisor);
    std::byte through_line(std::byte byte) const; // garbage where the two ends differ in speed

    FakeFalconSetup setup_;
    SimulatedDevice plant_;
    int64_t now_ns_ = 0;

    // The bridge.
    uint16_t divisor_ = kBaud9600, latency_ms_ = 16, event_ = 0;
    bool dtr_ = false;
    std::deque<Timed> to_device_, to_bridge_; // on the line
    std::deque<std::byte> received_;          // in the bridge
    bool has_event_ = false;
    int64_t flushed_ns_ = 0;

    // The device.
    Mode mode_;
    std::vector<std::byte> greeting_, image_;
    Framer framer_;
    Command command_;
    Counts most_motors_{};
    uint64_t commands_ = 0;
    uint8_t homed_;
    uint32_t homing_ = 0;
    Counts zero_{}, last_encoders_{};
    Angles angles_{};
    glm::dvec3 force_n_{0.0};
};

} // namespace palpate::haptics::falcon
