#include "engine/volume/brick_cache.h"

#include <algorithm>
#include <utility>

#include "engine/base/assert.h"

namespace palpate {

BrickCache::BrickCache(uint64_t count, uint64_t brick_bytes, uint64_t budget_bytes)
    : slots_(count),
      brick_bytes_(brick_bytes),
      capacity_(std::max<uint64_t>(1, budget_bytes / brick_bytes)) {
    PALPATE_ASSERT_CMP(count, <, uint64_t{kNone});
    stats_.budget_bytes = budget_bytes;
}

void BrickCache::unlink(uint32_t key) {
    Slot& slot = slots_[key];
    (slot.newer == kNone ? newest_ : slots_[slot.newer].older) = slot.older;
    (slot.older == kNone ? oldest_ : slots_[slot.older].newer) = slot.newer;
    slot.newer = slot.older = kNone;
}

void BrickCache::link_newest(uint32_t key) {
    Slot& slot = slots_[key];
    slot.newer = kNone;
    slot.older = newest_;
    (newest_ == kNone ? oldest_ : slots_[newest_].newer) = key;
    newest_ = key;
}

SamplesPtr BrickCache::get(uint64_t number, const std::function<SamplesPtr()>& load) {
    PALPATE_ASSERT_CMP(number, <, slots_.size());
    const auto key = static_cast<uint32_t>(number);
    {
        const std::lock_guard lock(mutex_);
        if (slots_[key].samples) {
            ++stats_.hits;
            if (newest_ != key) {
                unlink(key);
                link_newest(key);
            }
            return slots_[key].samples;
        }
        ++stats_.misses;
    }
    SamplesPtr loaded = load();
    SamplesPtr dropped; // freed outside the lock
    const std::lock_guard lock(mutex_);
    if (slots_[key].samples)
        return slots_[key].samples;
    if (held_ == capacity_) {
        const uint32_t last = oldest_;
        dropped = std::exchange(slots_[last].samples, nullptr);
        unlink(last);
        ++stats_.dropped;
        --held_;
    }
    slots_[key].samples = loaded;
    link_newest(key);
    ++held_;
    return loaded;
}

BrickCache::Stats BrickCache::stats() const {
    const std::lock_guard lock(mutex_);
    Stats stats = stats_;
    stats.held_bytes = held_ * brick_bytes_;
    return stats;
}

} // namespace palpate
