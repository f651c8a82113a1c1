#include "haptics/servo/brick_lock.h"

#include <sys/mman.h>

#include <algorithm>

namespace palpate::haptics {

namespace {

size_t sample_bytes(const Brick& brick) {
    const size_t one = visit_scalar(brick.type(), [](auto t) { return sizeof(t); });
    return brick.is_constant() ? one : kBrickSamples * one;
}

} // namespace

bool BrickLock::lock(const Brick& brick) {
    return mlock(brick.pin().bytes, sample_bytes(brick)) == 0;
}

void BrickLock::unlock(const Brick& brick) {
    munlock(brick.pin().bytes, sample_bytes(brick));
}

BrickLock::~BrickLock() {
    for (const auto& [brick, held] : held_)
        if (held.locked)
            unlock(*brick);
}

void BrickLock::update(const Volume& volume, glm::dvec3 tool_mm, double radius_mm) {
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const glm::dvec3 center = index_point(volume.grid(), tool_mm);
    // The axes of the grid may be oblique; a ball then reaches radius / spacing on each of them at
    // least, and at most that times the inverse of the sine between them: twice is ample for CT.
    const glm::dvec3 reach = 2.0 * radius_mm / spacing;
    struct Wanted {
        double distance;
        BrickPtr brick;
    };
    std::vector<Wanted> wanted;
    const glm::dvec3 count(volume.brick_count());
    const glm::dvec3 side(kBrickSide);
    const glm::dvec3 first = glm::max(glm::floor((center - reach) / side), 0.0);
    const glm::dvec3 last = glm::min(glm::floor((center + reach) / side), count - 1.0);
    for (double z = first.z; z <= last.z; ++z)
        for (double y = first.y; y <= last.y; ++y)
            for (double x = first.x; x <= last.x; ++x) {
                const glm::dvec3 low = glm::dvec3(x, y, z) * side;
                const glm::dvec3 nearest = glm::clamp(center, low, low + side - 1.0);
                const double distance = glm::length((nearest - center) * spacing);
                const BrickPtr& brick = volume.brick_ptr(glm::uvec3(x, y, z));
                if (distance <= radius_mm && !brick->is_in_source())
                    wanted.push_back({distance, brick});
            }
    std::stable_sort(wanted.begin(), wanted.end(),
                     [](const Wanted& a, const Wanted& b) { return a.distance < b.distance; });

    std::map<const Brick*, Held> next;
    for (const Wanted& w : wanted)
        if (const auto it = held_.find(w.brick.get()); it != held_.end() && it->second.locked)
            next.insert(*it);
    // Let go first: there may be a limit.
    for (const auto& [brick, held] : held_)
        if (held.locked && !next.contains(brick)) {
            unlock(*brick);
            locked_bytes_ -= sample_bytes(*brick);
        }
    refused_ = 0;
    for (const Wanted& w : wanted) {
        if (next.contains(w.brick.get()))
            continue;
        const bool locked = lock(*w.brick);
        refused_ += !locked;
        locked_bytes_ += locked ? sample_bytes(*w.brick) : 0;
        next.insert({w.brick.get(), {w.brick, locked}});
    }
    held_ = std::move(next);
}

} // namespace palpate::haptics
