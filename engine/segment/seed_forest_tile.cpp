#include "engine/segment/seed_forest_tile.h"

#include <bitset>

#include "engine/segment/seed_forest.h"

namespace palpate {

// One tile of a forest, worked on up to a cost.
class GrowTileRun {
 public:
    GrowTileRun(SeedForest& forest, size_t number, uint32_t end)
        : forest_(forest),
          tile_(forest.tiles_[number]),
          first_(forest.position_of(number) * kBrickSide),
          valid_(glm::min(glm::uvec3(kBrickSide), forest.size_ - first_)),
          end_(end) {}

    void go() {
        queue_.clear();
        if (tile_.has_cut)
            take_back();
        for (int face = 0; face < 6; ++face)
            listen(face);
        wake();
        while (!queue_.empty()) {
            const RadixQueue::Entry entry = queue_.pop();
            const glm::uvec3 local = local_of(entry.place);
            const size_t sample = forest_.at(first_ + local);
            // Others are entries that a lower cost has overtaken.
            if (forest_.costs_[sample] != entry.cost || !queued_[entry.place])
                continue;
            queued_[entry.place] = false;
            pass_on(sample, local);
        }
        tile_.passed_on = end_;
    }

 private:
    static glm::uvec3 local_of(uint32_t place) {
        return {place % kBrickSide, place / kBrickSide % kBrickSide,
                place / (kBrickSide * kBrickSide)};
    }

    void add(uint32_t place, uint32_t cost) {
        if (cost < end_) {
            queued_[place] = true;
            queue_.push(cost, uint16_t(place));
            return;
        }
        tile_.waiting.push_back(uint16_t(place));
        tile_.earliest = std::min(tile_.earliest, cost);
    }

    // A neighbour offers a sample of this tile its label, at a cost.
    void offer(size_t sample, glm::uvec3 local, uint32_t cost, uint8_t label) {
        uint32_t& known = forest_.costs_[sample];
        uint8_t& owner = forest_.labels_[sample];
        if (cost > known || cost == SeedForest::kNever)
            return;
        if (cost < known) {
            known = cost;
            owner = label;
        } else {
            if (owner == label)
                return;
            // The neighbour may have had the sample's label before: then that one counts no more.
            const uint8_t least = forest_.from_neighbors(sample, first_ + local).label;
            if (owner == least)
                return;
            owner = least;
        }
        add(offset_in_brick(local), cost);
    }

    // Samples without a cost get one from neighbours that have.
    void take_back() {
        tile_.has_cut = false;
        for_each_local(glm::uvec3(0), valid_, [&](glm::uvec3 local) {
            const size_t sample = forest_.at(first_ + local);
            if (forest_.costs_[sample] != SeedForest::kNever)
                return;
            const auto reached = forest_.from_neighbors(sample, first_ + local);
            offer(sample, local, reached.cost, reached.label);
        });
    }

    // Takes what the tile across a face offers.
    void listen(int face) {
        if (tile_.told[size_t(face)] >= end_)
            return;
        tile_.told[size_t(face)] = GrowTile::kNothing;
        const int axis = face / 2;
        glm::uvec3 low(0), high = valid_;
        low[axis] = face % 2 == 0 ? 0 : kBrickSide - 1;
        high[axis] = low[axis] + 1;
        glm::uvec3 across(0);
        across[axis] = face % 2 == 0 ? ~0u : 1u;
        for_each_local(low, high, [&](glm::uvec3 local) {
            const size_t sample = forest_.at(first_ + local);
            const size_t from = forest_.at(first_ + local + across);
            // Later ones will tell once their turn has come.
            if (forest_.costs_[from] < end_)
                offer(sample, local,
                      forest_.step(forest_.costs_[from], forest_.heights_[sample], axis),
                      forest_.labels_[from]);
        });
    }

    // Queues the samples that have waited for the costs up to the end.
    void wake() {
        if (tile_.earliest >= end_)
            return;
        std::vector<uint16_t> waited;
        waited.swap(tile_.waiting);
        tile_.earliest = GrowTile::kNothing;
        for (const uint16_t place : waited) {
            const uint32_t cost = forest_.costs_[forest_.at(first_ + local_of(place))];
            if (cost >= tile_.passed_on && cost != SeedForest::kNever)
                add(place, cost);
        }
    }

    void pass_on(size_t sample, glm::uvec3 local) {
        ++tile_.served;
        const uint32_t cost = forest_.costs_[sample];
        const uint8_t label = forest_.labels_[sample];
        const size_t strides[] = {1, forest_.size_.x, size_t{forest_.size_.x} * forest_.size_.y};
        for (int axis = 0; axis < 3; ++axis) {
            const glm::uvec3 index = first_ + local;
            if (index[axis] > 0)
                tell(sample - strides[axis], local, axis, ~0u, cost, label);
            if (index[axis] + 1 < forest_.size_[axis])
                tell(sample + strides[axis], local, axis, 1, cost, label);
        }
    }

    void tell(size_t to, glm::uvec3 local, int axis, uint32_t by, uint32_t from, uint8_t label) {
        const uint32_t cost = forest_.step(from, forest_.heights_[to], axis);
        local[axis] += by;
        if (local[axis] < kBrickSide) {
            offer(to, local, cost, label);
            return;
        }
        const uint32_t known = forest_.costs_[to];
        if (cost > known || cost == SeedForest::kNever ||
            (cost == known && forest_.labels_[to] == label))
            return;
        // From there, this tile is across the face on the other side.
        uint32_t& told = forest_.tile_at(first_ + local).told[size_t(2 * axis + (by == 1 ? 0 : 1))];
        told = std::min(told, cost);
    }

    template <class Visit>
    static void for_each_local(glm::uvec3 low, glm::uvec3 high, const Visit& visit) {
        for (uint32_t z = low.z; z < high.z; ++z)
            for (uint32_t y = low.y; y < high.y; ++y)
                for (uint32_t x = low.x; x < high.x; ++x)
                    visit({x, y, z});
    }

    static thread_local RadixQueue queue_;
    static thread_local std::bitset<kBrickSamples> queued_; // none between runs

    SeedForest& forest_;
    GrowTile& tile_;
    glm::uvec3 first_, valid_;
    uint32_t end_;
};

thread_local RadixQueue GrowTileRun::queue_;
thread_local std::bitset<kBrickSamples> GrowTileRun::queued_;

void SeedForest::run(size_t number, uint32_t end) {
    GrowTileRun(*this, number, end).go();
}

} // namespace palpate
