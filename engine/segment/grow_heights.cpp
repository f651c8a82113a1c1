#include "engine/segment/grow_heights.h"

#include <bit>
#include <cmath>
#include <mutex>

#include "engine/segment/edges.h"

namespace palpate {

namespace {

constexpr size_t kBins = 32768; // of the upper 16 bits of a float that is at least 0

size_t bin_of(float edge) {
    return std::bit_cast<uint32_t>(edge) >> 16 & 0x7fff; // -0 too
}

// Calls visit(place, edge) for each sample of a brick, NaN where the region is 0.
template <class Visit>
void for_each_edge(const Volume& edges, const Volume* region, size_t number, const Visit& visit) {
    const glm::uvec3 bricks = edges.brick_count(), size = edges.size();
    const glm::uvec3 position(number % bricks.x, number / bricks.x % bricks.y,
                              number / (size_t{bricks.x} * bricks.y));
    const Brick& brick = edges.brick(position);
    const Brick::Pinned pinned = brick.pin();
    const Brick* mask = region ? &region->brick(position) : nullptr;
    const Brick::Pinned mask_pin = mask ? mask->pin() : Brick::Pinned{};
    const glm::uvec3 valid = edges.valid_in_brick(position);
    for (uint32_t z = 0; z < valid.z; ++z)
        for (uint32_t y = 0; y < valid.y; ++y)
            for (uint32_t x = 0; x < valid.x; ++x) {
                const uint32_t offset = offset_in_brick({x, y, z});
                const glm::uvec3 i = position * kBrickSide + glm::uvec3(x, y, z);
                const bool is_in = !mask || mask->value(mask_pin, offset) > 0.0f;
                visit(i.x + size_t{size.x} * (i.y + size_t{size.y} * i.z),
                      is_in ? brick.value(pinned, offset) : NAN);
            }
}

} // namespace

Result<std::vector<uint16_t>> grow_heights(const Volume& volume, const Volume* region,
                                           const Task& task) {
    if (region && region->size() != volume.size())
        return fail("the region has another size than the volume");
    PALPATE_TRY(const Volume edges, edge_strength(volume, task.part(0.0, 0.6)));
    const glm::uvec3 bricks = edges.brick_count();
    const size_t count = size_t{bricks.x} * bricks.y * bricks.z;
    std::vector<uint64_t> counts(kBins);
    std::mutex one_at_a_time;
    if (!run_all(count, task.part(0.6, 0.8), [&](size_t i) {
            std::vector<uint32_t> own(kBins);
            for_each_edge(edges, region, i, [&](size_t, float edge) {
                if (!std::isnan(edge))
                    ++own[bin_of(edge)];
            });
            const std::lock_guard lock(one_at_a_time);
            for (size_t bin = 0; bin < kBins; ++bin)
                counts[bin] += own[bin];
        }))
        return stopped();
    std::vector<uint16_t> rank(kBins);
    uint64_t total = 0, below = 0;
    for (const uint64_t bin : counts)
        total += bin;
    for (size_t bin = 0; bin < kBins && total > 0; ++bin) {
        rank[bin] = uint16_t(below * (kGrowWall - 1) / total);
        below += counts[bin];
    }
    std::vector<uint16_t> heights(sample_count(volume.grid()));
    if (!run_all(count, task.part(0.8, 1.0), [&](size_t i) {
            for_each_edge(edges, region, i, [&](size_t at, float edge) {
                heights[at] = std::isnan(edge) ? kGrowWall : rank[bin_of(edge)];
            });
        }))
        return stopped();
    return heights;
}

} // namespace palpate
