#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

namespace palpate {

// Sleep in the kernel for Wake; only the test that runs every interleaving has another.
struct Futex {
    using Clock = std::chrono::steady_clock;
    // Returns when `word` is no longer `value`, when it was woken, at `until`, or for no reason.
    // False: `until` has come.
    static bool sleep(std::atomic<uint32_t>& word, uint32_t value,
                      std::optional<Clock::time_point> until) noexcept;
    static void wake(std::atomic<uint32_t>& word) noexcept;
};

// Lets one thread sleep until another has news for it.
//
//     publish(...); wake.wake();                                // the publisher's thread
//     while (!stop.stop_requested()) { look(); wake.wait(stop); } // the follower's
//
// No wake is lost: one that comes while the follower is awake ends its next wait at once. Several
// count as one. All that was written before wake() is seen after the wait that it ended.
//
// Method: one word says whether the follower sleeps. Both ends change it by read-modify-write
// operations alone, which have one order: a wake comes before the follower clears the word, and its
// news are seen in the look that follows, or after that, and the wait ends.
template <template <class> class Atomic = std::atomic, class Sleep = Futex>
class BasicWake {
 public:
    using Clock = std::chrono::steady_clock;

    BasicWake() = default;
    BasicWake(const BasicWake&) = delete;
    BasicWake& operator=(const BasicWake&) = delete;

    // Any thread. It neither locks nor allocates, and makes a system call only where the follower
    // sleeps.
    void wake() noexcept {
        if (state_.exchange(kWoken, std::memory_order_acq_rel) == kAsleep)
            Sleep::wake(state_);
    }

    // The follower's thread. False: `until` came first.
    bool wait(std::optional<Clock::time_point> until = std::nullopt) noexcept {
        uint32_t state = kNothing;
        if (state_.compare_exchange_strong(state, kAsleep, std::memory_order_acq_rel))
            while (state_.load(std::memory_order_relaxed) == kAsleep &&
                   Sleep::sleep(state_, kAsleep, until)) {
            }
        return state_.exchange(kNothing, std::memory_order_acq_rel) == kWoken;
    }
    // Ends, too, when a stop is requested.
    bool wait(const std::stop_token& stop, std::optional<Clock::time_point> until = std::nullopt) {
        const std::stop_callback stopped(stop, [this] { wake(); });
        return wait(until);
    }

 private:
    static constexpr uint32_t kNothing = 0, kWoken = 1, kAsleep = 2;
    Atomic<uint32_t> state_{kNothing};
};

using Wake = BasicWake<>;

// Wakes all that follow one publisher.
class Followers {
 public:
    // Ends what add() began; must not outlive the followers.
    class Place {
     public:
        Place(Place&& other) noexcept
            : of_(std::exchange(other.of_, nullptr)), wake_(other.wake_) {}
        Place& operator=(Place&&) = delete;
        ~Place() {
            if (of_)
                of_->remove(wake_);
        }

     private:
        friend class Followers;
        Place(Followers& of, Wake& wake) : of_(&of), wake_(&wake) {}
        Followers* of_;
        Wake* wake_;
    };

    // Any thread but a servo's: each takes a lock for a moment.
    [[nodiscard]] Place add(Wake& wake) {
        const std::scoped_lock held(mutex_);
        wakes_.push_back(&wake);
        return Place(*this, wake);
    }
    void wake() {
        const std::scoped_lock held(mutex_);
        for (Wake* wake : wakes_)
            wake->wake();
    }

 private:
    void remove(Wake* wake) {
        const std::scoped_lock held(mutex_);
        wakes_.erase(std::find(wakes_.begin(), wakes_.end(), wake));
    }
    std::mutex mutex_;
    std::vector<Wake*> wakes_;
};

} // namespace palpate
