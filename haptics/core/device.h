#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <string>

#include "engine/base/error.h"

// The interface between a haptic device and the servo: the position of the hand, and a force on it.
//
// Everything here is SI and in the device's own axes: metres, newtons, seconds; the origin is the
// middle of the workspace, x points to the right, y up, and z towards the person. World millimetres
// begin behind workspace.h.
namespace palpate::haptics {

// Capabilities are data: the servo and the safety chain read limits here and know no device by
// name.
struct DeviceCapabilities {
    std::string name;
    glm::dvec3 workspace_m{0.05};     // half the length of the reachable box on each axis
    double resolution_m = 0.0;        // position step in the middle of the workspace; 0: exact
    double max_force_n = 0.0;         // in every direction; 0: the device gives no force
    double max_torque_nm = 0.0;       // 0: no torque
    double max_stiffness_n_per_m = 0; // closed loop, as its maker says; 0: unknown
    double max_damping_n_s_per_m = 0; // largest stable damping; 0: unknown
    double rate_hz = 1000.0;          // at which samples come
    double delay_s = 0.0;             // from write() to force beyond the tick's own
    uint32_t buttons = 0;             // how many there are
    bool senses_rotation = false;
    // A device that is not written to for so long gives no force by itself; 0: it keeps the last
    // one for ever, and nothing ends it where the program is killed.
    int64_t watchdog_ns = 0;
    bool paces = false;        // wait() tells when a sample is there, and the servo ticks with it
    bool needs_homing = false; // read() answers not_homed until home() has been called and is done
};

enum class DeviceStatus : uint8_t {
    ok,
    stale,     // nothing new came; the sample repeats the last one
    not_homed, // positions mean nothing yet
    ended,     // a recording is over
    gone,      // unplugged, or does not answer
};

struct DeviceSample {
    int64_t time_ns = 0; // of the clock that the servo's ticks are on
    glm::dvec3 position_m{0.0};
    glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; // device_from_tool; (w, x, y, z)
    glm::dvec3 velocity_m_per_s{0.0};        // as the device's driver estimates it
    uint32_t buttons = 0;                    // bit b: button b is pressed
};

struct Wrench {
    glm::dvec3 force_n{0.0}; // on the hand
    glm::dvec3 torque_nm{0.0};

    friend bool operator==(const Wrench&, const Wrench&) = default;
};

// One device. home() and calibrate() are for whoever opened it, while no servo runs. wait(), read()
// and write() are the servo thread's: they neither allocate, throw nor lock, and read() and write()
// wait for no longer than the device's transport needs. Read, compute and write lie in one tick:
// each further tick of delay costs about five times the stiffness that stays stable.
class HapticDevice {
 public:
    virtual ~HapticDevice() = default;
    virtual const DeviceCapabilities& capabilities() const noexcept = 0;
    // Begins to look for the ends of the axes, by which encoders that count from where they woke up
    // learn where they are. Until it is done read() answers not_homed. An error: it has no homing.
    virtual Result<void> home();
    // The handle rests where its maker says that it is to be calibrated: takes that for the place
    // it is known to be. An error: it has no calibration.
    virtual Result<void> calibrate();
    // For a device that sets the pace: waits until there is a sample that read() has not given yet,
    // or until it is until_ns on the clock of the ticks. True: there is one, and read() gives it
    // without waiting. False at once where the device is gone.
    virtual bool wait(int64_t until_ns) noexcept;
    // The newest sample. Unless the status is ok, only the time of `sample` changes.
    virtual DeviceStatus read(int64_t now_ns, DeviceSample& sample) noexcept = 0;
    // The force from now on, until the next write. Beyond its limits a device scales it down and
    // keeps the direction; values that are not finite count as 0.
    virtual DeviceStatus write(int64_t now_ns, const Wrench& wrench) noexcept = 0;
    // No force from now on until the next write() that begins after this. From any thread at any
    // time, also while wait(), read() or write() run or hang, and from a signal's handler: it
    // calls nothing but what such a handler may, neither allocates, throws nor locks, and waits for
    // no more than a few milliseconds of the kernel's. A driver whose library locks sends past it
    // (raw_halt.h). Called again it does no harm, and takes back what a write() that was under way
    // has sent meanwhile (write_gate.h); more than one thread may call it at once.
    virtual void halt(int64_t now_ns) noexcept = 0;
};

} // namespace palpate::haptics
