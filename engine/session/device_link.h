#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/edit/edit_lag.h"
#include "engine/edit/editor.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/servo/brick_lock.h"
#include "haptics/servo/servo_thread.h"

namespace palpate {

// The state of a device, for people.
struct DeviceReport {
    std::string name;
    bool running = false;
    haptics::DeviceStatus status = haptics::DeviceStatus::ok; // of the newest tick
    haptics::SoftStart::Mode force = haptics::SoftStart::Mode::disarmed;
    uint32_t faults = 0; // haptics::fault_text() names them
    uint64_t ticks = 0;
};

// A device to touch with, and how.
struct SessionDevice {
    haptics::HapticDevice& device; // outlives its use
    const haptics::AlgorithmEntry& algorithm;
    haptics::Workspace workspace;
    // Its remove_button carves with tool 0, its second_button with tool 1.
    haptics::Servo::Options servo;
    // Threaded: memory that `after` uses, and what is done after each tick on the servo's thread
    // and under its rules; the ticks end where it says no. May be empty.
    std::vector<std::span<const std::byte>> memory;
    std::function<bool(const haptics::ServoTick&)> after;
    bool armed = true; // false: no force until arm()
    // Threaded: ServoThreadOptions::hung.
    std::function<void()> hung{};
};

// A device's servo, and what its hand does to the document: the strokes of its buttons, or of a
// tool without a device.
//
// All members are for one thread, the interface's, but where another is named.
class DeviceLink {
 public:
    struct Parts { // all outlive it
        Editor& editor;
        EditLag& lag;
        Mailbox<haptics::TouchScene>& scenes;
        Mailbox<haptics::TouchParameters>& parameters;
        const std::atomic<float>& removal; // haptics::Servo::Parts
        // Of the thread that locks bricks; null without threads. Woken when a device starts.
        Wake* locker;
    };
    explicit DeviceLink(const Parts& parts);
    ~DeviceLink(); // stops the device

    // Session's members of these names.
    Result<void> start(SessionDevice device);
    void stop();
    void arm();
    void disarm();
    Result<void> calibrate();
    DeviceReport report() const;
    bool is_running() const { return running_.load(std::memory_order_acquire); }
    void move_workspace(const haptics::WorkspaceSettings& settings);
    const haptics::WorkspaceSettings& workspace() const { return workspaces_.latest(); }
    const haptics::Servo* servo() const { return servo_.get(); }
    const haptics::ServoThread* servo_thread() const { return servo_thread_.get(); }

    // Whether the device's button of this tool carves.
    void let_carve(uint8_t tool, bool carves) {
        carves_[tool].store(carves, std::memory_order_release);
    }
    bool stroke(EditInput::Kind kind, const StrokePose& pose);
    // A stroke is under way. While a device runs on a thread of its own, only that thread knows.
    bool is_down() const { return down_; }
    // Without threads: one tick and its input to the editor.
    haptics::ServoTick tick(int64_t now_ns, int64_t due_ns);

    uint64_t inputs_given() const { return pushed_.load(std::memory_order_acquire); } // any thread
    double speed_mm_per_s() const noexcept { // of the tool that is down; any thread
        return speed_mm_per_s_.load(std::memory_order_relaxed);
    }

    // The locker's thread: locks the bricks of `felt` round the newest tool, where the last time is
    // long enough ago. When to do so next; kNever_ns: after the next start.
    static constexpr int64_t kNever_ns = INT64_MAX;
    int64_t lock_bricks(int64_t now_ns, const std::optional<Volume>& felt, double tool_radius_mm);

 private:
    void follow(const haptics::ServoTick& tick) noexcept; // the servo's thread
    // Hands a stroke's pose to the editor. The servo's thread; without a device the interface's.
    bool push(EditInput::Kind kind, const StrokePose& pose, uint8_t tool = 0) noexcept;

    Parts parts_;
    Mailbox<haptics::WorkspaceSettings> workspaces_;
    Ring<haptics::ToolStamp> stamps_{1 << 15}; // for the locker
    std::unique_ptr<haptics::Algorithm> algorithm_;
    std::unique_ptr<haptics::Servo> servo_;
    std::unique_ptr<haptics::ServoThread> servo_thread_;
    std::array<std::atomic<bool>, Editor::kTools> carves_{}; // there is such a tool
    std::atomic<bool> running_{false};                       // written by the interface
    std::atomic<uint64_t> pushed_{0};                        // by who pushes
    std::atomic<double> speed_mm_per_s_{0.0};                // likewise
    // The servo's thread's own while a device is running, else the interface's.
    std::array<uint32_t, Editor::kTools> buttons_{}; // of the tools
    bool down_ = false;
    uint8_t tool_ = 0; // that is down
    StrokePose last_pose_;
    // The locker's.
    haptics::BrickLock bricks_;
    int64_t locked_ns_ = 0;
};

} // namespace palpate
