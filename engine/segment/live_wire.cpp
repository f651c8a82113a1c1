#include "engine/segment/live_wire.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <unordered_set>

#include "engine/base/assert.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

constexpr double kLengthUnits = 16.0; // of the shortest step
constexpr double kFullShare = 0.99;   // of samples, whose gradient is not the fullest
constexpr uint32_t kSlab = 16;        // slices that are worked on at once
constexpr uint32_t kProbes = 64;      // slices that tell of the gradient

size_t count_of(glm::uvec3 size) {
    return size_t{size.x} * size.y * size.z;
}

// Gradient length per mm and Laplacian of the samples of a box; NaN beside no data.
struct WireDerivatives {
    std::vector<float> gradient, laplacian;
};

// `flat` axes are left out: those of a slice, which is seen by itself.
WireDerivatives derive(const Volume& volume, glm::ivec3 first, glm::uvec3 size, glm::bvec3 flat) {
    const glm::uvec3 wide = size + 2u;
    std::vector<float> box(count_of(wide));
    read_box(volume, first - 1, glm::ivec3(wide), packed(wide), box.data());
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const size_t stride[] = {1, wide.x, size_t{wide.x} * wide.y};
    glm::dvec3 per_square;
    for (int axis = 0; axis < 3; ++axis)
        per_square[axis] = flat[axis] ? 0.0 : 1.0 / (spacing[axis] * spacing[axis]);
    const glm::dmat3 world = // of a gradient by the index
        glm::transpose(glm::inverse(glm::dmat3(volume.grid().world_from_index)));
    WireDerivatives out{std::vector<float>(count_of(size)), std::vector<float>(count_of(size))};
    size_t to = 0;
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x, ++to) {
                const float* const at =
                    &box[x + 1 + size_t{wide.x} * (y + 1 + size_t{wide.y} * (z + 1))];
                const double here = double{*at};
                glm::dvec3 slope(0.0);
                double laplacian = 0.0;
                for (int axis = 0; axis < 3; ++axis) {
                    const double low = double{*(at - stride[axis])};
                    const double high = double{at[stride[axis]]};
                    if (!flat[axis])
                        slope[axis] = 0.5 * (high - low);
                    if (!flat[axis])
                        laplacian += (high - 2.0 * here + low) * per_square[axis];
                }
                out.gradient[to] = float(glm::length(world * slope));
                out.laplacian[to] = float(laplacian);
            }
    return out;
}

// Whether the Laplacian changes its sign to a neighbour that is farther from 0.
bool is_crossing(const std::vector<float>& laplacian, size_t at, glm::uvec3 p, glm::uvec3 size) {
    const size_t stride[] = {1, size.x, size_t{size.x} * size.y};
    const float own = laplacian[at];
    const auto crosses = [&](float other) {
        return (own > 0.0f) != (other > 0.0f) && std::abs(own) <= std::abs(other);
    };
    for (int axis = 0; axis < 3; ++axis)
        if ((p[axis] > 0 && crosses(laplacian[at - stride[axis]])) ||
            (p[axis] + 1 < size[axis] && crosses(laplacian[at + stride[axis]])))
            return true;
    return false;
}

double full_gradient_of(std::vector<float> gradient) {
    std::erase_if(gradient, [](float g) { return std::isnan(g); });
    if (gradient.empty())
        return 1.0;
    const auto at = gradient.begin() + ptrdiff_t(kFullShare * double(gradient.size() - 1));
    std::nth_element(gradient.begin(), at, gradient.end());
    if (*at > 0.0f)
        return double{*at};
    const float most = *std::max_element(gradient.begin(), gradient.end());
    return most > 0.0f ? double{most} : 1.0;
}

} // namespace

