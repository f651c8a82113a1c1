#include "engine/base/wake.h"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <ctime>

namespace palpate {

static_assert(sizeof(std::atomic<uint32_t>) == sizeof(uint32_t)); // as futex(2) wants it

// The steady clock is CLOCK_MONOTONIC, and FUTEX_WAIT_BITSET takes a time of that clock.
bool Futex::sleep(std::atomic<uint32_t>& word, uint32_t value,
                  std::optional<Clock::time_point> until) noexcept {
    timespec time{};
    if (until) {
        constexpr int64_t kSecond_ns = 1'000'000'000;
        const int64_t ns =
            std::max<int64_t>(0, std::chrono::nanoseconds(until->time_since_epoch()).count());
        time = {ns / kSecond_ns, ns % kSecond_ns};
    }
    const long result = syscall(SYS_futex, &word, FUTEX_WAIT_BITSET_PRIVATE, value,
                                until ? &time : nullptr, nullptr, FUTEX_BITSET_MATCH_ANY);
    return result == 0 || errno != ETIMEDOUT;
}

void Futex::wake(std::atomic<uint32_t>& word) noexcept {
    syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

} // namespace palpate
