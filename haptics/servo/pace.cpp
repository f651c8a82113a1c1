#include "haptics/servo/pace.h"

#include <algorithm>

namespace palpate::haptics {

Pace::Pace(HapticDevice& device, double rate_hz, Clock& clock) noexcept
    : device_(device),
      clock_(clock),
      period_ns_(static_cast<int64_t>(1e9 / rate_hz)),
      by_device_(device.capabilities().paces),
      last_ns_(clock.now_ns()) {}

Pace::Beat Pace::next() noexcept {
    if (by_device_)
        return next_by_device();
    int64_t due_ns = last_ns_ + period_ns_, missed = 0;
    if (const int64_t late_ns = clock_.now_ns() - due_ns; late_ns > 0) {
        missed = late_ns / period_ns_;
        due_ns += missed * period_ns_;
    }
    clock_.sleep_until(last_ns_ = due_ns);
    return {.now_ns = clock_.now_ns(), .due_ns = due_ns, .skipped = missed};
}

Pace::Beat Pace::next_by_device() noexcept {
    const int64_t patience_ns = std::min(period_ns_, kPatience_ns);
    const int64_t due_ns = last_ns_ + period_ns_;
    clock_.sleep_until(last_ns_ + patience_ns / 2);
    const int64_t until_ns = silent_ ? last_ns_ + patience_ns : due_ns + patience_ns;
    silent_ = !device_.wait(until_ns);
    if (silent_)
        clock_.sleep_until(until_ns);
    const int64_t now_ns = clock_.now_ns();
    const int64_t late_ns = now_ns - due_ns;
    last_ns_ = now_ns;
    return {.now_ns = now_ns,
            .due_ns = std::min(due_ns, now_ns),
            .skipped = std::max<int64_t>(0, late_ns / period_ns_)};
}

} // namespace palpate::haptics
