#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "engine/base/assert.h"

namespace palpate {

// A queue from one producing thread to one consuming thread that loses nothing it accepted, in
// order. push() and pop() are wait-free: neither repeats, locks, allocates nor frees, so either end
// may be the servo's.
//
// push() on a full ring returns false. Tool poses are pushed this way: after a refused pose, the
// sweep from the last accepted pose to the next still leaves no gap.
//
// Atomic is std::atomic but in the test that runs every interleaving.
template <class T, template <class> class Atomic = std::atomic>
class Ring {
    static_assert(std::is_trivially_destructible_v<T>); // a popped value leaves its bytes behind

 public:
    // Room for `capacity` values, rounded up to a power of two; at least 1.
    explicit Ring(size_t capacity) : values_(std::bit_ceil(capacity)), mask_(values_.size() - 1) {
        PALPATE_ASSERT_CMP(capacity, >, size_t{0});
    }
    Ring(const Ring&) = delete;
    Ring& operator=(const Ring&) = delete;

    size_t capacity() const noexcept { return values_.size(); }

    // The producer's thread. False: full, and nothing happened.
    bool push(const T& value) noexcept {
        const size_t at = pushed_.load(std::memory_order_relaxed);
        if (at - popped_seen_ == values_.size()) {
            popped_seen_ = popped_.load(std::memory_order_acquire);
            if (at - popped_seen_ == values_.size())
                return false;
        }
        values_[at & mask_] = value;
        pushed_.store(at + 1, std::memory_order_release);
        return true;
    }

    // The consumer's thread. False: empty, and `value` is as it was.
    bool pop(T& value) noexcept {
        const size_t at = popped_.load(std::memory_order_relaxed);
        if (at == pushed_seen_) {
            pushed_seen_ = pushed_.load(std::memory_order_acquire);
            if (at == pushed_seen_)
                return false;
        }
        value = values_[at & mask_];
        popped_.store(at + 1, std::memory_order_release);
        return true;
    }

    // Any thread; what other threads do meanwhile may or may not count.
    size_t size() const noexcept {
        const size_t popped = popped_.load(std::memory_order_acquire);
        const size_t pushed = pushed_.load(std::memory_order_acquire);
        return pushed - popped;
    }

    // For locking the ring's own memory in place before a real-time thread uses it.
    const std::vector<T>& storage() const noexcept { return values_; }

 private:
    std::vector<T> values_;
    size_t mask_;
    // Counts of all values ever, which wrap harmlessly; each end keeps the last it saw of the
    // other's, so that it reads the other's cache line only when it must.
    alignas(64) Atomic<size_t> pushed_{0};
    size_t popped_seen_ = 0; // the producer's
    alignas(64) Atomic<size_t> popped_{0};
    size_t pushed_seen_ = 0; // the consumer's
};

} // namespace palpate
