#include "haptics/device/checklist.h"

#include <algorithm>
#include <cmath>

#include "haptics/device/falcon/falcon.h"

namespace palpate::haptics {

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr double kMs_per_ns = 1e-6;

class Run {
 public:
    Run(HapticDevice& device, Clock& clock, const ChecklistOptions& options, const Owner& owner,
        const std::stop_token& stop)
        : device_(device), clock_(clock), options_(options), owner_(owner), stop_(stop) {}
    ~Run() {
        device_.write(clock_.now_ns(), {});
        device_.halt(clock_.now_ns());
    }

    Result<Checklist> all() {
        PALPATE_TRY(home());
        PALPATE_TRY(times());
        PALPATE_TRY(lights());
        if (device_.capabilities().max_force_n > 0.0)
            owner_.tell("Leave the handle alone.");
        PALPATE_TRY(list_.rest, places(options_.rest_s));
        if (options_.move_s > 0.0) {
            owner_.tell(
                fmt::format("Move the handle to all its ends, for {:g} s.", options_.move_s));
            PALPATE_TRY(list_.ends, places(options_.move_s));
        }
        if (options_.is_armed && device_.capabilities().max_force_n > 0.0)
            PALPATE_TRY(pushes());
        return std::move(list_);
    }

 private:
    // One exchange: the sample that answers what was written before, and a force.
    Result<DeviceStatus> tick(const Wrench& wrench) {
        if (device_.capabilities().paces)
            device_.wait(clock_.now_ns() + 5 * kMs);
        if (!device_.capabilities().paces || !at_its_own_pace_)
            clock_.sleep_until(ticked_ns_ + kMs);
        ticked_ns_ = clock_.now_ns();
        const DeviceStatus status = device_.read(clock_.now_ns(), sample_);
        const DeviceStatus written = device_.write(clock_.now_ns(), wrench);
        if (status == DeviceStatus::gone || written == DeviceStatus::gone)
            return fail("{}: unplugged, or it does not answer any more",
                        device_.capabilities().name);
        if (stop_.stop_requested())
            return fail("{}: interrupted", device_.capabilities().name);
        return status;
    }
    double seconds() { return 1e-9 * static_cast<double>(clock_.now_ns()); }

    Result<void> home() {
        PALPATE_TRY(DeviceStatus status, tick({}));
        for (int i = 0; i < 20 && status == DeviceStatus::stale; ++i) {
            PALPATE_TRY(status, tick({}));
        }
        list_.was_homed = status == DeviceStatus::ok;
        if (list_.was_homed || !device_.capabilities().needs_homing)
            return {};
        PALPATE_TRY(device_.home());
        owner_.tell("Pull the grip all the way out, then push it in.");
        const double begin_s = seconds();
        while (status != DeviceStatus::ok) {
            if (seconds() - begin_s > options_.homing_s)
                return fail("{}: not homed within {:g} s", device_.capabilities().name,
                            options_.homing_s);
            PALPATE_TRY(status, tick({}));
        }
        list_.homed_s = seconds() - begin_s;
        return {};
    }

    Result<void> times() {
        Checklist::Times& times = list_.times;
        times.bins.assign(Checklist::kBins, 0);
        std::vector<double> all_ms;
        int64_t from_ns = clock_.now_ns();
        at_its_own_pace_ = true; // the next command goes out as soon as one is answered
        for (size_t i = 0; i < options_.exchanges; ++i) {
            PALPATE_TRY(const DeviceStatus status, tick({}));
            if (status != DeviceStatus::ok) {
                ++times.stale;
                continue;
            }
            const int64_t now_ns = clock_.now_ns();
            all_ms.push_back(kMs_per_ns * static_cast<double>(now_ns - from_ns));
            from_ns = now_ns;
            const auto bin = static_cast<size_t>(all_ms.back() / Checklist::kBin_ms);
            ++times.bins[std::min(bin, Checklist::kBins - 1)];
        }
        at_its_own_pace_ = false;
        times.count = all_ms.size();
        if (all_ms.empty())
            return fail("{}: none of {} exchanges gave a sample", device_.capabilities().name,
                        options_.exchanges);
        std::sort(all_ms.begin(), all_ms.end());
        const auto share = [&](double of) {
            return all_ms[static_cast<size_t>(of * static_cast<double>(all_ms.size() - 1))];
        };
        times.p50_ms = share(0.5);
        times.p95_ms = share(0.95);
        times.p99_ms = share(0.99);
        times.max_ms = all_ms.back();
        return {};
    }

