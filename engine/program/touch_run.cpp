#include "engine/program/touch_run.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>

#include "engine/base/log.h"
#include "engine/base/memory_limit.h"
#include "engine/program/hung_device.h"
#include "haptics/core/clock.h"

namespace palpate {

namespace {

using namespace haptics;

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

// Ticks on the wall clock until `count` are done.
Result<void> run_by_clock(Session& session, SessionDevice device, TouchRun& run, size_t count,
                          const std::stop_token& stop,
                          const std::function<void(double)>& progress) {
    std::vector<ServoTick>& ticks = run.ticks;
    ticks.resize(count);
    std::atomic<size_t> done = 0;
    device.memory = {std::as_bytes(std::span(ticks))};
    device.after = [&](const ServoTick& tick) {
        const size_t at = done.load(std::memory_order_relaxed);
        ticks[at] = tick;
        done.store(at + 1, std::memory_order_release);
        return at + 1 < count;
    };
    PALPATE_TRY(session.start(std::move(device)));
    const ServoThread& thread = *session.servo_thread();
    log::info("servo: {}{}{}", thread.state().policy,
              thread.state().locked ? ", locked in memory" : "",
              thread.state().why.empty() ? "" : "; " + thread.state().why);
    std::string refusal;
    while (!thread.ended() && !stop.stop_requested() && refusal.empty()) {
        progress(static_cast<double>(done) / static_cast<double>(count));
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        listen(run, session, monotonic_ns());
        refusal = session.take_refusal();
    }
    session.stop();
    ticks.resize(done);
    log::info("page faults in ticks: {}, involuntary switches: {}", thread.use().page_faults,
              thread.use().involuntary_switches);
    if (!refusal.empty())
        return fail("{}", refusal);
    return {};
}

// The same on a virtual clock, as fast as it goes.
Result<void> run_by_ticks(Session& session, const SessionDevice& device, TouchRun& run,
                          RecordingDevice& recorder, size_t count, int64_t period_ns,
                          const std::stop_token& stop,
                          const std::function<void(double)>& progress) {
    PALPATE_TRY(session.start(device));
    run.ticks.reserve(count);
    for (size_t i = 0; i < count; ++i) {
        const int64_t now_ns = static_cast<int64_t>(i) * period_ns;
        run.ticks.push_back(session.tick(now_ns, now_ns));
        recorder.drain(run.records);
        listen(run, session, now_ns);
        if (const std::string refusal = session.take_refusal(); !refusal.empty())
            return fail("{}", refusal);
        if (i % 256 == 0)
            progress(static_cast<double>(i) / static_cast<double>(count));
        if (stop.stop_requested())
            return fail("interrupted after {} of {} ticks", i, count);
    }
    session.stop();
    return {};
}

} // namespace

void listen(TouchRun& run, const Session& session, int64_t now_ns) {
    const double time_s = 1e-9 * static_cast<double>(now_ns - run.start_ns);
    if (run.milling.empty() || time_s - run.milling.back().time_s >= 1e-3 * Session::kMeasure_ms)
        run.milling.push_back({time_s, session.milling()});
}

Result<TouchRun> run_touch_loop(TouchRunSetup setup, std::stop_token stop,
                                const std::function<void(double share)>& progress) {
    const HandPath path = with_lead(setup.path);
    const Workspace workspace =
        workspace_around(path, setup.device.capabilities, setup.settings.scale);
    if (setup.settings.scale == 0.0 && workspace.scale() > 1.0)
        log::info(
            "the path needs a scale of {:.3g} mm of the world per mm of the device; a "
            "stiffness of k feels like {:.3g} k",
            workspace.scale(), workspace.scale());
    const auto period_ns = std::llround(1e9 / setup.settings.rate_hz);
    // All ticks are kept, and as text in the end; the device may have the path as well.
    constexpr double kBytes = sizeof(ServoTick) + 2 * sizeof(DeviceRecord) + 1024;
    const double needed = path.end_s() * setup.settings.rate_hz * kBytes;
    PALPATE_TRY(expect_memory(
        fmt::format("a path of {:g} s at {:g} Hz", path.end_s() - kLead_s, setup.settings.rate_hz),
        needed));
    const auto count = static_cast<size_t>(path.end_s() * setup.settings.rate_hz) + 1;
    const int64_t begin_ns = setup.real_time ? monotonic_ns() + period_ns : 0;
    PALPATE_TRY(const std::unique_ptr<HapticDevice> device,
                open_device(setup.device, {.path = path,
                                           .workspace = workspace,
                                           .hand = {.grip = setup.settings.grip},
                                           .delay_ticks = setup.settings.delay_ticks,
                                           .rate_hz = setup.settings.rate_hz,
                                           .start_ns = begin_ns}));
    RecordingDevice recorder(*device, setup.real_time ? count + 16 : 16);
    setup.session.edit.threaded = setup.real_time;
    const std::string edited =
        setup.edit ? setup.edit->on : setup.session.document.volumes.front().name;
    TouchRun run{.volume = *setup.session.document.find(edited)};
    run.start_ns = begin_ns + std::llround(kLead_s * 1e9);
    Session session(std::move(setup.session));
    const size_t begun = session.state().strokes_done;
    if (setup.edit)
        session.use(*setup.edit);
    if (setup.second_edit)
        session.use(*setup.second_edit, 1);
    SessionDevice touched{recorder, setup.algorithm, workspace, servo_options(setup), {}, {}};
    touched.hung = end_where_device_hangs(setup.device.name);
    PALPATE_TRY(setup.real_time ? run_by_clock(session, touched, run, count, stop, progress)
                                : run_by_ticks(session, touched, run, recorder, count, period_ns,
                                               stop, progress));
    session.settle(); // a stroke under way ends with the path
    if (const std::string refusal = session.take_refusal(); !refusal.empty())
        return fail("{}", refusal);
    recorder.drain(run.records);
    if (session.servo()->safety().mode() == SoftStart::Mode::waiting)
        log::warning(
            "force never began: the path's first pose is in contact, or the device was "
            "not ready");
    const EditState end = session.state();
    run.volume = *end.document.find(edited);
    run.strokes = end.strokes_done - begun;
    run.removed_mm3 = session.milling().removed_mm3;
    run.telemetry = telemetry_json(session.servo()->telemetry());
    return run;
}

} // namespace palpate