Result<LiveWireRegion> live_wire_region(const Volume& volume, glm::uvec3 first, glm::uvec3 size,
                                        const LiveWireOptions& options, const Task& task) {
    const glm::uvec3 whole = volume.size();
    for (int axis = 0; axis < 3; ++axis)
        if (size[axis] == 0 || first[axis] >= whole[axis] || size[axis] > whole[axis] - first[axis])
            return fail(
                "live-wire: expected a box within {} x {} x {} samples, found {} x {} x {} "
                "at {}, {}, {}",
                whole.x, whole.y, whole.z, size.x, size.y, size.z, first.x, first.y, first.z);
    const double weights = options.gradient_weight + options.crossing_weight;
    if (!(options.gradient_weight >= 0.0 && options.crossing_weight >= 0.0 && weights > 0.0 &&
          std::isfinite(weights)))
        return fail("live-wire: expected weights of 0 or more, not both 0, found {:g} and {:g}",
                    options.gradient_weight, options.crossing_weight);
    LiveWireRegion out{first, size, glm::dmat3(volume.grid().world_from_index),
                       std::vector<uint8_t>(count_of(size))};
    const size_t plane = size_t{size.x} * size.y;
    const glm::bvec3 flat = glm::equal(size, glm::uvec3(1));
    double full = options.full_gradient;
    if (!(full > 0.0)) {
        const uint32_t probes = std::min(size.z, kProbes);
        std::vector<float> gradient(plane * probes);
        const bool all = run_all(probes, task.part(0.0, 0.3), [&](size_t i) {
            const uint32_t z = first.z + uint32_t(i * size.z / probes);
            const WireDerivatives one =
                derive(volume, glm::ivec3(first.x, first.y, z), {size.x, size.y, 1}, flat);
            std::ranges::copy(one.gradient, gradient.begin() + ptrdiff_t(i * plane));
        });
        if (!all)
            return stopped();
        full = full_gradient_of(std::move(gradient));
    }
    const bool all = run_all((size.z + kSlab - 1) / kSlab, task.part(0.3, 1.0), [&](size_t i) {
        // With a slice before and behind, within the box.
        const uint32_t begin = uint32_t(i) * kSlab, end = std::min(begin + kSlab, size.z);
        const uint32_t from = begin > 0 ? begin - 1 : 0, to = std::min(end + 1, size.z);
        const glm::uvec3 slab(size.x, size.y, to - from);
        const WireDerivatives found =
            derive(volume, glm::ivec3(first + glm::uvec3(0, 0, from)), slab, flat);
        for (uint32_t z = begin; z < end; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x) {
                    const glm::uvec3 p(x, y, z - from);
                    const size_t in_plane = x + size_t{size.x} * y, at = in_plane + plane * p.z;
                    uint8_t& cost = out.cost[in_plane + plane * z];
                    cost = 255;
                    if (std::isnan(found.laplacian[at]) || std::isnan(found.gradient[at]))
                        continue;
                    const double low = 1.0 - std::min(double{found.gradient[at]} / full, 1.0);
                    const bool crossing = is_crossing(found.laplacian, at, p, slab);
                    const double mean = (options.gradient_weight * low +
                                         options.crossing_weight * (crossing ? 0.0 : 1.0)) /
                                        weights;
                    cost = uint8_t(1 + std::lround(254.0 * mean));
                }
    });
    if (!all)
        return stopped();
    return out;
}

