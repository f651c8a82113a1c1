#pragma once

#include <optional>
#include <set>
#include <vector>

#include "engine/surface/net_count.h"
#include "engine/surface/surface_nets.h"
#include "engine/surface_gpu/range_allocator.h"
#include "engine/surface_gpu/sample_image.h"
#include "shaders/shared/nets.h"

namespace palpate {

// The compiled passes of all GpuNets of one device (shaders/net_*), each made when it is first
// asked for. Declared after the device and before its nets.
class NetPipelines {
 public:
    explicit NetPipelines(GpuDevice& device)
        : device_(&device),
          pipelines_(device),
          nearest_(device, SampleFilter::nearest, Edge::clamp) {}

    GpuDevice& device() { return *device_; }
    ComputePipeline& get(const Shader& shader) { return pipelines_.get(shader); }
    const Sampler& nearest() const { return nearest_; }

 private:
    GpuDevice* device_;
    PipelineCache pipelines_;
    Sampler nearest_;
};

// The walls between all labels of a volume that is being edited, made and kept on the device: the
// twin there of surface_nets().
//
// Vertices and triangles are those of surface_nets(), with the same bits but for the sign of zeros,
// in another order: block by block of 8^3 cells, x fastest. On the device every wall that passes
// through split faces has the vertices there for itself; mesh() joins those of walls side by side.
// Sums, products and comparisons are rounded alike on all devices, and integer arithmetic corrects
// quotients (shaders/lib/exact_float.glsl). An offset that smoothing brings below 2^-126 may become
// 0, which no position shows.
//
// The CPU counts what each block holds, so that room is found without an answer of the device. An
// update makes again the blocks that read a changed sample, their neighbours, and with smoothing
// those within its reach: 2 cells a pass.
//
// For one thread; every call waits for the device. Throws GpuError where memory does not suffice or
// the device is lost, and what reading a brick of a source throws; after that the nets can only be
// dropped.
class GpuNets {
 public:
    // Labels of u8 or u16; options.stop is not looked at. Fails with a sentence where the device
    // has no buffers that are large enough. Keeps a reference to the pipelines.
    static Result<GpuNets> make(NetPipelines& pipelines, const Volume& labels,
                                const SurfaceNetsOptions& options = {});

    const Volume& labels() const { return labels_; }
    uint64_t triangles() const { return triangles_; }

    // `after` has the size, grid and type of labels(). Returns how many blocks were made again.
    // Fails as make() does, where walls have outgrown their room.
    Result<size_t> update(const Volume& after);

    // Read back, without vertices of walls that are gone.
    Mesh mesh();

 private:
    struct Record {
        NetCounter::Count count;
        uint32_t slot, first_vertex, first_triangle;
    };
    struct Arrays { // room for what all blocks hold and a fifth more
        Buffer places, cells, vertices, offsets, positions, triangles, labels;
        std::optional<Buffer> links;
        RangeAllocator free_slots, free_vertices, free_triangles;
    };
    using Blocks = std::set<uint32_t>; // by number

    GpuNets(NetPipelines& pipelines, const Volume& labels, const SurfaceNetsOptions& options);
    Result<void> make_all();
    Result<void> make_arrays(const std::vector<NetCounter::Count>& counts);
    std::vector<NetCounter::Count> counted(const std::vector<uint32_t>& numbers) const;
    bool find_room(Commands& commands, const std::vector<uint32_t>& numbers,
                   const std::vector<NetCounter::Count>& counts);
    void record_blocks(Commands& commands, const Blocks& cells, const Blocks& emitted);
    BufferSlice jobs_of(Commands& commands, const Blocks& blocks) const;
    Blocks around(const Blocks& blocks, int reach) const;
    int reach_of_smoothing() const; // in blocks
    glm::ivec3 block_at(uint32_t number) const;

    NetPipelines* pipelines_;
    GpuDevice* device_;
    Volume labels_;
    SurfaceNetsOptions options_;
    glm::ivec3 count_; // of blocks on each axis
    SampleImage samples_;
    std::vector<std::optional<Record>> records_; // by number of the block
    std::optional<Arrays> arrays_;
    uint64_t triangles_ = 0;
};

} // namespace palpate
