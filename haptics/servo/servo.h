#pragma once

#include <atomic>
#include <optional>

#include "engine/base/mailbox.h"
#include "engine/base/ring.h"
#include "haptics/core/workspace.h"
#include "haptics/field/algorithm.h"
#include "haptics/field/touch_plates.h"
#include "haptics/safety/chain.h"
#include "haptics/safety/write_gate.h"
#include "haptics/servo/force_fade.h"
#include "haptics/servo/parameter_slew.h"
#include "haptics/servo/telemetry.h"

namespace palpate::haptics {

// The tool's pose for the editor. One a tick, lossless.
struct ToolStamp {
    int64_t time_ns = 0;
    ToolPose tool, proxy;
    uint32_t buttons = 0;
    uint64_t scene_version = 0; // that was felt
};

// Input and output of one tick.
struct ServoTick {
    int64_t now_ns = 0;
    DeviceStatus status = DeviceStatus::ok;
    bool usable = false; // the tool is known
    ToolPose tool;       // world mm
    glm::dvec3 velocity_mm_per_s{0.0};
    uint32_t buttons = 0;
    TickOutput touched;           // what was rendered
    PlateTouch plate;             // what of it presses a plate
    Wrench sent;                  // what went to the device, in its axes
    glm::dvec3 sent_world_n{0.0}; // the same force in the world's
    uint64_t scene_version = 0;
    uint32_t faults = 0;              // Fault bits
    double share = 0.0;               // of soft start
    double damping_n = 0.0;           // of what the safety chain added
    glm::dvec3 rendered_world_n{0.0}; // what it was given: no jump after a command (ForceFade),
                                      // nothing while the clutch is pressed
    double energy_mj = 0.0; // work done on the hand since the start, of sent force and its way
    int64_t cpu_ns = 0;     // thread clock, the device's own time apart
};

// One tick of touch as a line of functions: sample, sanity, snapshot, proxy, limits, device. Read,
// compute and write lie in the same tick.
//
// tick() belongs to one thread. It neither allocates, throws, locks nor prints, and its result is a
// function of its inputs: time is the argument now_ns. Scenes, parameters and settings of the
// workspace come through mailboxes, which it reads once a tick; poses leave through a ring; it
// frees nothing.
class Servo {
 public:
    static constexpr double kRemoval_s = 0.020;
    struct Parts { // all outlive the servo
        HapticDevice& device;
        Algorithm& algorithm;
        Mailbox<TouchScene>& scenes;
        Mailbox<TouchParameters>& parameters;
        Ring<ToolStamp>* poses = nullptr; // may be null
        // May be null: the workspace stays as it is, but for the clutch's button.
        Mailbox<WorkspaceSettings>* workspace = nullptr;
        // How strongly material goes, 0 .. 1 (sound/milling.h): the share of vibration. May be
        // null: none goes. Each tick reads it once and moves towards it, from 0 to 1 in kRemoval_s.
        const std::atomic<float>* removal = nullptr;
    };
    struct Options {
        double rate_hz = 1000.0;
        SafetyLimits limits;
        uint32_t clutch_button = 31; // none has it by default
        uint32_t remove_button = 0;  // the tool removes or adds while it is pressed
        uint32_t second_button = 31; // or this one, with another tool; none by default
    };
    Servo(const Parts& parts, const Workspace& workspace, const Options& options);

    // due_ns: when this tick should have begun. now_ns rises from tick to tick.
    ServoTick tick(int64_t now_ns, int64_t due_ns) noexcept;

    // From a watchdog's thread, on the clock of the ticks: where nothing has been written for
    // limits.too_late_ns and a tick, halts the device, and again at every look until the servo is
    // back, which then starts without force. Returns when to look again. A tick that hangs in the
    // algorithm, in read() or in write() is seen alike.
    int64_t watch(int64_t now_ns) noexcept;

    // Sends no force. For the thread that ticks, after its last tick.
    void release() noexcept { parts_.device.write(last_ns_, {}); }

    // From any thread; acted on by the next tick.
    void arm() noexcept { command_.store(Command::arm, std::memory_order_release); }
    void disarm() noexcept { command_.store(Command::disarm, std::memory_order_release); }

    const Telemetry& telemetry() const noexcept { return telemetry_; }
    Telemetry& telemetry() noexcept { return telemetry_; } // for the thread that ticks
    // While the servo ticks, only where a fault is latched may others read it.
    const SafetyChain& safety() const noexcept { return safety_; }
    HapticDevice& device() const noexcept { return parts_.device; }
    const Options& options() const noexcept { return options_; }

 private:
    enum class Command : uint32_t { none, arm, disarm };
    bool write(int64_t now_ns, const Wrench& wrench) noexcept;
    void move_workspace(const DeviceSample& sample, double dt_s) noexcept;

    Parts parts_;
    Workspace workspace_;
    Options options_;
    SafetyChain safety_;
    double most_stiffness_n_per_m_; // of the coupling, as the hand feels it
    Mailbox<TouchScene>::Reader scenes_;
    Mailbox<TouchParameters>::Reader parameters_;
    std::optional<Mailbox<WorkspaceSettings>::Reader> settings_;
    ParameterSlew slew_;
    ForceFade fade_;
    PlatePress press_;
    // The value that was pinned in the tick before. A pin's epoch may be that of an earlier value,
    // and memory is used again; a value that differs differs in one of the two.
    struct Seen {
        const void* value = nullptr;
        uint64_t epoch = 0;
        friend bool operator==(const Seen&, const Seen&) = default;
    } seen_scene_, seen_parameters_;
    Contact contact_ = Contact::free; // of the last usable tick
    ToolPose last_tool_;
    glm::dvec3 last_velocity_mm_per_s_{0.0};
    std::atomic<Command> command_{Command::none};
    Telemetry telemetry_;
    WriteGate gate_;
    int64_t tripped_ns_ = 0; // the watchdog's: the last write before its last trip

    DeviceSample sample_;
    bool was_usable_ = false;
    int64_t last_ns_ = 0;
    bool has_last_ = false;
    glm::dvec3 last_position_m_{0.0}, last_sent_n_{0.0};
    double energy_mj_ = 0.0;
    double removal_ = 0.0; // on its way to parts_.removal
};

} // namespace palpate::haptics
