#include "haptics/servo/servo.h"

#include <algorithm>
#include <utility>

#include "haptics/core/clock.h"
#include "haptics/servo/crash_stop.h"

namespace palpate::haptics {

namespace {

constexpr double kNsPerS = 1e9;
constexpr int64_t kHaltAgain_ns = 1'000'000;

bool pressed(uint32_t buttons, uint32_t button) {
    return button < 32 && (buttons >> button & 1);
}

} // namespace

Servo::Servo(const Parts& parts, const Workspace& workspace, const Options& options)
    : parts_(parts),
      workspace_(workspace),
      options_(options),
      safety_(options.limits, parts.device.capabilities(), options.rate_hz),
      most_stiffness_n_per_m_(haptics::most_stiffness_n_per_m(
          options.limits, parts.device.capabilities(), options.rate_hz)),
      scenes_(parts.scenes.add_reader()),
      parameters_(parts.parameters.add_reader()),
      fade_(safety_.most_force_n()) {
    if (parts.workspace)
        settings_.emplace(parts.workspace->add_reader());
}

void Servo::move_workspace(const DeviceSample& sample, double dt_s) noexcept {
    WorkspaceSettings wanted{.scale = workspace_.scale(), .rotation = workspace_.rotation()};
    if (settings_)
        wanted = *settings_->pin();
    wanted.clutched = wanted.clutched || pressed(sample.buttons, options_.clutch_button);
    workspace_.follow(wanted, sample, dt_s);
}

// False: a watchdog has halted the device since the tick began, or the process dies, and nothing
// goes out.
bool Servo::write(int64_t now_ns, const Wrench& wrench) noexcept {
    if (CrashStop::dying() || !gate_.begin_write())
        return false;
    safety_.written(parts_.device.write(now_ns, wrench));
    if (gate_.end_write(now_ns))
        return true;
    parts_.device.halt(now_ns);
    return false;
}

int64_t Servo::watch(int64_t now_ns) noexcept {
    const auto period_ns = static_cast<int64_t>(kNsPerS / options_.rate_hz);
    const int64_t limit_ns = options_.limits.too_late_ns + period_ns;
    if (gate_.close(now_ns, limit_ns)) {
        parts_.device.halt(now_ns);
        if (std::exchange(tripped_ns_, gate_.last_ns()) != tripped_ns_)
            telemetry_.trips.fetch_add(1, std::memory_order_relaxed);
        return now_ns + kHaltAgain_ns;
    }
    const int64_t last_ns = gate_.last_ns();
    return last_ns == 0 ? now_ns + limit_ns : std::max(now_ns, last_ns + limit_ns) + 1000;
}

ServoTick Servo::tick(int64_t now_ns, int64_t due_ns) noexcept {
    ServoTick t{.now_ns = now_ns};
    switch (command_.exchange(Command::none, std::memory_order_acquire)) {
        case Command::arm:
            safety_.arm();
            break;
        case Command::disarm:
            safety_.disarm();
            break;
        case Command::none:
            break;
    }
    if (gate_.reopen(now_ns))
        safety_.halted();
    const int64_t began_ns = monotonic_ns();
    t.status = parts_.device.read(now_ns, sample_);
    const int64_t cpu_began_ns = thread_cpu_ns();

    const SafetyChain::Begun begun = safety_.begin(now_ns, due_ns, t.status, sample_);
    const double dt_s =
        has_last_ ? std::clamp(static_cast<double>(now_ns - last_ns_) / kNsPerS, 1e-5, 0.1)
                  : 1.0 / options_.rate_hz;
    last_ns_ = now_ns;
    has_last_ = true;
    t.usable = begun.usable;
    const auto scene = scenes_.pin();
    t.scene_version = scene->version;
    Wrench wanted;
    double stiffness_n_per_m = 0.0;
    if (begun.usable) {
        t.buttons = begun.sample.buttons;
        move_workspace(begun.sample, dt_s);
        t.tool = workspace_.tool(begun.sample);
        t.velocity_mm_per_s = workspace_.velocity_mm_per_s(begun.sample);
        const auto parameters = parameters_.pin();
        const double going = parts_.removal ? parts_.removal->load(std::memory_order_relaxed) : 0.0;
        removal_ += std::clamp(std::clamp(going, 0.0, 1.0) - removal_, -dt_s / kRemoval_s,
                               dt_s / kRemoval_s);
        const double most_n_per_m = most_stiffness_n_per_m_ / workspace_.scale();
        const TouchParameters& now = slew_.step(*parameters, dt_s, most_n_per_m);
        const TickInput input{.tool = t.tool,
                              .velocity_mm_per_s = t.velocity_mm_per_s,
                              .dt_s = dt_s,
                              .buttons = t.buttons,
                              .removal = removal_,
                              .scene = &*scene,
                              .parameters = &now};
        const Seen seen_scene{&*scene, scene.epoch()},
            seen_parameters{&*parameters, parameters.epoch()};
        if (!was_usable_) { // homing, a fault, the start: the hand is somewhere else
            parts_.algorithm.reset(input);
            fade_.reset();
            press_.reset();
        } else if (seen_scene != seen_scene_ || seen_parameters != seen_parameters_) {
            fade_.command(now.surface_delay_s);
        }
        seen_scene_ = seen_scene;
        seen_parameters_ = seen_parameters;
        t.touched = parts_.algorithm.tick(input);
        const Contact before = std::exchange(contact_, t.touched.contact);
        if (was_usable_ && contact_ != before &&
            (has_no_surface(contact_) || has_no_surface(before)))
            fade_.command(0.0);
        const glm::dvec3 pressed_n =
            press_.tick(scene->plates.get(), t.tool.position_mm, now.tool_radius_mm);
        t.plate = press_.touch();
        const double plate_n_per_m = t.plate.stiffness_n_per_m;
        t.touched.force_n +=
            plate_n_per_m > most_n_per_m ? most_n_per_m / plate_n_per_m * pressed_n : pressed_n;
        if (slew_.is_softened() || plate_n_per_m > most_n_per_m)
            safety_.softened();
        telemetry_.iterations.add(t.touched.iterations);
        const double natural_n = natural_change_n(
            now, glm::distance(t.tool.position_mm, last_tool_.position_mm),
            glm::distance(t.velocity_mm_per_s, last_velocity_mm_per_s_), input.removal);
        last_tool_ = t.tool;
        last_velocity_mm_per_s_ = t.velocity_mm_per_s;
        const Wrench faded = fade_.next({t.touched.force_n, t.touched.torque_nm}, natural_n, dt_s);
        const double share = workspace_.force_share();
        wanted = workspace_.to_device({share * faded.force_n, share * faded.torque_nm});
        stiffness_n_per_m = share *
                            std::max(now.stiffness_n_per_m, std::min(plate_n_per_m, most_n_per_m)) *
                            workspace_.scale();
        if (was_usable_)
            energy_mj_ += 1e3 * glm::dot(last_sent_n_, begun.sample.position_m - last_position_m_);
        last_position_m_ = begun.sample.position_m;
    } else {
        t.touched.contact = Contact::unknown;
    }
    was_usable_ = begun.usable;
    t.sent = safety_.finish(wanted, stiffness_n_per_m);
    t.sent_world_n = workspace_.rotation() * t.sent.force_n;
    last_sent_n_ = t.sent.force_n;
    t.faults = safety_.faults();
    t.share = safety_.share();
    t.damping_n = safety_.damping_n();
    t.rendered_world_n = workspace_.rotation() * wanted.force_n;
    t.energy_mj = energy_mj_;
    t.cpu_ns = thread_cpu_ns() - cpu_began_ns;

    if (!write(now_ns, t.sent)) {
        t.sent = {};
        t.sent_world_n = last_sent_n_ = glm::dvec3(0.0);
    }

    if (parts_.poses && begun.usable &&
        !parts_.poses->push({now_ns, t.tool, t.touched.proxy, t.buttons, t.scene_version}))
        telemetry_.poses_refused.fetch_add(1, std::memory_order_relaxed);
    telemetry_.wake_ns.add(static_cast<uint64_t>(std::max<int64_t>(0, now_ns - due_ns)));
    telemetry_.cpu_ns.add(static_cast<uint64_t>(std::max<int64_t>(0, t.cpu_ns)));
    telemetry_.whole_ns.add(static_cast<uint64_t>(std::max<int64_t>(0, monotonic_ns() - began_ns)));
    telemetry_.versions_behind.add(parts_.scenes.epoch() - scene.epoch());
    telemetry_.ticks.fetch_add(1, std::memory_order_relaxed);
    telemetry_.faults.store(t.faults, std::memory_order_release);
    telemetry_.status.store(t.status, std::memory_order_relaxed);
    telemetry_.force.store(safety_.mode(), std::memory_order_relaxed);
    return t;
}

} // namespace palpate::haptics