LiveWire::LiveWire(LiveWireRegion region) : region_(std::move(region)) {
    const glm::uvec3 size = region_.size;
    PALPATE_ASSERT_CMP(region_.cost.size(), ==, count_of(size));
    PALPATE_ASSERT_CMP(region_.cost.size(), <, size_t{UINT32_MAX});
    double shortest = INFINITY, longest = 0.0;
    for (int n = 0; n < 27; ++n) {
        const glm::ivec3 by(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        if (n == 13 || (by.x != 0 && size.x == 1) || (by.y != 0 && size.y == 1) ||
            (by.z != 0 && size.z == 1))
            continue;
        const double mm = glm::length(region_.mm_from_step * glm::dvec3(by));
        shortest = std::min(shortest, mm);
        longest = std::max(longest, mm);
        steps_.push_back({by, by.x + ptrdiff_t(size.x) * (by.y + ptrdiff_t(size.y) * by.z), 0});
    }
    for (Step& step : steps_)
        step.length = uint32_t(std::lround(
            kLengthUnits * glm::length(region_.mm_from_step * glm::dvec3(step.by)) / shortest));
    const uint8_t least = *std::min_element(region_.cost.begin(), region_.cost.end());
    width_ = uint32_t(kLengthUnits) * 2 * least;
    const double dearest = steps_.empty() ? 0.0 : kLengthUnits * longest / shortest * 2 * 255 + 510;
    for (Front* front : {&from_anchor_, &back_})
        front->buckets.resize(size_t(dearest / width_) + 2);
    set_anchor(glm::uvec3(0));
}

template <class Visit>
void LiveWire::for_each_neighbour(size_t at, const Visit& visit) const {
    const glm::uvec3 size = region_.size;
    const glm::ivec3 p(at % size.x, at / size.x % size.y, at / (size_t{size.x} * size.y));
    const bool inside = glm::all(glm::greaterThan(p, glm::ivec3(0))) &&
                        glm::all(glm::lessThan(p + 1, glm::ivec3(size)));
    for (const Step& step : steps_) {
        if (!inside) {
            const glm::uvec3 q(p + step.by); // wraps round below 0
            if (q.x >= size.x || q.y >= size.y || q.z >= size.z)
                continue;
        }
        const size_t to = size_t(ptrdiff_t(at) + step.offset);
        visit(to, step);
    }
}

void LiveWire::begin(Front& front, size_t at) {
    for (std::vector<uint32_t>& bucket : front.buckets)
        bucket.clear();
    front.bucket = 0;
    front.waiting = 1;
    front.left[at] = UINT32_MAX;
    front.buckets[0].push_back(uint32_t(at));
}

void LiveWire::set_anchor(glm::uvec3 at) {
    PALPATE_ASSERT(glm::all(glm::lessThan(at, region_.size)));
    const auto zeros = [&](Front& front) {
        front.left.reset(); // before there is another
        front.left.reset(
            static_cast<uint32_t*>(std::calloc(region_.cost.size(), sizeof(uint32_t))));
        if (!front.left)
            throw std::bad_alloc();
    };
    zeros(from_anchor_);
    if (!back_.left)
        zeros(back_);
    to_ = number(at);
    cost_to_ = 0;
    begin(from_anchor_, to_);
}

// No step is shorter than a bucket is wide: so nothing in it can be reached by a cheaper way. Calls
// reach(sample) for each sample that got a cost, or a lower one.
template <class Reach>
void LiveWire::settle_next_bucket(Front& front, const Reach& reach) {
    std::vector<std::vector<uint32_t>>& ring = front.buckets;
    std::vector<uint32_t> now;
    now.swap(ring[front.bucket % ring.size()]);
    front.waiting -= now.size();
    for (const uint32_t at : now) {
        const uint32_t left = front.left[at], cost = UINT32_MAX - left;
        if (cost / width_ != front.bucket)
            continue; // it was reached more cheaply, and is settled
        for_each_neighbour(at, [&](size_t to, const Step& by) {
            if (front.left[to] >= left)
                return; // is no dearer than where we are
            const uint32_t step = step_cost(by, at, to);
            if (left - front.left[to] <= step)
                return;
            reach(to);
            front.left[to] = left - step;
            ring[(cost + step) / width_ % ring.size()].push_back(uint32_t(to));
            ++front.waiting;
        });
    }
    now.clear();
    if (ring[front.bucket % ring.size()].empty())
        now.swap(ring[front.bucket % ring.size()]); // keeps its memory
    ++front.bucket;
}

void LiveWire::forget_back() {
    for (const uint32_t at : reached_)
        back_.left[at] = 0;
    reached_.clear();
}

// The least cost of a way from the anchor to a sample, whose costs are not final. What is not final
// from one end costs at least its bucket's turn; so ways that neither end knows cost both.
uint64_t LiveWire::search_from(size_t to) {
    forget_back();
    begin(back_, to);
    reached_.push_back(uint32_t(to));
    // Samples to which both ends know a way are looked at when their costs are written.
    uint64_t best = from_anchor_.left[to] != 0 ? from_anchor_.cost(to) : UINT64_MAX;
    std::vector<uint32_t> met;
    while (from_anchor_.waiting > 0 && back_.waiting > 0 &&
           best >= width_ * (from_anchor_.bucket + back_.bucket)) {
        met.clear();
        if (from_anchor_.next() <= back_.next())
            settle_next_bucket(from_anchor_, [&](size_t at) {
                if (back_.left[at] != 0)
                    met.push_back(uint32_t(at));
            });
        else
            settle_next_bucket(back_, [&](size_t at) {
                if (back_.left[at] == 0)
                    reached_.push_back(uint32_t(at));
                if (from_anchor_.left[at] != 0)
                    met.push_back(uint32_t(at));
            });
        for (const uint32_t at : met)
            best = std::min(best, from_anchor_.cost(at) + back_.cost(at));
    }
    return best;
}

// The first neighbour by which a sample whose cost is final is reached; itself at the anchor.
size_t LiveWire::step_before(size_t at) const {
    size_t before = at;
    const uint32_t* left = from_anchor_.left.get();
    for_each_neighbour(at, [&](size_t from, const Step& by) {
        // A neighbour that is not settled yet costs more than one that is, so it is no way here.
        if (before == at && left[from] > left[at] &&
            left[from] - left[at] == step_cost(by, at, from))
            before = from;
    });
    return before;
}

// From a cursor back to the first sample that is final from the anchor, on a way of that cost: at
// each sample the first neighbour through which there is one. On such a way all that is not final
// from the anchor is final from the cursor. A search in depth that enters no sample twice.
std::vector<size_t> LiveWire::way_to_known(size_t to, uint64_t cost) const {
    struct Level {
        size_t at;
        std::vector<size_t> ways; // not tried yet, the first last
    };
    std::unordered_set<size_t> entered;
    std::vector<Level> levels;
    const auto enter = [&](size_t at) {
        Level level{at, {}};
        for_each_neighbour(at, [&](size_t from, const Step& by) {
            if (back_.left[from] != 0 &&
                back_.cost(from) == back_.cost(at) + step_cost(by, at, from))
                level.ways.push_back(from);
        });
        std::reverse(level.ways.begin(), level.ways.end());
        levels.push_back(std::move(level));
    };
    enter(to);
    while (!is_final(from_anchor_, levels.back().at)) {
        while (levels.back().ways.empty()) {
            levels.pop_back();
            PALPATE_ASSERT(!levels.empty());
        }
        const size_t next = levels.back().ways.back();
        levels.back().ways.pop_back();
        const bool is_dearer =
            is_final(from_anchor_, next) && from_anchor_.cost(next) + back_.cost(next) != cost;
        if (!is_dearer && entered.insert(next).second)
            enter(next);
    }
    std::vector<size_t> way;
    for (const Level& level : levels)
        way.push_back(level.at);
    return way;
}

uint32_t LiveWire::cost_of(glm::uvec3 to) const {
    return number(to) == to_ ? cost_to_ : uint32_t(from_anchor_.cost(number(to)));
}

std::vector<glm::uvec3> LiveWire::path(glm::uvec3 to) {
    PALPATE_ASSERT(glm::all(glm::lessThan(to, region_.size)));
    to_ = number(to);
    std::vector<size_t> way{to_};
    if (is_final(from_anchor_, to_)) {
        cost_to_ = uint32_t(from_anchor_.cost(to_));
    } else {
        const uint64_t cost = search_from(to_);
        cost_to_ = uint32_t(cost);
        while (from_anchor_.bucket == 0) // the anchor itself is to be final
            settle_next_bucket(from_anchor_, [](size_t) {});
        way = way_to_known(to_, cost);
    }
    while (from_anchor_.left[way.back()] != UINT32_MAX) {
        const size_t before = step_before(way.back());
        PALPATE_ASSERT(before != way.back());
        way.push_back(before);
    }
    std::vector<glm::uvec3> out;
    const glm::uvec3 size = region_.size;
    for (auto at = way.rbegin(); at != way.rend(); ++at)
        out.emplace_back(*at % size.x, *at / size.x % size.y, *at / (size_t{size.x} * size.y));
    return out;
}

} // namespace palpate
