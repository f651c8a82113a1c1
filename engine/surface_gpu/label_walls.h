#pragma once

#include <optional>
#include <vector>

#include "engine/surface/block_nets.h"
#include "engine/surface_gpu/surface_pool.h"

namespace palpate {

// The walls between labels that are being edited, kept on the device to be drawn there. The CPU
// makes them (BlockNets), on every device: what it makes is uploaded and not kept here.
//
// For one thread. Throws GpuError where memory does not suffice or the device is lost, and what
// reading a brick of a source throws; after that the walls can only be dropped.
class LabelWalls {
 public:
    LabelWalls(GpuDevice& device, const Volume& labels, Commands& commands,
               const BlockNetsOptions& options = {});

    const Volume& labels() const { return nets_.labels(); }
    size_t block_count() const { return placed_.size(); }
    uint64_t triangles() const { return triangles_; }
    SurfacePool& pool() { return pool_; }

    // A block's walls in the pool, and a box about them along the axes of mesh space, in mm.
    struct Placed {
        PoolRange range;
        glm::vec3 low_mm, high_mm;
    };
    const std::vector<std::optional<Placed>>& placed() const { return placed_; } // by number

    // `after` has the grid of labels(). The walls are up to date for what is recorded after it.
    // Returns how many blocks were made again.
    size_t record_update(Commands& commands, const Volume& after);

 private:
    void bring(Commands& commands, const std::vector<uint32_t>& numbers);
    void upload(Commands& commands, const std::vector<BlockNets::Block>& blocks,
                const std::vector<PoolRange>& ranges);

    BlockNets nets_;
    SurfacePool pool_;
    std::vector<std::optional<Placed>> placed_;
    uint64_t triangles_ = 0;
};

} // namespace palpate
