#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

// The work that waits in a cube of kBrickSide samples of a SeedForest. One thread at a time works
// on it; the tiles beside it do not run meanwhile, and only tell.
struct GrowTile {
    static constexpr uint32_t kNothing = ~uint32_t{0};

    std::vector<uint16_t> waiting; // places in the tile whose cost is known and not passed on
    uint32_t earliest = kNothing;  // the least of their costs
    // The least cost that the tile across a face offers: low and high x, y, z.
    std::array<uint32_t, 6> told{kNothing, kNothing, kNothing, kNothing, kNothing, kNothing};
    uint32_t passed_on = 0; // costs below this have been passed on since the update began
    uint64_t served = 0;    // samples, with repeats, since the update began
    bool has_cut = false;   // samples without a cost, whose neighbours may have one

    uint32_t next() const {
        uint32_t least = has_cut ? 0 : earliest;
        for (const uint32_t told_by : told)
            least = told_by < least ? told_by : least;
        return least;
    }
};

// A queue of 32-bit costs with places, the least first (a radix heap: Ahuja, Mehlhorn, Orlin &
// Tarjan 1990). What is pushed is at least what was popped last.
class RadixQueue {
 public:
    void clear() {
        for (auto& bucket : buckets_)
            bucket.clear();
        last_ = 0, size_ = 0;
    }
    bool empty() const { return size_ == 0; }
    size_t size() const { return size_; }
    void push(uint32_t cost, uint16_t place) {
        buckets_[bucket_of(cost)].push_back({cost, place});
        ++size_;
    }
    struct Entry {
        uint32_t cost;
        uint16_t place;
    };
    Entry pop() {
        if (buckets_[0].empty())
            refill();
        const Entry entry = buckets_[0].back();
        buckets_[0].pop_back();
        --size_;
        return entry;
    }

 private:
    size_t bucket_of(uint32_t cost) const {
        return cost == last_ ? 0 : size_t(32 - __builtin_clz(cost ^ last_));
    }
    void refill() {
        size_t first = 1;
        while (buckets_[first].empty())
            ++first;
        std::vector<Entry>& from = buckets_[first];
        last_ = from.front().cost;
        for (const Entry& entry : from)
            last_ = entry.cost < last_ ? entry.cost : last_;
        for (const Entry& entry : from)
            buckets_[bucket_of(entry.cost)].push_back(entry);
        from.clear();
    }
    std::array<std::vector<Entry>, 33> buckets_;
    uint32_t last_ = 0;
    size_t size_ = 0;
};

} // namespace palpate
