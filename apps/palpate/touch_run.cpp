#include "apps/palpate/touch_run.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>

#include "engine/base/log.h"
#include "engine/base/memory.h"
#include "engine/edit/stroke_run.h"
#include "haptics/servo/brick_lock.h"
#include "haptics/servo/servo_thread.h"

namespace palpate {

namespace {

using namespace haptics;
using haptics::ToolPose;

constexpr double kLead_s = 2.1; // the soft start and a little

// The path, after a rest at its first pose that begins at time 0.
HandPath with_lead(const HandPath& path) {
    std::vector<HandPose> poses{path.poses().front()};
    poses.front().time_s = 0.0;
    poses.front().buttons = 0;
    const double shift_s = kLead_s - path.poses().front().time_s;
    for (HandPose pose : path.poses()) {
        pose.time_s += shift_s;
        poses.push_back(pose);
    }
    return HandPath(std::move(poses));
}

// The middle of the path in the middle of the device, and as much world for each of its millimetres
// as the path needs with a tenth to spare.
Workspace workspace_for(const HandPath& path, const DeviceCapabilities& device, double scale) {
    glm::dvec3 low = path.poses().front().tool.position_mm, high = low;
    for (const HandPose& pose : path.poses()) {
        low = glm::min(low, pose.tool.position_mm);
        high = glm::max(high, pose.tool.position_mm);
    }
    if (scale == 0.0) {
        const glm::dvec3 need = 1.1 * (high - low) / (2e3 * device.workspace_m);
        scale = std::max({1.0, need.x, need.y, need.z});
        if (scale > 1.0)
            log::info(
                "the path needs {:.3g} mm of the world a mm of the device; a stiffness of k "
                "feels like {:.3g} k",
                scale, scale);
    }
    return Workspace(0.5 * (low + high), scale);
}

// Does what the edit says where the tool passes while button 0 is pressed: one stroke a press, so
// that operations which read S' take the snapshot of that moment. The tool is where it is held out
// of the material; the hand may be far inside.
class Carver {
 public:
    Carver(Mailbox<TouchScene>& scenes, TouchEdit edit) : scenes_(scenes), edit_(std::move(edit)) {}
    Result<void> follow(const ToolStamp& stamp) {
        if (!(stamp.buttons & 1)) {
            stroke_.reset();
            return {};
        }
        const TouchScene& scene = scenes_.latest();
        const bool on_labels = edit_.operation.on_labels();
        const Volume& before = on_labels ? *scene.labels : *scene.grey;
        if (!stroke_) {
            auto begun = StrokeRun::start(before, edit_.tool, edit_.operation,
                                          on_labels ? scene.grey : std::nullopt);
            if (!begun)
                return pass_on(begun);
            stroke_ = std::move(*begun);
        }
        const palpate::ToolPose pose{static_cast<double>(stamp.time_ns) * 1e-9,
                                     stamp.proxy.position_mm, stamp.tool.rotation};
        stroke_->add(std::span(&pose, 1));
        stroke_->work();
        const Volume now = stroke_->publish();
        if (!now.is_same_as(before)) {
            TouchScene next = scene;
            // Where SCENE itself is the label map, there is one volume.
            const bool is_one = scene.labels && scene.labels->is_same_as(*scene.grey);
            if (on_labels || is_one)
                next.labels = now;
            if (!on_labels || is_one)
                next.grey = now;
            next.version = now.version();
            scenes_.publish(std::make_unique<const TouchScene>(std::move(next)));
        }
        return {};
    }

