#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <vector>

#include "engine/volume/brick_source.h"

namespace palpate {

// The samples of bricks numbered 0 .. count - 1, up to a number of bytes; those used longest ago
// are dropped first. Samples that a reader holds stay alive, dropped or not. Safe from any number
// of threads; two that miss the same brick at once both load it, and share the first.
class BrickCache {
 public:
    // Each brick takes brick_bytes. At least one brick is kept, whatever the budget.
    BrickCache(uint64_t count, uint64_t brick_bytes, uint64_t budget_bytes);

    // The brick's samples, from load() if they are not cached. Exceptions of load() pass through.
    SamplesPtr get(uint64_t key, const std::function<SamplesPtr()>& load);

    struct Stats {
        uint64_t hits = 0, misses = 0, dropped = 0;
        uint64_t held_bytes = 0, budget_bytes = 0;
    };
    Stats stats() const;

 private:
    static constexpr uint32_t kNone = ~0u;
    struct Slot { // of the list of what is held, newest first
        SamplesPtr samples;
        uint32_t newer = kNone, older = kNone;
    };
    void unlink(uint32_t key);
    void link_newest(uint32_t key);

    mutable std::mutex mutex_;
    std::vector<Slot> slots_; // by key
    uint32_t newest_ = kNone, oldest_ = kNone;
    uint64_t brick_bytes_, held_ = 0, capacity_;
    Stats stats_;
};

} // namespace palpate
