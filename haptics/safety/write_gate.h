#pragma once

#include <atomic>
#include <cstdint>

namespace palpate::haptics {

// The right to command force belongs to the servo until a watchdog revokes it because no write
// ended for too long. The servo must then reopen the gate before it writes, so that no force
// computed before a stall is sent after it.
//
//     servo's thread                              watchdog's thread
//     if (gate.reopen(now))                       if (gate.close(now, limit))
//         ... start anew, without force ...           device.halt(now);
//     ... work out a force ...
//     if (gate.begin_write()) {
//         device.write(now, force);
//         if (!gate.end_write(now))
//             device.halt(now);
//     }
//
// A write and the check of the gate before it are two steps, so a servo stopped between them may
// still send its old force. Both sides then take it back: the servo, because end_write() reports
// that the gate was closed meanwhile, and the watchdog, because close() stays true until the gate
// is open. tests/unit/haptics_safety/write_gate_test.cpp runs all interleavings.
//
// All is wait-free and one word: the time of the last write that ended, whose two lowest bits are
// the state. Times are of one clock, in ns; 0 is "never", and before the first write ends the
// watchdog has nothing to do. Atomic is std::atomic but in that test.
template <template <class> class Atomic = std::atomic>
class BasicWriteGate {
 public:
    // The servo's: true where the watchdog had closed the gate, which is open now.
    bool reopen(int64_t now_ns) noexcept {
        if (state_of(word_.load(std::memory_order_acquire)) != kClosed)
            return false;
        store(at(now_ns, kOpen)); // a closed gate is nobody else's to change
        return true;
    }
    // False: closed; nothing may be written.
    bool begin_write() noexcept {
        begun_ = word_.load(std::memory_order_acquire);
        return state_of(begun_) == kOpen && change(begun_, begun_ | kWriting);
    }
    // False: the gate was closed during the write, and the force must be taken back.
    bool end_write(int64_t now_ns) noexcept { return change(begun_ | kWriting, at(now_ns, kOpen)); }

    // The watchdog's: true where the device is to be halted now. `limit_ns` without a write close
    // the gate, also while one hangs.
    bool close(int64_t now_ns, int64_t limit_ns) noexcept {
        const int64_t word = word_.load(std::memory_order_acquire);
        if (state_of(word) == kClosed)
            return true;
        const int64_t last_ns = word & ~kStates;
        return last_ns != 0 && now_ns - last_ns > limit_ns && change(word, last_ns | kClosed);
    }
    // When the last write ended, to 4 ns; 0: never.
    int64_t last_ns() const noexcept { return word_.load(std::memory_order_acquire) & ~kStates; }

 private:
    static constexpr int64_t kOpen = 0, kWriting = 1, kClosed = 2, kStates = 3;
    static int64_t at(int64_t now_ns, int64_t state) { return (now_ns & ~kStates) | state; }
    static int64_t state_of(int64_t word) { return word & kStates; }
    bool change(int64_t from, int64_t to) noexcept {
        return word_.compare_exchange_strong(from, to, std::memory_order_acq_rel);
    }
    void store(int64_t word) noexcept { word_.store(word, std::memory_order_release); }

    Atomic<int64_t> word_{0};
    int64_t begun_ = 0; // the servo's own
};
using WriteGate = BasicWriteGate<>;

} // namespace palpate::haptics