 private:
    Mailbox<TouchScene>& scenes_;
    TouchEdit edit_;
    std::unique_ptr<StrokeRun> stroke_;
};

std::unique_ptr<HapticDevice> make_device(const TouchRunSetup& setup, const DevicePreset& preset,
                                          const HandPath& path, const Workspace& workspace,
                                          int64_t start_ns) {
    if (setup.device == "exact")
        return std::make_unique<RecordedDevice>(
            preset.capabilities,
            records_of_path(path, workspace, std::llround(1e9 / setup.rate_hz)), start_ns);
    return std::make_unique<SimulatedDevice>(preset, setup.hand, path, workspace, start_ns);
}

// Ticks on the wall clock until `count` are done; the calling thread edits meanwhile.
Result<void> run_real_time(Servo& servo, const TouchRunSetup& setup, TouchRun& run, size_t count,
                           Algorithm& algorithm, Ring<ToolStamp>& poses, Carver* carver,
                           Mailbox<TouchScene>& scenes, const std::stop_token& stop,
                           const std::function<void(double)>& progress) {
    run.ticks.resize(count);
    std::atomic<size_t> done = 0;
    ServoThreadOptions options;
    void* const state = dynamic_cast<void*>(&algorithm);
    options.memory = {std::span(static_cast<const std::byte*>(state), malloc_usable_size(state)),
                      std::as_bytes(std::span(poses.storage())),
                      std::as_bytes(std::span(run.ticks))};
    options.after = [&](const ServoTick& tick) {
        const size_t at = done.load(std::memory_order_relaxed);
        run.ticks[at] = tick;
        done.store(at + 1, std::memory_order_release);
        return at + 1 < count;
    };
    BrickLock bricks;
    const auto felt = [&]() -> const Volume& {
        const TouchScene& scene = scenes.latest();
        return setup.parameters.source == TouchSource::labels ? *scene.labels : *scene.grey;
    };
    ServoThread thread(servo, std::move(options));
    log::info("servo: {}{}{}", thread.state().policy,
              thread.state().locked ? ", locked in memory" : "",
              thread.state().why.empty() ? "" : "; " + thread.state().why);
    while (!thread.ended() && !stop.stop_requested()) {
        bool any = false;
        for (ToolStamp stamp; poses.pop(stamp); any = true) {
            if (carver)
                if (Result<void> cut = carver->follow(stamp); !cut)
                    return cut;
            if (stamp.time_ns / 1'000'000 % 20 == 0)
                bricks.update(felt(), stamp.tool.position_mm,
                              5.0 + setup.parameters.tool_radius_mm);
        }
        progress(static_cast<double>(done) / static_cast<double>(count));
        if (!any)
            std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    thread.stop();
    run.ticks.resize(done);
    log::info("page faults in ticks: {}, involuntary switches: {}", thread.use().page_faults,
              thread.use().involuntary_switches);
    return {};
}

} // namespace

Result<TouchRun> run_touch_loop(const TouchRunSetup& setup, std::stop_token stop,
                                const std::function<void(double share)>& progress) {
    const DevicePreset* found =
        find_device_preset(setup.device == "exact" ? "ideal" : setup.device);
    if (!found)
        return fail("expected a simulated device, found '{}'", setup.device);
    DevicePreset preset = *found;
    preset.plant.delay_ticks = setup.delay_ticks;
    const HandPath path = with_lead(setup.path);
    const Workspace workspace = workspace_for(path, preset.capabilities, setup.scale);
    if (setup.device == "exact") // no hand, no reach, no speed: the path is what is tested
        preset.capabilities.workspace_m = glm::dvec3(10.0);

    const auto period_ns = std::llround(1e9 / setup.rate_hz);
    // All ticks are kept, and as text in the end; the device may have the path as well.
    constexpr double kBytes = sizeof(ServoTick) + 2 * sizeof(DeviceRecord) + 1024;
    const double needed = path.end_s() * setup.rate_hz * kBytes;
    if (!(needed < 0.75 * static_cast<double>(physical_memory_bytes())))
        return fail(
            "a path of {:g} s at {:g} Hz: expected one that fits into memory, found {:.3g} GiB",
            path.end_s() - kLead_s, setup.rate_hz, needed * 0x1p-30);
    const auto count = static_cast<size_t>(path.end_s() * setup.rate_hz) + 1;
    TouchRun run;
    const int64_t begin_ns = setup.real_time ? monotonic_ns() + period_ns : 0;
    run.start_ns = begin_ns + std::llround(kLead_s * 1e9);
    Mailbox<TouchScene> scenes(std::make_unique<const TouchScene>(setup.scene));
    Mailbox<TouchParameters> parameters(std::make_unique<const TouchParameters>(setup.parameters));
    Ring<ToolStamp> poses(1 << 15);
    const std::unique_ptr<Algorithm> algorithm = setup.algorithm.make();
    const std::unique_ptr<HapticDevice> device =
        make_device(setup, preset, path, workspace, begin_ns);
    RecordingDevice recorder(*device, setup.real_time ? count + 16 : 16);
    Servo::Options options{.rate_hz = setup.rate_hz};
    auto servo = std::make_unique<Servo>(
        Servo::Parts{recorder, *algorithm, scenes, parameters, &poses}, workspace, options);
    servo->arm();
    std::optional<Carver> carver;
    if (setup.edit)
        carver.emplace(scenes, *setup.edit);

    if (setup.real_time) {
        Result<void> done = run_real_time(*servo, setup, run, count, *algorithm, poses,
                                          carver ? &*carver : nullptr, scenes, stop, progress);
        if (!done)
            return pass_on(done);
    } else {
        run.ticks.reserve(count);
        for (size_t i = 0; i < count; ++i) {
            const int64_t now_ns = static_cast<int64_t>(i) * period_ns;
            run.ticks.push_back(servo->tick(now_ns, now_ns));
            recorder.drain(run.records);
            for (ToolStamp stamp; poses.pop(stamp);)
                if (carver)
                    if (Result<void> cut = carver->follow(stamp); !cut)
                        return pass_on(cut);
            if (i % 256 == 0)
                progress(static_cast<double>(i) / static_cast<double>(count));
            if (stop.stop_requested())
                return fail("interrupted after {} of {} ticks", i, count);
        }
    }
    recorder.drain(run.records);
    if (servo->safety().mode() == SoftStart::Mode::waiting)
        log::warning(
            "force never began: the path's first pose is in contact, or the device was "
            "not ready");
    run.scene = scenes.latest();
    run.telemetry = telemetry_json(servo->telemetry());
    return run;
}

} // namespace palpate
