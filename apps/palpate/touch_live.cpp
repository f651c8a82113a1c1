#include "apps/palpate/touch_live.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "engine/base/log.h"
#include "engine/base/memory_limit.h"
#include "engine/program/hung_device.h"
#include "haptics/core/clock.h"

namespace palpate {

namespace {

using namespace haptics;
using std::chrono::milliseconds;

// Lines of standard input, which tell that a person wants force.
class Lines {
 public:
    // Waits for a line, or as long as given.
    bool next(milliseconds patience) {
        if (is_over_) {
            std::this_thread::sleep_for(patience);
            return false;
        }
        pollfd in{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
        if (::poll(&in, 1, static_cast<int>(patience.count())) <= 0)
            return false;
        char bytes[256];
        const ssize_t came = ::read(STDIN_FILENO, bytes, sizeof(bytes));
        is_over_ = came <= 0;
        return came > 0 && std::find(bytes, bytes + came, '\n') != bytes + came;
    }

 private:
    bool is_over_ = false;
};

// Half of the volume's largest side over that of the device's smallest, at least 1.
double scale_for(const Grid& grid, const DeviceCapabilities& device) {
    const glm::dvec3 size_mm = glm::dvec3(grid.size) * spacing_mm(grid);
    const double half_mm = 0.5 * std::max({size_mm.x, size_mm.y, size_mm.z});
    const glm::dvec3 reach_mm = 1e3 * device.workspace_m;
    return std::max(1.0, half_mm / std::min({reach_mm.x, reach_mm.y, reach_mm.z}));
}

struct Live {
    TouchRunSetup& setup;
    Workspace workspace;
    Session& session;
    TouchRun& run;
    std::vector<ServoTick>& ticks; // room for all
    size_t done = 0;
    Lines lines;
};

// The device, ready to be homed by hand.
Result<std::unique_ptr<HapticDevice>> open_live(const Live& live) {
    PALPATE_TRY(const DeviceEntry entry, find_device(live.setup.device.name));
    PALPATE_TRY(std::unique_ptr<HapticDevice> device,
                open_device(entry, {.path = live.setup.path,
                                    .workspace = live.workspace,
                                    .hand = {.grip = live.setup.settings.grip},
                                    .delay_ticks = live.setup.settings.delay_ticks,
                                    .rate_hz = live.setup.settings.rate_hz,
                                    .start_ns = monotonic_ns()}));
    if (device->capabilities().needs_homing) {
        PALPATE_TRY(device->home());
        log::info("{}: pull the grip all the way out, then push it in, unless it is homed already",
                  entry.name);
    }
    return device;
}

// Until the device is gone (true), or all is over.
Result<bool> run_opened(Live& live, HapticDevice& device, const std::stop_token& stop,
                        const std::function<void(double)>& progress) {
    const size_t count = live.ticks.size();
    RecordingDevice recorder(device, count - live.done + 16);
    std::atomic<size_t> done = live.done;
    std::atomic<uint32_t> faults = 0;
    std::atomic<bool> is_gone = false, is_damped = false;
    SessionDevice touched{recorder,
                          live.setup.algorithm,
                          live.workspace,
                          servo_options(live.setup),
                          {std::as_bytes(std::span(live.ticks))},
                          {},
                          /*armed=*/false};
    touched.hung = end_where_device_hangs(live.setup.device.name);
    touched.after = [&](const ServoTick& tick) {
        const size_t at = done.load(std::memory_order_relaxed);
        live.ticks[at] = tick;
        done.store(at + 1, std::memory_order_release);
        faults.store(tick.faults & kFaultLatched, std::memory_order_relaxed);
        if (tick.faults & kFaultDamped)
            is_damped.store(true, std::memory_order_relaxed);
        is_gone.store(tick.status == DeviceStatus::gone, std::memory_order_relaxed);
        return at + 1 < count && tick.status != DeviceStatus::gone &&
               tick.status != DeviceStatus::ended;
    };
    PALPATE_TRY(live.session.start(std::move(touched)));
    const ServoThread& thread = *live.session.servo_thread();
    log::info("servo: {}{}; press Enter to switch force on, Ctrl-C to end", thread.state().policy,
              thread.state().why.empty() ? "" : "; " + thread.state().why);
    std::string refusal;
    uint32_t told = 0;
    bool told_damped = false;
    while (!thread.ended() && !stop.stop_requested() && refusal.empty()) {
        if (live.lines.next(milliseconds(20))) {
            live.session.arm();
            log::info("force fades in when nothing is touched");
        }
        if (const uint32_t now = faults; now != told && (told = now) != 0)
            log::warning("force is off: {}; press Enter to switch it on again", fault_text(now));
        const bool was_damped = is_damped.exchange(false, std::memory_order_relaxed);
        if (was_damped && !told_damped)
            log::warning(
                "the handle swings under force, and is damped; hold it more firmly, or "
                "lower --stiffness");
        told_damped = was_damped;
        progress(static_cast<double>(done) / static_cast<double>(count));
        listen(live.run, live.session, monotonic_ns());
        refusal = live.session.take_refusal();
    }
    live.session.stop();
    live.done = done;
    recorder.drain(live.run.records);
    live.run.telemetry = telemetry_json(live.session.servo()->telemetry());
    if (!refusal.empty())
        return fail("{}", refusal);
    return is_gone.load();
}

} // namespace

Result<TouchRun> run_touch_live(TouchRunSetup setup, const Grid& grid, double duration_s,
                                std::stop_token stop, const std::function<void(double)>& progress) {
    constexpr double kBytes = sizeof(ServoTick) + sizeof(DeviceRecord) + 1024;
    // A device that sets the pace may tick up to twice as often (pace.h).
    const double most = 2.0 * duration_s * setup.settings.rate_hz;
    PALPATE_TRY(expect_memory(
        fmt::format("--duration: {:g} s at {:g} Hz", duration_s, setup.settings.rate_hz),
        most * kBytes));
    const double scale = setup.settings.scale > 0.0 ? setup.settings.scale
                                                    : scale_for(grid, setup.device.capabilities);
    log::info("{}: {:.3g} mm of the volume per mm of the hand", setup.device.name, scale);
    setup.session.edit.threaded = true;
    const std::string edited =
        setup.edit ? setup.edit->on : setup.session.document.volumes.front().name;
    TouchRun run{.volume = *setup.session.document.find(edited)};
    run.start_ns = monotonic_ns();
    const int64_t end_ns = run.start_ns + std::llround(1e9 * duration_s);
    run.ticks.resize(static_cast<size_t>(most) + 1);
    Session session(std::move(setup.session));
    const size_t begun = session.state().strokes_done;
    if (setup.edit)
        session.use(*setup.edit);
    if (setup.second_edit)
        session.use(*setup.second_edit, 1);
    const Workspace workspace(setup.path.poses().front().tool.position_mm, scale);
    Live live{.setup = setup,
              .workspace = workspace,
              .session = session,
              .run = run,
              .ticks = run.ticks,
              .done = 0,
              .lines = {}};
    std::stop_source over; // by the person, or by time
    const std::stop_callback on_stop(stop, [&] { over.request_stop(); });
    const auto watched = [&](double share) {
        progress(share);
        if (monotonic_ns() >= end_ns)
            over.request_stop();
    };
    PALPATE_TRY(std::unique_ptr<HapticDevice> device, open_live(live));
    for (;;) {
        PALPATE_TRY(const bool is_gone, run_opened(live, *device, over.get_token(), watched));
        if (!is_gone || over.stop_requested() || live.done + 1 >= run.ticks.size())
            break;
        log::warning("{} is gone; plug it in again, or press Ctrl-C to end", setup.device.name);
        std::string told; // why it cannot be used, once it is plugged in
        for (Result<std::unique_ptr<HapticDevice>> again = fail("");;) {
            for (int i = 0; i < 50 && !over.stop_requested(); ++i, watched(0.0))
                live.lines.next(milliseconds(20));
            if (over.stop_requested())
                break;
            if ((again = open_live(live))) {
                device = std::move(*again);
                break;
            }
            if (find_device(setup.device.name) && again.error().message != told)
                log::warning("{}", told = again.error().message);
        }
        if (over.stop_requested())
            break;
    }
    run.ticks.resize(live.done);
    session.settle();
    if (const std::string refusal = session.take_refusal(); !refusal.empty())
        return fail("{}", refusal);
    const EditState end = session.state();
    run.volume = *end.document.find(edited);
    run.strokes = end.strokes_done - begun;
    run.removed_mm3 = session.milling().removed_mm3;
    return run;
}

} // namespace palpate
