#include "engine/segment/label_bounds.h"

#include <mutex>
#include <vector>

#include "engine/segment/label_samples.h"

namespace palpate {

namespace {

using Bounds = std::map<uint16_t, IndexBox>;

void add_box(Bounds& bounds, uint16_t label, glm::ivec3 low, glm::ivec3 high) {
    const auto [at, is_new] = bounds.try_emplace(label, IndexBox{low, high});
    if (is_new)
        return;
    at->second.low = glm::min(at->second.low, low);
    at->second.high = glm::max(at->second.high, high);
}

// A box for each run of one label along x.
Bounds bounds_in_brick(const Volume& labels, glm::uvec3 position) {
    const glm::ivec3 first(position * kBrickSide), valid(labels.valid_in_brick(position));
    std::vector<uint16_t> samples(size_t(valid.x) * size_t(valid.y) * size_t(valid.z));
    read_labels(labels, first, valid, samples.data());
    Bounds bounds;
    const uint16_t* row = samples.data();
    for (int z = 0; z < valid.z; ++z)
        for (int y = 0; y < valid.y; ++y, row += valid.x)
            for (int x = 0; x < valid.x;) {
                int end = x + 1;
                while (end < valid.x && row[end] == row[x])
                    ++end;
                if (row[x] != 0)
                    add_box(bounds, row[x], first + glm::ivec3(x, y, z),
                            first + glm::ivec3(end - 1, y, z));
                x = end;
            }
    return bounds;
}

} // namespace

std::optional<Bounds> label_bounds(const Volume& labels, const Task& task) {
    const glm::uvec3 bricks = labels.brick_count();
    std::mutex mutex; // the smallest box does not depend on the order
    Bounds all;
    const bool done = run_all(size_t{bricks.x} * bricks.y * bricks.z, task, [&](size_t n) {
        const glm::uvec3 position(n % bricks.x, n / bricks.x % bricks.y,
                                  n / (size_t{bricks.x} * bricks.y));
        const Brick& brick = labels.brick(position);
        if (brick.range().empty() || !(brick.range().max >= 1.0f))
            return;
        const Bounds found = bounds_in_brick(labels, position);
        const std::lock_guard lock(mutex);
        for (const auto& [label, box] : found)
            add_box(all, label, box.low, box.high);
    });
    if (!done)
        return std::nullopt;
    return all;
}

} // namespace palpate
