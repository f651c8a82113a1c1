#pragma once

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "engine/segment/task.h"

namespace palpate {

struct LiveWireOptions {
    // Weights of both terms of the cost, >= 0 and not both 0 (Mortensen & Barrett, "Interactive
    // segmentation with intelligent scissors", 1998, has 0.14 and 0.43).
    double gradient_weight = 0.5;
    double crossing_weight = 0.5;
    // The gradient whose cost is least, in value units per mm; 0: the 99th percentile of the
    // region, of those of at most 64 slices that are evenly spread.
    double full_gradient = 0.0;
};

// How dear it is for a path to pass each sample of a box, 1 .. 255, x fastest.
//
// A sample's cost is low where an edge is: with g the length of the central difference gradient,
// per mm, and G = full_gradient, the first term is 1 - min(g / G, 1); the second is 0 where the
// Laplacian changes its sign to a neighbour that shares a face and is farther from 0, else 1. Their
// weighted mean, 0 .. 1, becomes 1 .. 255. Samples without data, and beside one, cost 255. Memory:
// a byte a sample, and a few slices a thread.
struct LiveWireRegion {
    glm::uvec3 first{0}; // of the box, in the volume
    glm::uvec3 size{0};
    glm::dmat3 mm_from_step{1.0}; // the grid's axes
    std::vector<uint8_t> cost;
};
// A slice is a box of one sample in one direction: the gradient is then that within the slice.
// Refused: a box that is empty or reaches beyond the volume, weights out of range.
Result<LiveWireRegion> live_wire_region(const Volume& volume, glm::uvec3 first, glm::uvec3 size,
                                        const LiveWireOptions& options, const Task& task);

// Paths of least cost from an anchor, over all 26 neighbours (8 in a slice). A step costs its
// length in mm times the mean cost of its ends, as a whole number: the length in 1/16 of the
// shortest step, times the sum of both costs. So sums are exact, and no path depends on the order
// of work.
//
// Dijkstra's method with buckets as wide as the least step (Dial 1969; Falcao & Udupa 2000): a
// bucket is final when its turn comes. It goes on from both ends, on the side whose next bucket has
// less in it, until no way that is not known yet can be cheaper (Pohl 1971): where the cursor has
// left the edge, what is as cheap all about the anchor's side need not be searched. What is known
// from the anchor stays while the anchor stays; so a second path costs what is new of it. Memory:
// the costs, and 4 bytes a sample near those that were reached from either end (pages of the
// system: a new anchor and a large box cost nothing of themselves). For one thread.
class LiveWire {
 public:
    explicit LiveWire(LiveWireRegion region);
    const LiveWireRegion& region() const { return region_; }

    // Index in the box, below its size.
    void set_anchor(glm::uvec3 at);
    // From the anchor to `to`, both included. Of several paths of least cost, the one whose steps
    // back from `to` come first in the order of the neighbours' memory.
    std::vector<glm::uvec3> path(glm::uvec3 to);
    // The cost of the path to a sample, in units of a step's cost; after path(to).
    uint32_t cost_of(glm::uvec3 to) const;

    struct Step {
        glm::ivec3 by;
        ptrdiff_t offset;
        uint32_t length; // in 1/16 of the shortest step
    };
    const std::vector<Step>& steps() const { return steps_; }

 private:
    size_t number(glm::uvec3 at) const {
        return at.x + region_.size.x * (at.y + size_t{region_.size.y} * at.z);
    }
    uint32_t step_cost(const Step& step, size_t from, size_t to) const {
        return step.length * (uint32_t{region_.cost[from]} + region_.cost[to]);
    }
    // The known costs from one end.
    struct Front {
        std::vector<std::vector<uint32_t>> buckets; // a ring
        uint64_t bucket = 0;                        // whose turn it is; those before are final
        size_t waiting = 0;                         // entries in the ring
        // The largest number less the cost from the end: 0 where none is known. A box of zeros
        // takes no memory until it is written.
        std::unique_ptr<uint32_t[], void (*)(void*)> left{nullptr, std::free};

        size_t next() const { return buckets[bucket % buckets.size()].size(); }
        uint64_t cost(size_t at) const { return UINT32_MAX - left[at]; }
    };
    bool is_final(const Front& front, size_t at) const {
        return front.left[at] != 0 && front.cost(at) / width_ < front.bucket;
    }
    void begin(Front& front, size_t at);
    template <class Reach>
    void settle_next_bucket(Front& front, const Reach& reach);
    uint64_t search_from(size_t to);
    void forget_back();
    size_t step_before(size_t at) const;
    std::vector<size_t> way_to_known(size_t to, uint64_t cost) const;
    template <class Visit>
    void for_each_neighbour(size_t number, const Visit& visit) const;

    LiveWireRegion region_;
    std::vector<Step> steps_;
    uint32_t width_ = 1;            // of a bucket
    Front from_anchor_, back_;      // back_ is of one cursor
    std::vector<uint32_t> reached_; // by back_, to be forgotten
    size_t to_ = 0;                 // of the last path, and its cost
    uint32_t cost_to_ = 0;
};

} // namespace palpate
