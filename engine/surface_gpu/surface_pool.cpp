#include "engine/surface_gpu/surface_pool.h"

#include <algorithm>
#include <cstring>

#include "engine/base/assert.h"

namespace palpate {

namespace {

constexpr uint32_t kVertexQuantum = 16, kTriangleQuantum = 8;
constexpr uint64_t kLeastVertices = 1 << 14, kLeastTriangles = 1 << 15; // of an arena
constexpr uint64_t kMostInOneCopy = uint64_t{4} << 20;                  // bytes

constexpr uint64_t round_up(uint64_t n, uint64_t quantum) {
    return (n + quantum - 1) / quantum * quantum;
}

} // namespace

SurfacePool::Size SurfacePool::rounded(Size one) {
    return {round_up(one.vertices, kVertexQuantum), round_up(one.triangles, kTriangleQuantum)};
}

void SurfacePool::add_arena(Size least, Commands& commands) {
    // Also below 2^31 bytes, so that numbers of words stay within 32 bits and a sign.
    const uint64_t most =
        std::min<uint64_t>(device_->limits().maxStorageBufferRange, (uint64_t{1} << 31) - 1) / 12;
    Size held{0, 0};
    for (const Arena& arena : arenas_) {
        held.vertices += arena.free_vertices.capacity();
        held.triangles += arena.free_triangles.capacity();
    }
    const auto capacity = [&](uint64_t needed, uint64_t at_least, uint32_t quantum) {
        const uint64_t wanted = std::max(round_up(needed + needed / 5, quantum), at_least);
        return static_cast<uint32_t>(std::min(wanted, most / quantum * quantum));
    };
    const uint32_t vertices =
        capacity(least.vertices, std::max(kLeastVertices, held.vertices / 4), kVertexQuantum);
    const uint32_t triangles =
        capacity(least.triangles, std::max(kLeastTriangles, held.triangles / 4), kTriangleQuantum);
    const auto buffer = [&](const char* name, uint64_t count, uint64_t bytes) {
        return Buffer(*device_, name, count * bytes, Memory::device);
    };
    const auto if_wanted = [&](bool wanted, const char* name, uint64_t count, uint64_t bytes) {
        return wanted ? std::optional(buffer(name, count, bytes)) : std::nullopt;
    };
    arenas_.push_back(
        {.positions = buffer("surface positions", vertices, sizeof(glm::vec3)),
         .normals = if_wanted(normals_, "surface normals", vertices, sizeof(glm::vec3)),
         .edges = if_wanted(edges_, "surface edges", vertices, sizeof(uint32_t)),
         .labels = if_wanted(labels_, "surface labels", triangles, sizeof(uint32_t)),
         .triangles = buffer("surface triangles", triangles, sizeof(glm::uvec3)),
         .free_vertices = RangeAllocator(vertices, kVertexQuantum),
         .free_triangles = RangeAllocator(triangles, kTriangleQuantum)});
    commands.zero(arenas_.back().triangles);
}

std::optional<PoolRange> SurfacePool::take_in(uint32_t number, uint32_t vertices,
                                              uint32_t triangles) {
    Arena& arena = arenas_[number];
    const std::optional<uint32_t> vertex = arena.free_vertices.take(vertices);
    if (!vertex)
        return std::nullopt;
    PoolRange range{number, *vertex, vertices, 0, triangles};
    if (triangles > 0) {
        const std::optional<uint32_t> triangle = arena.free_triangles.take(triangles);
        if (!triangle) {
            arena.free_vertices.give(*vertex, vertices);
            return std::nullopt;
        }
        range.first_triangle = *triangle;
        arena.end = std::max(arena.end, *triangle + triangles);
    }
    return range;
}

PoolRange SurfacePool::take(uint32_t block, uint32_t vertices, uint32_t triangles, Size still,
                            Commands& commands) {
    PALPATE_ASSERT(vertices > 0);
    std::optional<PoolRange> range;
    for (uint32_t i = 0; i < arenas_.size() && !range; ++i)
        range = take_in(i, vertices, triangles);
    if (!range) {
        add_arena(still, commands);
        range = take_in(static_cast<uint32_t>(arenas_.size() - 1), vertices, triangles);
    }
    PALPATE_ASSERT(range.has_value());
    arenas_[range->arena].jobs.push_back({block, range->first_vertex, range->first_triangle});
    return *range;
}

void SurfacePool::give(const PoolRange& range) {
    Arena& arena = arenas_[range.arena];
    arena.free_vertices.give(range.first_vertex, range.vertices);
    if (range.triangles == 0)
        return;
    arena.free_triangles.give(range.first_triangle, range.triangles);
    arena.given.push_back(range);
}

void SurfacePool::clear(Commands& commands) {
    for (Arena& arena : arenas_) {
        arena.free_vertices = RangeAllocator(arena.free_vertices.capacity(), kVertexQuantum);
        arena.free_triangles = RangeAllocator(arena.free_triangles.capacity(), kTriangleQuantum);
        arena.given.clear();
        arena.end = 0;
        commands.zero(arena.triangles);
    }
}

void SurfacePool::erase_given(Commands& commands) {
    for (Arena& arena : arenas_) {
        uint32_t most = 0;
        for (const PoolRange& range : arena.given)
            most = std::max(most, range.triangles);
        if (most == 0)
            continue;
        const BufferSlice zeros = commands.staging(most * sizeof(glm::uvec3));
        std::ranges::fill(zeros.mapped(), std::byte{0});
        std::vector<Commands::Bytes> pieces;
        for (const PoolRange& range : arena.given)
            pieces.push_back({zeros.offset, range.first_triangle * sizeof(glm::uvec3),
                              range.triangles * sizeof(glm::uvec3)});
        commands.copy(*zeros.buffer, arena.triangles, pieces);
        arena.given.clear();
    }
}

void upload_pieces(Commands& commands, std::span<const UploadPiece> pieces, Buffer& to) {
    uint64_t total = 0;
    for (const UploadPiece& piece : pieces)
        total += piece.bytes.size();
    if (total == 0)
        return;
    if (pieces.size() == 1 && total > kMostInOneCopy) {
        commands.upload(pieces[0].bytes, to, pieces[0].to);
        return;
    }
    const BufferSlice from = commands.staging(total);
    std::vector<Commands::Bytes> copies;
    uint64_t at = 0;
    for (const UploadPiece& piece : pieces) {
        if (piece.bytes.empty())
            continue;
        std::memcpy(from.mapped().data() + at, piece.bytes.data(), piece.bytes.size());
        copies.push_back({from.offset + at, piece.to, piece.bytes.size()});
        at += piece.bytes.size();
    }
    commands.begin_pass("upload");
    commands.copy(*from.buffer, to, copies);
    commands.end_pass();
}

} // namespace palpate
