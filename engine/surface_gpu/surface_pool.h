#pragma once

#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/surface_gpu/range_allocator.h"
#include "shaders/shared/extract.h"

namespace palpate {

// The place of a block's surface in the pool.
struct PoolRange {
    uint32_t arena = 0;
    uint32_t first_vertex = 0, vertices = 0;
    uint32_t first_triangle = 0, triangles = 0;
};

// Vertices and triangles of many blocks on the device, each block's in a range of its own: made
// there by extraction, and drawn from there.
//
// Triangles name vertices by their places in the arena. Triangles that no block holds are (0, 0,
// 0), which nothing draws: so an arena is drawn from its first triangle to the last one in use,
// whatever blocks have come and gone in between.
//
// Buffers are as large as the device allows at most, so there may be several sets of them: arenas.
// A pool never moves what it holds; what blocks give back is given out again. It has a fifth more
// room than the first extraction needs. Where that is used up it grows by an arena of at least a
// quarter of what it has, which is the one time that a change of the surface makes an object.
class SurfacePool {
 public:
    struct Arena {
        Buffer positions;              // vec3[], mm in mesh space
        std::optional<Buffer> normals; // vec3[]
        std::optional<Buffer> edges;   // uint[]: block::edge_number() of each vertex
        std::optional<Buffer> labels;  // uint[] of triangles: label | outer label << 16
        Buffer triangles;              // uvec3[]: vertices of this arena
        RangeAllocator free_vertices, free_triangles;
        uint32_t end = 0;                    // behind the last triangle ever taken
        std::vector<gpu::ExtractJob> jobs{}; // taken and not yet made
        std::vector<PoolRange> given{};      // whose triangles are not yet (0, 0, 0)
    };

    SurfacePool(GpuDevice& device, bool normals, bool edges, bool labels = false)
        : device_(&device), normals_(normals), edges_(edges), labels_(labels) {}

    struct Size {
        uint64_t vertices, triangles;
    };
    // Room for what one block holds. Where no arena has any, one is made for at least what is
    // `still` to come, this block included, and a fifth more. Throws GpuError where memory does not
    // suffice.
    PoolRange take(uint32_t block, uint32_t vertices, uint32_t triangles, Size still,
                   Commands& commands);
    void give(const PoolRange& range);
    void clear(Commands& commands); // gives everything; arenas stay

    // Overwrites triangles that were given back. After all of an update's give(), and before what
    // is made in ranges that it takes.
    void erase_given(Commands& commands);

    std::deque<Arena>& arenas() { return arenas_; }
    static Size rounded(Size one); // what a block takes up

 private:
    std::optional<PoolRange> take_in(uint32_t arena, uint32_t vertices, uint32_t triangles);
    void add_arena(Size least, Commands& commands);

    GpuDevice* device_;
    bool normals_, edges_, labels_;
    std::deque<Arena> arenas_;
};

// Brings pieces of memory to a buffer by one copy; a single large piece as Commands::upload() does.
struct UploadPiece {
    std::span<const std::byte> bytes;
    uint64_t to; // the first byte in the buffer
};
void upload_pieces(Commands& commands, std::span<const UploadPiece> pieces, Buffer& to);

} // namespace palpate
