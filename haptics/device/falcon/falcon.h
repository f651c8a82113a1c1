#pragma once

#include <memory>
#include <stop_token>

#include "haptics/core/device.h"
#include "haptics/device/falcon/codec.h"
#include "haptics/device/falcon/start.h"
#include "haptics/device/velocity.h"

namespace palpate::haptics {

DeviceCapabilities falcon_capabilities();

// A Novint Falcon behind its USB bridge.
//
// One packet goes out each tick and is answered by one, whose arrival sets the pace. What the
// device says that is damaged, impossible or missing reads as stale; unplugged, or silent for
// kSilent_ns though asked, as gone. Until all axes are homed no force goes out. A force that needs
// more torque than a motor may have is scaled down on all of them alike. The device has no watchdog
// that is known: what it does with its last force when the cable is pulled, only the owner's
// checklist says.
class FalconDevice final : public HapticDevice {
 public:
    static constexpr int64_t kSilent_ns = 100'000'000;
    static constexpr double kCountsPerNm = -10'000.0; // of motor torque
    static constexpr int kMostCounts = 4096;          // of a motor; documented, and kept to here

    // Set up and asked once, so that it answers; start.h says how, and what fails.
    static Result<std::unique_ptr<FalconDevice>> open(std::unique_ptr<Transport> transport,
                                                      std::span<const std::byte> firmware,
                                                      const std::stop_token& stop = {});
    ~FalconDevice() override; // without force

    const DeviceCapabilities& capabilities() const noexcept override { return capabilities_; }
    // Asks for the ends of the axes: pull the grip all the way out, then push it in.
    Result<void> home() override;
    bool wait(int64_t until_ns) noexcept override;
    DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept override;
    DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept override;
    void halt(int64_t now_ns) noexcept override;

    // Counts of what the line did since it was opened.
    struct Counters {
        uint64_t packets = 0;    // read whole
        uint64_t lost_bytes = 0; // that belonged to no packet
        uint64_t failures = 0;   // transfers that ended in an error
        uint64_t impossible = 0; // packets whose angles belong to no place
    };
    Counters counters() const noexcept;
    falcon::Started started() const noexcept { return started_; }
    const falcon::State& state() const noexcept { return state_; } // of the last packet
    // Lights that writes show from now on, falcon::Light bits, in place of those that tell its
    // state; below 0: those again. For the owner's checklist, between ticks.
    void show(int lights) noexcept { shown_ = lights; }
    // Torque of the motors, in counts, for a force at a place; 0 where none can be known.
    static std::array<int16_t, 3> motor_counts(glm::dvec3 position_m, glm::dvec3 force_n) noexcept;

 private:
    FalconDevice(std::unique_ptr<Transport> transport, falcon::Started started);
    bool is_homed() const noexcept { return state_.homed == falcon::State::kAllHomed; }
    void send(const falcon::Command& command) noexcept;
    void submit() noexcept;
    bool poll(int64_t until_ns) noexcept;

    DeviceCapabilities capabilities_;
    std::unique_ptr<Transport> transport_;
    falcon::Started started_;
    Transfer &out_, &in_;
    falcon::Framer framer_;
    falcon::State state_;
    bool fresh_ = false;   // state_ came since the last read
    bool homing_ = false;  // asked for
    int shown_ = -1;       // lights of show()
    bool waiting_ = false; // next_ goes out when the transfer before has ended
    falcon::Command next_;
    int64_t asked_ns_ = 0; // the first command without an answer; 0: none
    glm::dvec3 place_m_;   // last known, in the kinematics' space
    bool has_place_ = false;
    int64_t sampled_ns_ = 0;
    VelocityEstimator estimator_;
    uint64_t packets_ = 0, failures_ = 0, impossible_ = 0;
};

} // namespace palpate::haptics
