#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "engine/gpu/resource.h"
#include "engine/surface_gpu/range_allocator.h"
#include "shaders/shared/extract.h"

namespace palpate {

// Where a block's surface lies in the pool.
struct PoolRange {
    uint32_t arena = 0;
    uint32_t first_vertex = 0, vertices = 0;
    uint32_t first_triangle = 0, triangles = 0;
    uint32_t draw = 0; // its number in the arena
};

// Vertices and triangles of many blocks, each in a range of its own, with one indirect draw a
// block.
//
// Buffers are as large as the device allows at most, so there may be several sets of them: arenas.
// A pool grows by arenas and never moves what it holds; what blocks give back is given out again.
class SurfacePool {
 public:
    struct Arena {
        Buffer positions;              // vec3[], mm in mesh space
        std::optional<Buffer> normals; // vec3[]
        Buffer edges;                  // uint[]: block::edge_number() of each vertex
        Buffer triangles;              // uvec3[]: vertices, counted from the block's first
        Buffer draws;                  // gpu::ExtractDraw[], VkDrawIndexedIndirectCommand
        uint32_t draw_count = 0;       // the rest of `draws` was never written
        RangeAllocator free_vertices, free_triangles;
        std::vector<uint32_t> free_draws;
        // Not yet on the GPU.
        std::vector<gpu::ExtractJob> jobs;
        std::map<uint32_t, gpu::ExtractDraw> changed_draws;
    };

    SurfacePool(GpuDevice& device, bool normals) : device_(&device), normals_(normals) {}

    // Room for what one block holds, and its draw. Where no arena has any, one is made for at least
    // what is `still` to come, this block included, and a fifth more. Throws GpuError where memory
    // does not suffice.
    struct Size {
        uint64_t vertices, triangles;
    };
    PoolRange take(uint32_t block, uint32_t vertices, uint32_t triangles, Size still);
    void give(const PoolRange& range);
    void clear(); // gives everything; arenas stay

    std::deque<Arena>& arenas() { return arenas_; }
    static Size rounded(Size one); // what a block takes up

 private:
    std::optional<PoolRange> take_in(uint32_t arena, uint32_t vertices, uint32_t triangles);
    void add_arena(Size least);

    GpuDevice* device_;
    bool normals_;
    std::deque<Arena> arenas_;
};

} // namespace palpate
