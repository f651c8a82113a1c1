#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "engine/base/assert.h"

namespace palpate {

// Passes the newest immutable value from one writer to a few readers.
//
//     Mailbox<Snapshot> box(std::make_unique<Snapshot>(first));
//     box.publish(std::make_unique<Snapshot>(next));      // the writer's thread
//     auto reader = box.add_reader();                     // before a reader's thread starts
//     { const auto pin = reader.pin(); use(*pin); }       // a reader's thread
//
// Reading is wait-free: pin() is two loads and one store, and neither repeats, locks, allocates nor
// frees. A pinned value stays whole until the pin ends, however much is published meanwhile, and is
// at least as new as what publish() had returned for when pin() began. The writer frees a replaced
// value in publish() and collect(), once no reader can hold it. A reader that never ends its pin
// makes the writer keep all later values: waiting() counts them.
//
// Method: an epoch counts the values. A reader writes the epoch to its slot, then takes the root;
// the writer replaces the root, raises the epoch, then reads the slots. A value replaced when the
// epoch became e is free once every slot is empty or holds e or more. The store to the slot must
// come before the load of the root in the one order of all sequentially consistent operations;
// weaker, the writer may read the slot between them, find it empty, and free the value that the
// reader is about to take (K. Fraser, Practical lock freedom, 2004, section 5.2.3).
//
// Atomic is std::atomic but in the test that runs every interleaving.
template <class T, template <class> class Atomic = std::atomic>
class Mailbox {
    struct Slot;

 public:
    static constexpr size_t kMaxReaders = 16;

    explicit Mailbox(std::unique_ptr<const T> first) : latest_(std::move(first)) {
        PALPATE_ASSERT(latest_ != nullptr);
        root_.store(latest_.get(), std::memory_order_seq_cst);
    }
    // No pin may be alive.
    ~Mailbox() = default;
    Mailbox(const Mailbox&) = delete;
    Mailbox& operator=(const Mailbox&) = delete;

    class Reader;

    // A value that stays until this ends. At most one per reader at a time; it lives on the
    // reader's thread.
    class Pin {
     public:
        ~Pin() { slot_.store(0, std::memory_order_release); }
        Pin(const Pin&) = delete;
        Pin& operator=(const Pin&) = delete;
        const T& operator*() const noexcept { return *value_; }
        const T* operator->() const noexcept { return value_; }
        // epoch() when the pin began; the pinned value is that one or newer.
        uint64_t epoch() const noexcept { return epoch_; }

     private:
        friend class Reader;
        Pin(Atomic<uint64_t>& slot, const T* value, uint64_t epoch) noexcept
            : slot_(slot), value_(value), epoch_(epoch) {}
        Atomic<uint64_t>& slot_;
        const T* value_;
        uint64_t epoch_;
    };

    // For one thread at a time; must not outlive the mailbox. Its end gives the place back: no pin
    // of it may be alive.
    class Reader {
     public:
        Reader(Reader&& other) noexcept
            : box_(other.box_), slot_(std::exchange(other.slot_, nullptr)) {}
        Reader& operator=(Reader&&) = delete;
        ~Reader() {
            if (slot_)
                slot_->taken.store(false, std::memory_order_release);
        }
        Pin pin() noexcept {
            const uint64_t epoch = box_->epoch_.load(std::memory_order_acquire);
            slot_->epoch.store(epoch, std::memory_order_seq_cst);
            return Pin(slot_->epoch, box_->root_.load(std::memory_order_seq_cst), epoch);
        }

     private:
        friend class Mailbox;
        Reader(Mailbox& box, Slot& slot) noexcept : box_(&box), slot_(&slot) {}
        Mailbox* box_;
        Slot* slot_;
    };

    // Any thread: 1, and 1 more for each publish(). A reader is behind by this less its pin's.
    uint64_t epoch() const noexcept { return epoch_.load(std::memory_order_acquire); }

    // From any thread; at most kMaxReaders at a time.
    Reader add_reader() {
        size_t index = 0;
        for (bool taken = false;
             index < kMaxReaders &&
             !slots_[index].taken.compare_exchange_strong(taken, true, std::memory_order_acq_rel);
             taken = false)
            ++index;
        PALPATE_ASSERT_CMP(index, <, kMaxReaders);
        size_t used = readers_.load(std::memory_order_seq_cst);
        while (used <= index &&
               !readers_.compare_exchange_strong(used, index + 1, std::memory_order_seq_cst)) {
        }
        return Reader(*this, slots_[index]);
    }

    // The writer's thread. `next` is never null.
    void publish(std::unique_ptr<const T> next) {
        PALPATE_ASSERT(next != nullptr);
        replaced_.push_back({nullptr, now_ + 1}); // first, so that nothing is lost if it throws
        root_.store(next.get(), std::memory_order_seq_cst);
        epoch_.store(++now_, std::memory_order_release);
        replaced_.back().value = std::exchange(latest_, std::move(next));
        collect();
    }

    // The writer's thread: frees what no reader can hold any more.
    void collect() {
        uint64_t oldest = now_;
        const size_t used = readers_.load(std::memory_order_seq_cst);
        for (size_t i = 0; i < used; ++i) {
            const uint64_t began = slots_[i].epoch.load(std::memory_order_seq_cst);
            if (began != 0 && began < oldest)
                oldest = began;
        }
        size_t free = 0;
        while (free < replaced_.size() && replaced_[free].until <= oldest)
            ++free;
        replaced_.erase(replaced_.begin(), replaced_.begin() + static_cast<ptrdiff_t>(free));
    }

    // The writer's thread.
    size_t waiting() const { return replaced_.size(); } // replaced, and perhaps still read
    const T& latest() const { return *latest_; }        // until the next publish()

 private:
    struct alignas(64) Slot {      // a cache line each: readers do not disturb one another
        Atomic<uint64_t> epoch{0}; // 0: no pin
        Atomic<bool> taken{false}; // by a reader
    };
    struct Replaced {
        std::unique_ptr<const T> value;
        uint64_t until; // the epoch at which it was replaced
    };

    alignas(64) Atomic<const T*> root_{nullptr};
    Atomic<uint64_t> epoch_{1};
    Atomic<size_t> readers_{0}; // slots that ever had one: those that the writer looks into
    std::array<Slot, kMaxReaders> slots_;

    // The writer's own.
    uint64_t now_ = 1;
    std::unique_ptr<const T> latest_;
    std::vector<Replaced> replaced_; // oldest first
};

} // namespace palpate
