#include "engine/session/device_link.h"

#include <chrono>
#include <thread>
#include <utility>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/session/felt_publisher.h"
#include "haptics/core/clock.h"

namespace palpate {

namespace {

using namespace haptics;

constexpr int64_t kLockEvery_ns = 20'000'000; // how often bricks round the tool are locked
constexpr double kLockReach_mm = 5.0;         // beyond the tool

} // namespace

DeviceLink::DeviceLink(const Parts& parts)
    : parts_(parts), workspaces_(std::make_unique<const WorkspaceSettings>()) {}

DeviceLink::~DeviceLink() {
    stop();
}

Result<void> DeviceLink::start(SessionDevice device) {
    if (running_)
        return fail("expected no device that is running, found one: stop it first");
    if (DeviceSample sample; device.device.capabilities().needs_homing &&
                             device.device.read(monotonic_ns(), sample) == DeviceStatus::not_homed)
        PALPATE_TRY(device.device.home());
    servo_thread_.reset();
    servo_.reset();
    move_workspace({device.workspace.scale(), device.workspace.rotation()});
    algorithm_ = device.algorithm.make();
    buttons_ = {device.servo.remove_button, device.servo.second_button};
    const bool threaded = parts_.locker != nullptr;
    servo_ = std::make_unique<Servo>(
        Servo::Parts{device.device, *algorithm_, parts_.scenes, parts_.parameters,
                     threaded ? &stamps_ : nullptr, &workspaces_, &parts_.removal},
        device.workspace, device.servo);
    if (device.armed)
        servo_->arm();
    if (!threaded) {
        running_ = true;
        return {};
    }
    ServoThreadOptions options;
    options.memory = std::move(device.memory);
    for (const std::span<const std::byte> memory : algorithm_->memory())
        options.memory.push_back(memory);
    options.memory.push_back(std::as_bytes(std::span(stamps_.storage())));
    options.hung = std::move(device.hung);
    options.after = [this, after = std::move(device.after)](const ServoTick& tick) {
        follow(tick);
        return !after || after(tick);
    };
    running_ = true;
    try {
        servo_thread_ = std::make_unique<ServoThread>(*servo_, std::move(options));
    } catch (...) { // no memory, or no thread: nothing runs
        running_ = false;
        throw;
    }
    parts_.editor.poll_inputs(true);
    parts_.locker->wake();
    return {};
}

void DeviceLink::stop() {
    if (!running_.exchange(false))
        return;
    if (servo_thread_)
        servo_thread_->stop();
    else
        servo_->release();
    parts_.editor.poll_inputs(false);
    // From here on this thread is the one that pushes.
    while (down_ && !push(EditInput::Kind::up, last_pose_)) {
        if (servo_thread_) // the editor is busy with the inputs that fill its ring
            std::this_thread::sleep_for(std::chrono::microseconds(200));
        else
            parts_.editor.settle();
    }
}

void DeviceLink::arm() {
    if (running_)
        servo_->arm();
}

void DeviceLink::disarm() {
    if (running_)
        servo_->disarm();
}

Result<void> DeviceLink::calibrate() {
    if (running_ || !servo_)
        return fail("expected a device that has been started and stopped, found {}",
                    running_ ? "one that is running: stop it first" : "none");
    return servo_->device().calibrate();
}

DeviceReport DeviceLink::report() const {
    if (!servo_)
        return {};
    const Telemetry& telemetry = servo_->telemetry();
    return {servo_->device().capabilities().name,
            running_,
            telemetry.status,
            telemetry.force,
            telemetry.faults,
            telemetry.ticks};
}

void DeviceLink::move_workspace(const WorkspaceSettings& settings) {
    workspaces_.publish(std::make_unique<const WorkspaceSettings>(settings));
}

bool DeviceLink::push(EditInput::Kind kind, const StrokePose& pose, uint8_t tool) noexcept {
    const uint64_t number = pushed_.load(std::memory_order_relaxed) + 1;
    if (!parts_.editor.push({kind, pose, number, profile::now_ns(), tool}))
        return false;
    pushed_.store(number, std::memory_order_release);
    if (const double dt_s = pose.time_s - last_pose_.time_s; down_ && dt_s > 0.0)
        speed_mm_per_s_.store(
            glm::distance(pose.tool.position_mm, last_pose_.tool.position_mm) / dt_s,
            std::memory_order_relaxed);
    down_ = kind != EditInput::Kind::up;
    last_pose_ = pose;
    return true;
}

bool DeviceLink::stroke(EditInput::Kind kind, const StrokePose& pose) {
    return !running_ && down_ == (kind != EditInput::Kind::down) && push(kind, pose);
}

ServoTick DeviceLink::tick(int64_t now_ns, int64_t due_ns) {
    PALPATE_ASSERT(!servo_thread_ && running_);
    const ServoTick tick = servo_->tick(now_ns, due_ns);
    follow(tick);
    return tick;
}

void DeviceLink::follow(const ServoTick& tick) noexcept {
    parts_.lag.feels(FeltPublisher::snapshot_of(tick.scene_version));
    if (!tick.usable)
        return;
    const auto presses = [&](uint8_t tool) {
        return carves_[tool].load(std::memory_order_acquire) && buttons_[tool] < 32 &&
               (tick.buttons >> buttons_[tool] & 1);
    };
    const Carving carving = tick.touched.carving;
    const bool by_button = carving == Carving::by_button;
    if (!down_) // the button that was pressed first; where none decides, the second one chooses
        tool_ = by_button ? (presses(0) ? 0 : 1) : (presses(1) ? 1 : 0);
    const bool pressed =
        by_button ? presses(tool_)
                  : carving == Carving::at_tool && carves_[tool_].load(std::memory_order_acquire);
    if (!pressed && !down_)
        return;
    const auto kind = !down_    ? EditInput::Kind::down
                      : pressed ? EditInput::Kind::move
                                : EditInput::Kind::up;
    // By a button the tool is where it is held out of the material; the hand may be far inside.
    const glm::dvec3 at_mm = by_button ? tick.touched.proxy.position_mm : tick.tool.position_mm;
    const StrokePose pose =
        pressed ? StrokePose{1e-9 * static_cast<double>(tick.now_ns), {at_mm, tick.tool.rotation}}
                : last_pose_;
    push(kind, pose,
         tool_); // full: tried again with the next tick's pose, and the sweep leaves no gap
}

int64_t DeviceLink::lock_bricks(int64_t now_ns, const std::optional<Volume>& felt,
                                double tool_radius_mm) {
    if (!is_running())
        return kNever_ns;
    if (now_ns - locked_ns_ < kLockEvery_ns)
        return locked_ns_ + kLockEvery_ns;
    locked_ns_ = now_ns;
    std::optional<ToolStamp> newest;
    for (ToolStamp stamp; stamps_.pop(stamp);)
        newest = stamp;
    if (newest && felt)
        bricks_.update(*felt, newest->tool.position_mm, kLockReach_mm + tool_radius_mm);
    return now_ns + kLockEvery_ns;
}

} // namespace palpate
