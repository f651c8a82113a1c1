#include "apps/view/document/touch.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/program/hung_device.h"
#include "haptics/core/clock.h"
#include "haptics/device/registry.h"
#include "haptics/field/field.h"

namespace palpate::view {

namespace {

using namespace haptics;

constexpr int64_t kTick_ns = 1'000'000;
constexpr double kTick_s = 1e-3;
constexpr double kMost_s = 60.0; // of ticks in a frame

TouchSample sample_of(const ServoTick& tick) {
    return {.usable = tick.usable,
            .probe = tick.tool,
            .proxy = {tick.touched.proxy.position_mm, tick.tool.rotation},
            .force_n = tick.sent_world_n,
            .energy_mj = tick.energy_mj,
            .buttons = tick.buttons,
            .faults = tick.faults,
            .contact = tick.touched.contact,
            .plate = tick.plate,
            .status = tick.status};
}

PointerTarget target_of(const Stylus& stylus) {
    return {stylus.meant, stylus.buttons, stylus.eye_mm, stylus.clear_mm};
}

bool is_over(DeviceStatus status) {
    return status == DeviceStatus::ended || status == DeviceStatus::gone;
}

} // namespace

bool follows_edits(const AlgorithmEntry& algorithm) {
    return !algorithm.takes(haptics::kTakesMesh);
}

Touch::Touch(Session& session, bool threaded, glm::dvec3 center_mm, glm::dvec3 half_size_mm)
    : session_(&session),
      threaded_(threaded),
      center_mm_(center_mm),
      half_size_mm_(half_size_mm),
      forces_n_(kPlotted),
      energies_mj_(kPlotted) {}

Touch::~Touch() {
    stop();
}

std::vector<std::string> Touch::devices() const {
    std::vector<std::string> names{kMouse};
    for (const DeviceEntry& entry : options_.list())
        if (entry.driver == std::string_view("simulated") ||
            (entry.driver == std::string_view("exact") && options_.path) ||
            (!entry.node.empty() && entry.refusal.empty()))
            names.push_back(entry.name);
    return names;
}

Result<Touch::Opened> Touch::open_device(const Stylus& stylus, int64_t start_ns) const {
    const bool is_mouse = options_.device == kMouse;
    DeviceEntry entry;
    if (!is_mouse) {
        PALPATE_TRY(entry, find_device(options_.device));
    }
    const bool is_simulated = entry.driver == std::string_view("simulated");
    if (is_mouse || (is_simulated && !options_.path)) {
        const DevicePreset& preset = is_mouse ? pointer_preset() : *find_device_preset(entry.name);
        // A device that reaches less far than the volume is scaled up to it.
        const glm::dvec3 need = half_size_mm_ / (1e3 * preset.capabilities.workspace_m);
        const Workspace workspace(center_mm_, std::max({1.0, need.x, need.y, need.z}));
        auto pointer = std::make_shared<PointerHand>(target_of(stylus), workspace);
        auto device = std::make_unique<SimulatedDevice>(
            preset, is_mouse ? pointer_hand_model() : HandModel(), pointer, start_ns);
        return Opened{std::move(device), std::move(pointer), workspace};
    }
    if (!options_.path && entry.driver == std::string_view("exact"))
        return fail("{}: expected the path of a hand, found none", entry.name);
    DeviceSetup setup{.start_ns = start_ns};
    setup.workspace = Workspace(center_mm_, 1.0);
    if (!entry.node.empty()) { // plugged in: the volume comes into its reach
        const glm::dvec3 need = half_size_mm_ / (1e3 * entry.capabilities.workspace_m);
        setup.workspace = Workspace(center_mm_, std::max({1.0, need.x, need.y, need.z}));
    } else if (options_.path) {
        setup.path = *options_.path;
        setup.workspace = workspace_around(setup.path, entry.capabilities, 0.0);
    }
    PALPATE_TRY(std::unique_ptr<HapticDevice> device, haptics::open_device(entry, setup));
    if (device->capabilities().needs_homing)
        PALPATE_TRY(device->home());
    return Opened{std::move(device), nullptr, setup.workspace};
}

Result<void> Touch::start(const Stylus& stylus) {
    stop();
    const AlgorithmEntry* algorithm = find_algorithm(options_.algorithm);
    if (!algorithm || !follows_edits(*algorithm))
        return fail("expected a haptic algorithm that follows edits, found '{}'",
                    options_.algorithm);
    const int64_t start_ns = threaded_ ? monotonic_ns() + kTick_ns : (ticks_ + 1) * kTick_ns;
    PALPATE_TRY(Opened opened, open_device(stylus, start_ns));
    if (const TouchScene felt = session_->felt(); felt.grey) {
        TouchParameters parameters = session_->parameters();
        tune(parameters, *felt.grey);
        session_->feel(parameters);
    }
    SessionDevice device{*opened.device,
                         *algorithm,
                         opened.workspace,
                         {.remove_button = 0, .second_button = 1},
                         {std::as_bytes(std::span(samples_.storage()))},
                         {},
                         /*armed=*/false};
    device.after = [this](const ServoTick& tick) {
        samples_.push(sample_of(tick)); // full: an interface that hangs shows less
        return true;
    };
    device.hung = end_where_device_hangs(options_.device);
    PALPATE_TRY(session_->start(std::move(device)));
    device_ = std::move(opened.device); // the session is done with the one before
    pointer_ = std::move(opened.pointer);
    running_ = true;
    status_ = DeviceStatus::ok;
    time_s_.reset();
    owed_s_ = 0.0;
    return {};
}

void Touch::stop() {
    if (!std::exchange(running_, false))
        return;
    session_->stop();
    for (TouchSample sample; samples_.pop(sample);) {
    }
    if (now_)
        now_->force_n = glm::dvec3(0.0);
}

void Touch::arm() {
    if (!running_)
        message_ = "no hand runs: start one first";
    session_->arm();
}

bool Touch::armed() const {
    return running_ && session_->device_report().force != SoftStart::Mode::disarmed;
}

void Touch::note(const TouchSample& sample) {
    status_ = sample.status;
    if (sample.usable)
        now_ = sample;
    if (sample.plate.plate >= 0 || plate_ >= 0)
        plates_.push_back(sample.plate);
    plate_ = sample.plate.plate;
    most_n_ = std::max(most_n_, static_cast<float>(glm::length(sample.force_n)));
    if (++gathered_ < kTicksAPoint)
        return;
    std::rotate(forces_n_.begin(), forces_n_.begin() + 1, forces_n_.end());
    std::rotate(energies_mj_.begin(), energies_mj_.begin() + 1, energies_mj_.end());
    forces_n_.back() = std::exchange(most_n_, 0.0f);
    energies_mj_.back() = static_cast<float>(sample.energy_mj);
    gathered_ = 0;
}

void Touch::tick_until(double time_s) {
    owed_s_ += std::clamp(time_s - time_s_.value_or(time_s), 0.0, kMost_s);
    for (; owed_s_ >= kTick_s && !is_over(status_); owed_s_ -= kTick_s) {
        const int64_t now_ns = ++ticks_ * kTick_ns;
        note(sample_of(session_->tick(now_ns, now_ns)));
    }
}

void Touch::frame(const Stylus& stylus, double time_s) {
    if (running_ && !threaded_)
        tick_until(time_s);
    time_s_ = time_s;
    for (TouchSample sample; samples_.pop(sample);)
        note(sample);
    if (pointer_)
        pointer_->point(target_of(stylus));
    if (running_ && is_over(status_)) {
        message_ = status_ == DeviceStatus::ended ? "the recording of the hand is over"
                                                  : "the haptic device is gone; it is stopped";
        stop();
    }
}

const Telemetry* Touch::telemetry() const {
    return session_->servo() ? &session_->servo()->telemetry() : nullptr;
}

std::string Touch::servo_text() const {
    const ServoThread* thread = running_ ? session_->servo_thread() : nullptr;
    if (!thread)
        return "";
    return thread->state().policy + (thread->state().why.empty() ? "" : "; " + thread->state().why);
}

} // namespace palpate::view
