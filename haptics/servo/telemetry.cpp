#include "haptics/servo/telemetry.h"

#include <sys/resource.h>

#include "haptics/safety/chain.h"

namespace palpate::haptics {

namespace {

Json percentiles(const Histogram& histogram, double unit) {
    const auto at = [&](double share) {
        return static_cast<double>(histogram.percentile(share)) / unit;
    };
    return {{"p50", at(0.5)},
            {"p99", at(0.99)},
            {"p999", at(0.999)},
            {"p9999", at(0.9999)},
            {"max", static_cast<double>(histogram.max()) / unit}};
}

} // namespace

Json telemetry_json(const Telemetry& t) {
    const auto count = [](const auto& n) { return n.load(); };
    return {{"ticks", count(t.ticks)},
            {"skipped", count(t.skipped)},
            {"poses_refused", count(t.poses_refused)},
            {"watchdog_trips", count(t.trips)},
            {"faults", fault_text(t.faults)},
            {"wake_us", percentiles(t.wake_ns, 1e3)},
            {"cpu_us", percentiles(t.cpu_ns, 1e3)},
            {"whole_us", percentiles(t.whole_ns, 1e3)},
            {"versions_behind", percentiles(t.versions_behind, 1)},
            {"iterations", percentiles(t.iterations, 1)}};
}

ThreadUse thread_use() noexcept {
    rusage use{};
    getrusage(RUSAGE_THREAD, &use);
    return {use.ru_minflt + use.ru_majflt, use.ru_nivcsw};
}

} // namespace palpate::haptics
