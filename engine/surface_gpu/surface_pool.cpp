#include "engine/surface_gpu/surface_pool.h"

#include <vulkan/vulkan_core.h>

#include <algorithm>
#include <cstddef>

#include "engine/base/assert.h"

namespace palpate {

static_assert(sizeof(gpu::ExtractDraw) == sizeof(VkDrawIndexedIndirectCommand) &&
              offsetof(gpu::ExtractDraw, first_index) ==
                  offsetof(VkDrawIndexedIndirectCommand, firstIndex) &&
              offsetof(gpu::ExtractDraw, vertex_offset) ==
                  offsetof(VkDrawIndexedIndirectCommand, vertexOffset));

namespace {

constexpr uint32_t kVertexQuantum = 16, kTriangleQuantum = 32;
constexpr uint64_t kLeastVertices = 1 << 14, kLeastTriangles = 1 << 15; // of an arena

constexpr uint64_t round_up(uint64_t n, uint64_t quantum) {
    return (n + quantum - 1) / quantum * quantum;
}

} // namespace

SurfacePool::Size SurfacePool::rounded(Size one) {
    return {round_up(one.vertices, kVertexQuantum), round_up(one.triangles, kTriangleQuantum)};
}

void SurfacePool::add_arena(Size least) {
    // Also below 2^31 bytes, so that numbers of words stay within 32 bits and a sign.
    const uint64_t most =
        std::min<uint64_t>(device_->limits().maxStorageBufferRange, (uint64_t{1} << 31) - 1) / 12;
    const auto capacity = [&](uint64_t needed, uint64_t at_least, uint32_t quantum) {
        const uint64_t wanted = std::max(round_up(needed + needed / 5, quantum), at_least);
        return static_cast<uint32_t>(std::min(wanted, most / quantum * quantum));
    };
    const uint32_t vertices = capacity(least.vertices, kLeastVertices, kVertexQuantum);
    const uint32_t triangles = capacity(least.triangles, kLeastTriangles, kTriangleQuantum);
    const uint64_t draws = vertices / kVertexQuantum; // every block has a vertex
    const auto buffer = [&](const char* name, uint64_t bytes) {
        return Buffer(*device_, name, bytes, Memory::device);
    };
    arenas_.push_back(
        {buffer("surface positions", uint64_t{vertices} * sizeof(glm::vec3)),
         normals_ ? std::optional(buffer("surface normals", uint64_t{vertices} * sizeof(glm::vec3)))
                  : std::nullopt,
         buffer("surface edges", uint64_t{vertices} * sizeof(uint32_t)),
         buffer("surface triangles", uint64_t{triangles} * sizeof(glm::uvec3)),
         buffer("surface draws", draws * sizeof(gpu::ExtractDraw)),
         0,
         RangeAllocator(vertices, kVertexQuantum),
         RangeAllocator(triangles, kTriangleQuantum),
         {},
         {},
         {}});
}

std::optional<PoolRange> SurfacePool::take_in(uint32_t number, uint32_t vertices,
                                              uint32_t triangles) {
    Arena& arena = arenas_[number];
    const std::optional<uint32_t> vertex = arena.free_vertices.take(vertices);
    if (!vertex)
        return std::nullopt;
    PoolRange range{number, *vertex, vertices, 0, triangles, 0};
    if (triangles > 0) {
        const std::optional<uint32_t> triangle = arena.free_triangles.take(triangles);
        if (!triangle) {
            arena.free_vertices.give(*vertex, vertices);
            return std::nullopt;
        }
        range.first_triangle = *triangle;
    }
    if (arena.free_draws.empty())
        arena.free_draws.push_back(arena.draw_count++);
    range.draw = arena.free_draws.back();
    arena.free_draws.pop_back();
    return range;
}

PoolRange SurfacePool::take(uint32_t block, uint32_t vertices, uint32_t triangles, Size still) {
    PALPATE_ASSERT(vertices > 0);
    std::optional<PoolRange> range;
    for (uint32_t i = 0; i < arenas_.size() && !range; ++i)
        range = take_in(i, vertices, triangles);
    if (!range) {
        add_arena(still);
        range = take_in(static_cast<uint32_t>(arenas_.size() - 1), vertices, triangles);
    }
    PALPATE_ASSERT(range.has_value());
    Arena& arena = arenas_[range->arena];
    arena.jobs.push_back({block, range->first_vertex, range->first_triangle});
    arena.changed_draws[range->draw] = {3 * triangles, triangles > 0 ? 1u : 0u,
                                        3 * range->first_triangle,
                                        static_cast<int32_t>(range->first_vertex), block};
    return *range;
}

void SurfacePool::give(const PoolRange& range) {
    Arena& arena = arenas_[range.arena];
    arena.free_vertices.give(range.first_vertex, range.vertices);
    if (range.triangles > 0)
        arena.free_triangles.give(range.first_triangle, range.triangles);
    arena.free_draws.push_back(range.draw);
    arena.changed_draws[range.draw] = {};
}

void SurfacePool::clear() {
    for (Arena& arena : arenas_) {
        arena.free_vertices = RangeAllocator(arena.free_vertices.capacity(), kVertexQuantum);
        arena.free_triangles = RangeAllocator(arena.free_triangles.capacity(), kTriangleQuantum);
        arena.free_draws.clear();
        for (uint32_t i = arena.draw_count; i-- > 0;) { // 0 is taken first
            arena.free_draws.push_back(i);
            arena.changed_draws[i] = {};
        }
    }
}

} // namespace palpate