    // Which bit is which light, where a device has lights that may be set.
    Result<void> lights() {
        auto* const falcon = dynamic_cast<FalconDevice*>(&device_);
        if (!falcon)
            return {};
        for (const int bit : {falcon::kGreen, falcon::kBlue, falcon::kRed}) {
            falcon->show(bit);
            for (int i = 0; i < 50; ++i)
                PALPATE_TRY(tick({}));
            list_.lights.emplace_back(bit, owner_.ask("Which light is on? (its colour)"));
        }
        falcon->show(-1);
        return {};
    }

    Result<Checklist::Places> places(double duration_s) {
        Checklist::Places seen{.low_mm = glm::dvec3(INFINITY), .high_mm = glm::dvec3(-INFINITY)};
        glm::dvec3 before_mm(NAN), step_mm(INFINITY);
        for (const double end_s = seconds() + duration_s; seconds() < end_s;) {
            PALPATE_TRY(const DeviceStatus status, tick({}));
            if (status != DeviceStatus::ok)
                continue;
            const glm::dvec3 now_mm = 1e3 * sample_.position_m;
            seen.low_mm = glm::min(seen.low_mm, now_mm);
            seen.high_mm = glm::max(seen.high_mm, now_mm);
            for (int axis = 0; axis < 3; ++axis)
                if (const double step = std::abs(now_mm[axis] - before_mm[axis]); step > 1e-9)
                    step_mm[axis] = std::min(step_mm[axis], step);
            before_mm = now_mm;
        }
        if (std::isinf(seen.low_mm.x))
            return fail("{}: no sample within {:g} s", device_.capabilities().name, duration_s);
        for (int axis = 0; axis < 3; ++axis)
            seen.step_mm[axis] = std::isfinite(step_mm[axis]) ? step_mm[axis] : 0.0;
        return seen;
    }

    Result<void> pushes() {
        owner_.tell(fmt::format("Hold the handle loosely in the middle: it pushes with {:g} N.",
                                Checklist::kForce_n));
        for (int axis = 0; axis < 3; ++axis)
            for (const double sign : {1.0, -1.0}) {
                glm::dvec3 direction(0.0);
                direction[axis] = sign;
                PALPATE_TRY(Checklist::Push pushed, push(direction));
                list_.pushes.push_back(std::move(pushed));
            }
        return {};
    }

    Result<Checklist::Push> push(glm::dvec3 direction) {
        for (const double end_s = seconds() + 0.3; seconds() < end_s;)
            PALPATE_TRY(tick({}));
        Checklist::Push push{.direction = direction};
        // A few steps of the encoders, or of a tremor, are no motion.
        const double still_mm = std::max(3e3 * device_.capabilities().resolution_m, 0.02);
        const glm::dvec3 begin_m = sample_.position_m;
        const double force_n = std::min(Checklist::kForce_n, device_.capabilities().max_force_n);
        const double begin_s = seconds();
        while (seconds() - begin_s < Checklist::kPush_s) {
            const Wrench wrench{.force_n =
                                    push.was_stopped ? glm::dvec3(0.0) : force_n * direction};
            PALPATE_TRY(const DeviceStatus status, tick(wrench));
            if (status != DeviceStatus::ok)
                continue;
            const glm::dvec3 way_mm = 1e3 * (sample_.position_m - begin_m);
            const double along_mm = glm::dot(way_mm, direction);
            push.moved_mm.push_back(along_mm);
            push.across_mm = std::max(push.across_mm, glm::length(way_mm - along_mm * direction));
            if (push.delay_ms < 0.0 && along_mm > still_mm)
                push.delay_ms = 1e3 * (seconds() - begin_s);
            push.was_stopped = push.was_stopped || glm::length(way_mm) > Checklist::kFarthest_mm ||
                               glm::length(sample_.velocity_m_per_s) > Checklist::kFastest_m_per_s;
        }
        PALPATE_TRY(tick({}));
        return push;
    }

    HapticDevice& device_;
    Clock& clock_;
    const ChecklistOptions& options_;
    const Owner& owner_;
    const std::stop_token& stop_;
    int64_t ticked_ns_ = 0;
    bool at_its_own_pace_ = false; // else a tick a millisecond
    DeviceSample sample_;
    Checklist list_;
};

} // namespace

Result<Checklist> run_checklist(HapticDevice& device, Clock& clock, const ChecklistOptions& options,
                                const Owner& owner, const std::stop_token& stop) {
    return Run(device, clock, options, owner, stop).all();
}

} // namespace palpate::haptics
