#pragma once

#include <span>
#include <vector>

#include "engine/surface/block_count.h"
#include "engine/surface/block_surface.h"
#include "engine/surface_gpu/block_maker.h"
#include "engine/surface_gpu/extract_pipelines.h"
#include "engine/surface_gpu/sample_image.h"
#include "engine/surface_gpu/surface_pool.h"
#include "engine/volume/changes.h"

namespace palpate {

// The surface of a volume that is being edited, kept on the device to be drawn there: the twin of
// BlockSurface, block by block of 8^3 samples.
//
// BlockMaker::device: the samples lie on the device, bit by bit. Compute passes find the blocks
// whose range holds iso, list them by a prefix sum, count what each holds, and make each in its
// range of the pool: vertices in mm, normals and triangles (SurfacePool). An update makes again the
// blocks that read a changed sample, and no others. These are counted on the CPU, which has the
// samples too: so room is found without an answer of the device, and an update waits for nothing.
//
// BlockMaker::cpu: a BlockSurface makes them, and those made again are uploaded.
//
// A block equals that of BlockSurface: the same vertices in the same order, and the same
// triangles. The device compares samples by their bits, and integer arithmetic corrects quotients
// and roots (shaders/lib/exact_float.glsl), so positions and normals have the same bits too, on
// every device but for the sign of zeros, as long as no intermediate number is below 2^-126,
// which devices may flush to 0. Two ends of an edge whose values differ by less then have
// their vertex 2^-12 from the lower end, and normals whose square is beyond 1e-30 .. 1e30 per
// mm^2 lie within 2^-20 of those of the CPU, or along their edge where the gradient is below
// 2^-126.
//
// The device makes topology `classic` alone: surfaces of mode `correct` depend on values of eight
// corners in double precision, which devices need not have. Normals of SurfaceNormals::triangles
// are made by mesh(). Values equal to iso, missing ones, sizes of 1 and the border are as
// marching_cubes() says.
//
// For one thread. Throws GpuError where memory does not suffice or the device is lost,
// std::length_error beyond 2^32 - 1 vertices in mesh(), and what reading a brick of a source
// throws; after that the surface can only be dropped.
class GpuSurface {
 public:
    // Why this cannot be done, in a sentence: a volume larger than the device's images or with more
    // blocks than its buffers hold; by the device, also mode `correct`.
    static Result<void> supports(const GpuDevice& device, const Volume& volume,
                                 const SurfaceOptions& options,
                                 BlockMaker maker = BlockMaker::device);

    // Only for settings that supports() accepts. Keeps a reference to the pipelines. Waits for the
    // device.
    GpuSurface(ExtractPipelines& pipelines, const Volume& volume, float iso,
               const SurfaceOptions& options = {}, BlockMaker maker = BlockMaker::device);

    const Volume& volume() const { return volume_; }
    float iso() const { return iso_; }
    const SurfaceOptions& options() const { return options_; }
    BlockMaker maker() const { return cpu_ ? BlockMaker::cpu : BlockMaker::device; }

    // Another surface of the same samples: everything is extracted again. Waits for the device.
    void set_iso(float iso);

    struct Update {
        std::vector<glm::ivec3> blocks; // made again, as BlockSurface::Update
        uint64_t triangles = 0;         // in these blocks, now
    };
    // `after` has the size and type of volume(); `changed` is what changed_bricks() gives for
    // volume() and `after`. The first waits for nothing: the surface is up to date for what is
    // recorded after it. The others wait until the device is done.
    Update record_update(Commands& commands, const Volume& after,
                         std::span<const ChangedBrick> changed);
    Update update(const Volume& after);
    Update update(const Volume& after, std::span<const ChangedBrick> changed);

    uint64_t triangles() const { return triangles_; }
    // Positions of all blocks with a surface, in the order of the mesh.
    std::vector<glm::ivec3> blocks() const;
    // The range of a block in pool(); null where it has no surface.
    const PoolRange* range(glm::ivec3 block) const;
    SurfacePool& pool() { return pool_; }

    // All blocks that the device made, read back: in the order of blocks().
    std::vector<BlockMesh> read_back();
    // One mesh with shared vertices, by the device read back: as marching_cubes(volume(), iso(),
    // options()).
    Mesh mesh();

    // Times of the last extraction or update that was waited for, by pass.
    const std::vector<PassTime>& pass_times() const { return times_; }

 private:
    struct Record {
        uint32_t block;  // its number
        uint32_t own;    // vertices on its own edges
        PoolRange range; // no vertices: not in use
    };

    void hold_frame();
    void extract_all();
    void extract_on_device();
    void extract_on_cpu();
    std::vector<gpu::ExtractCount> counted(std::span<const uint32_t> numbers);
    std::vector<gpu::ExtractCount> made(std::span<const uint32_t> numbers) const;
    uint64_t find_room(Commands& commands, std::span<const uint32_t> numbers,
                       std::span<const gpu::ExtractCount> counts);
    void record_emit(Commands& commands);
    void upload_made(Commands& commands, bool all);
    void finish(Commands& commands);
    uint32_t number_of(glm::ivec3 block) const;
    glm::ivec3 block_at(uint32_t number) const;

    ExtractPipelines* pipelines_;
    GpuDevice* device_;
    Volume volume_;
    float iso_;
    SurfaceOptions options_;
    int lead_;                           // blocks before the volume: 1 if closed
    glm::ivec3 count_;                   // of blocks on each axis
    std::optional<SampleImage> samples_; // made by the device
    std::optional<BlockSurface> cpu_;    // made by the CPU
    SurfacePool pool_;
    std::vector<uint32_t> record_of_; // by number: 1 + index into records_, or 0
    std::vector<Record> records_;
    std::vector<uint32_t> free_records_;
    uint64_t triangles_ = 0;
    std::vector<PassTime> times_;
    gpu::ExtractFrame frame_{};
    block::BlockCounter counter_;
};

} // namespace palpate
