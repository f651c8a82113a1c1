#pragma once

#include <span>
#include <vector>

#include "engine/surface/block_count.h"
#include "engine/surface/block_mesh.h"
#include "engine/surface_gpu/extract_pipelines.h"
#include "engine/surface_gpu/sample_image.h"
#include "engine/surface_gpu/surface_pool.h"
#include "engine/volume/changes.h"

namespace palpate {

// The surface of a volume that is being edited, extracted and kept on the GPU: the twin there of
// BlockSurface, block by block of 8^3 samples.
//
// The samples lie on the device, bit by bit. Compute passes find the blocks whose range holds iso,
// list them by a prefix sum, count what each holds, and make each in its range of the pool:
// vertices in mm, normals, triangles, and one indirect draw (SurfacePool). update() makes again the
// blocks that read a changed sample, and no others; these are counted on the CPU, so that an
// update is one submission.
//
// A block equals that of BlockSurface: the same vertices in the same order, and the same
// triangles. Samples are compared by their bits, and integer arithmetic corrects quotients and
// roots (shaders/lib/exact_float.glsl), so positions and normals have the same bits too, on
// every device but for the sign of zeros, as long as no intermediate number is below 2^-126,
// which devices may flush to 0. Two ends of an edge whose values differ by less then have
// their vertex 2^-12 from the lower end, and normals whose square is beyond 1e-30 .. 1e30 per
// mm^2 lie within 2^-20 of those of the CPU, or along their edge where the gradient is below
// 2^-126.
//
// Topology is `classic`: the surfaces of mode `correct` depend on values of eight corners in double
// precision, which devices need not have, and are left to the CPU. Normals of
// SurfaceNormals::triangles are made by mesh(). Values equal to iso, missing ones, sizes of 1 and
// the border are as marching_cubes() says.
//
// For one thread. Every call waits until the device has done its work. Throws GpuError where memory
// does not suffice or the device is lost, std::length_error beyond 2^32 - 1 vertices in mesh(), and
// what reading a brick of a source throws; after that the surface can only be dropped.
class GpuSurface {
 public:
    // Why this cannot be done, in a sentence: mode `correct`, or a volume larger than the device's
    // images or with more blocks than its buffers hold.
    static Result<void> supports(const GpuDevice& device, const Volume& volume,
                                 const SurfaceOptions& options);

    // Only for settings that supports() accepts. Keeps a reference to the pipelines.
    GpuSurface(ExtractPipelines& pipelines, const Volume& volume, float iso,
               const SurfaceOptions& options = {});

    const Volume& volume() const { return volume_; }
    float iso() const { return iso_; }
    const SurfaceOptions& options() const { return options_; }

    // Another surface of the same samples: everything is extracted again.
    void set_iso(float iso);

    struct Update {
        std::vector<glm::ivec3> blocks; // made again, as BlockSurface::Update
        uint64_t triangles = 0;         // in these blocks, now
    };
    // `after` has the size and type of volume(); `changed` is what changed_bricks() gives for
    // volume() and `after`.
    Update update(const Volume& after);
    Update update(const Volume& after, std::span<const ChangedBrick> changed);

    uint64_t triangles() const { return triangles_; }
    // Positions of all blocks with a surface, in the order of the mesh.
    std::vector<glm::ivec3> blocks() const;
    // Where a block lies in pool(); null where it has no surface.
    const PoolRange* range(glm::ivec3 block) const;
    SurfacePool& pool() { return pool_; }

    // All blocks, read back: in the order of blocks().
    std::vector<BlockMesh> read_back();
    // One mesh with shared vertices, read back: as marching_cubes(volume(), iso(), options()).
    Mesh mesh();

    // Of the last extraction or update, by pass.
    const std::vector<PassTime>& pass_times() const { return times_; }

 private:
    struct Record {
        uint32_t block;  // its number
        uint32_t own;    // vertices on its own edges
        PoolRange range; // no vertices: not in use
    };

    void hold_frame();
    void extract_all();
    std::vector<gpu::ExtractCount> counted(std::span<const uint32_t> numbers);
    uint64_t record_blocks(Commands& commands, std::span<const uint32_t> numbers,
                           std::span<const gpu::ExtractCount> counts);
    void finish(Commands& commands);
    uint32_t number_of(glm::ivec3 block) const;
    glm::ivec3 block_at(uint32_t number) const;
    Buffer& kept(std::optional<Buffer>& buffer, const char* name, uint64_t bytes, Memory memory);

    ExtractPipelines* pipelines_;
    GpuDevice* device_;
    Volume volume_;
    float iso_;
    SurfaceOptions options_;
    int lead_;         // blocks before the volume: 1 if closed
    glm::ivec3 count_; // of blocks on each axis
    SampleImage samples_;
    SurfacePool pool_;
    std::vector<uint32_t> record_of_; // by number: 1 + index into records_, or 0
    std::vector<Record> records_;
    std::vector<uint32_t> free_records_;
    uint64_t triangles_ = 0;
    std::vector<PassTime> times_;
    Buffer frame_, work_;
    std::deque<std::optional<Buffer>> jobs_, changes_; // of each arena, grown as needed
    block::BlockCounter counter_;
};

} // namespace palpate
