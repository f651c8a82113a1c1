#include "engine/surface_gpu/label_walls.h"

#include <limits>
#include <numeric>

namespace palpate {

LabelWalls::LabelWalls(GpuDevice& device, const Volume& labels, Commands& commands,
                       const BlockNetsOptions& options)
    : nets_(labels, options),
      pool_(device, /*normals=*/true, /*edges=*/false, /*labels=*/true),
      placed_(nets_.block_count()) {
    std::vector<uint32_t> all(nets_.block_count());
    std::iota(all.begin(), all.end(), 0u);
    bring(commands, all);
}

size_t LabelWalls::record_update(Commands& commands, const Volume& after) {
    const std::vector<uint32_t> made = nets_.update(after);
    bring(commands, made);
    return made.size();
}

void LabelWalls::bring(Commands& commands, const std::vector<uint32_t>& numbers) {
    std::vector<BlockNets::Block> blocks;
    std::vector<uint32_t> held; // their numbers: those with walls
    SurfacePool::Size still{};
    for (const uint32_t number : numbers) {
        if (std::optional<Placed>& placed = placed_[number]) {
            triangles_ -= placed->range.triangles;
            pool_.give(placed->range);
            placed.reset();
        }
        BlockNets::Block block = nets_.take(number);
        if (block.triangles.empty())
            continue;
        const SurfacePool::Size size =
            SurfacePool::rounded({block.positions.size(), block.triangles.size()});
        still.vertices += size.vertices;
        still.triangles += size.triangles;
        blocks.push_back(std::move(block));
        held.push_back(number);
    }
    std::vector<PoolRange> ranges;
    for (size_t i = 0; i < held.size(); ++i) {
        const auto vertices = static_cast<uint32_t>(blocks[i].positions.size());
        const auto triangles = static_cast<uint32_t>(blocks[i].triangles.size());
        ranges.push_back(pool_.take(held[i], vertices, triangles, still, commands));
        glm::vec3 low(std::numeric_limits<float>::max()), high = -low;
        for (const glm::vec3 position : blocks[i].positions) {
            low = glm::min(low, position);
            high = glm::max(high, position);
        }
        placed_[held[i]] = {ranges.back(), low, high};
        triangles_ += triangles;
        const SurfacePool::Size size = SurfacePool::rounded({vertices, triangles});
        still.vertices -= size.vertices;
        still.triangles -= size.triangles;
        for (glm::uvec3& triangle : blocks[i].triangles)
            triangle += ranges.back().first_vertex;
    }
    pool_.erase_given(commands);
    upload(commands, blocks, ranges);
}

void LabelWalls::upload(Commands& commands, const std::vector<BlockNets::Block>& blocks,
                        const std::vector<PoolRange>& ranges) {
    for (uint32_t number = 0; number < pool_.arenas().size(); ++number) {
        SurfacePool::Arena& arena = pool_.arenas()[number];
        const auto bring_items = [&](Buffer& to, auto first_of, auto items_of) {
            std::vector<UploadPiece> pieces;
            for (size_t i = 0; i < blocks.size(); ++i) {
                if (ranges[i].arena != number)
                    continue;
                const auto& items = items_of(blocks[i]);
                pieces.push_back(
                    {std::as_bytes(std::span(items)), first_of(ranges[i]) * sizeof(items[0])});
            }
            upload_pieces(commands, pieces, to);
        };
        const auto vertex = [](const PoolRange& range) { return uint64_t{range.first_vertex}; };
        const auto triangle = [](const PoolRange& range) { return uint64_t{range.first_triangle}; };
        using Block = BlockNets::Block;
        bring_items(
            arena.positions, vertex, [](const Block& b) -> const auto& { return b.positions; });
        bring_items(
            *arena.normals, vertex, [](const Block& b) -> const auto& { return b.normals; });
        bring_items(
            arena.triangles, triangle, [](const Block& b) -> const auto& { return b.triangles; });
        bring_items(
            *arena.labels, triangle, [](const Block& b) -> const auto& { return b.labels; });
        arena.jobs.clear();
    }
}

} // namespace palpate
