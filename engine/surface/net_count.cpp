#include "engine/surface/net_count.h"

#include <algorithm>

#include "engine/volume/box.h"

namespace palpate {

namespace {

int at(glm::ivec3 place, int side) {
    return place.x + side * (place.y + side * place.z);
}

} // namespace

NetCounter::Count NetCounter::count(const Volume& labels, glm::ivec3 block) {
    // Beyond the volume is background.
    const glm::ivec3 first = 8 * block - 2, size(labels.size());
    const glm::ivec3 low = glm::max(first, glm::ivec3(0)), end = glm::min(first + kSide, size);
    labels_.fill(0);
    read_box(labels, low, end - low, {kSide, kSide * kSide}, &labels_[at(low - first, kSide)]);
    Count count;
    if (std::ranges::all_of(labels_, [&](uint16_t label) { return label == labels_[0]; }))
        return count;
    for (int z = 0; z < kCells; ++z)
        for (int y = 0; y < kCells; ++y)
            for (int x = 0; x < kCells; ++x) {
                std::array<uint16_t, 8> corners;
                for (int c = 0; c < 8; ++c)
                    corners[c] = labels_[at({x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)}, kSide)];
                const bool active = std::ranges::any_of(
                    corners, [&](uint16_t label) { return label != corners[0]; });
                NetCell& cell = cells_[at({x, y, z}, kCells)];
                cell = active ? quick_net_cell(corners) : NetCell{};
                if (std::min({x, y, z}) > 0)
                    count.vertices += cell.vertices;
            }
    for (int z = 1; z < kCells; ++z)
        for (int y = 1; y < kCells; ++y)
            for (int x = 1; x < kCells; ++x)
                for (int axis = 0; axis < 3; ++axis) {
                    if (!(cells_[at({x, y, z}, kCells)].crossed >> 4 * axis & 1))
                        continue;
                    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
                    constexpr int kLess[4][2] = {{1, 1}, {0, 1}, {1, 0}, {1, 1}};
                    uint32_t sides = 0;
                    for (int side = 0; side < 4; ++side) {
                        // Side 0 is the upper b face of (1, 1), 1 the upper c face of (0, 1),
                        // 2 the upper b face of (1, 0) and 3 the upper c face of (1, 1).
                        const int across = side % 2 == 0 ? b : c;
                        glm::ivec3 lower(x, y, z);
                        lower[b] -= kLess[side][0];
                        lower[c] -= kLess[side][1];
                        const int face = 2 * across + 1;
                        sides += (cells_[at(lower, kCells)].splits >> (2 * face) & 3) != 0;
                    }
                    count.more_vertices += sides > 0 ? 1 + sides : 0;
                    count.triangles += sides > 0 ? 4 + sides : 2;
                }
    return count;
}

} // namespace palpate
