#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "engine/render/ray_cast_variant.h"
#include "engine/render/render_store.h"
#include "shaders/shared/frame.h"
#include "shaders/shared/tiles.h"

namespace palpate {

// Casts a scene's rays: lists the tiles of the picture in which something may be seen, then marches
// those. CoarsePass casts other rays by it.
class RayCastPass {
 public:
    explicit RayCastPass(RenderStore& store)
        : store_(&store), unused_(store.device, "unused", sizeof(uint32_t), Memory::device) {}
    ~RayCastPass() { store_->transfers.drop(table_); }
    RayCastPass(const RayCastPass&) = delete;
    RayCastPass& operator=(const RayCastPass&) = delete;

    // Before the volume is uploaded: asks for the pipelines that a first frame is likely to need,
    // to be made meanwhile (one too many costs a thread its time); what to leave room for.
    VolumeResidency::Wish begin(const Scene& scene, const SceneData& data, bool among_layers,
                                double step_factor);
    // With `count` the rays' samples are counted.
    void prepare(const ViewFrame& frame, bool count);

    // Casts all rays over what lies behind them, part by part of an atlas. Returns how many bricks
    // were brought into it. Fails where RendererOptions::progress says so.
    Result<size_t> record(const ViewFrame& frame);
    // The full picture in some tiles, over what is there.
    void record_tiles(const ViewFrame& frame, const gpu::TileRange& range);

    // The passes of the frame's commands, by number, that cast rays of the picture. Once a frame.
    std::vector<size_t> take_timed() { return std::exchange(timed_, {}); }

    // Once the device is past the frame: its samples, where they were counted.
    uint64_t read_sample_counts();

    // Rays of one kind: their block, what they are listed in and where their colours go.
    struct Rays {
        const char* name;
        RayCastVariant variant;
        glm::uvec2 count; // across and down
        BufferSlice block;
        GpuImage* table; // none in mode iso
        GpuImage* color;
        GpuImage* values;             // where the scene asks for value and depth
        Buffer* groups;               // how many workgroups
        Buffer* list;                 // tiles, or rays (kRaysListed)
        Buffer* slabs = nullptr;      // where takes_slabs(variant)
        Buffer* spans = nullptr;      // of the picture's tiles, where rays lie between them
        Buffer* first_hits = nullptr; // of every second pixel, where variant.has_first_hits()
        bool is_picture = true;       // false: the picture is judged by them
    };
    // One a pixel, at full quality.
    Rays all_rays(const ViewFrame& frame);
    static bool takes_slabs(const RayCastVariant& variant);
    const gpu::Frame& block() const { return block_; } // of all_rays()
    uint32_t tiles_to_list(const Scene& scene) const;  // gpu::kList...

    // All tiles of some rays, or of a picture.
    static gpu::TileRange all_tiles(glm::uvec2 rays);
    void list_tiles(const ViewFrame& frame, const Rays& rays, uint32_t which,
                    const gpu::TileRange& range);
    void cast(const ViewFrame& frame, const Rays& rays);
    // Both, in as many submissions as that takes; whether these were several.
    bool cast_tiles(const ViewFrame& frame, const Rays& rays, uint32_t which,
                    const gpu::TileRange& range);

 private:
    Buffer* or_unused(Buffer* buffer) { return buffer ? buffer : &unused_; }

    RenderStore* store_;
    Buffer unused_; // where a shader has a place that its constants leave alone
    std::shared_ptr<TransferImage> table_;
    RayCastVariant variant_;
    gpu::Frame block_;
    std::optional<BufferSlice> uploaded_block_; // of this frame
    glm::uvec2 size_px_{0};
    uint32_t eyes_ = 0;
    std::optional<Buffer> tile_groups_, tiles_, slabs_; // of a picture of this size
    std::optional<GpuImage> carry_;                     // what rays bring from part to part
    struct Listed {                                     // tiles that were marched, and their number
        BufferSlice tiles, groups;
    };
    std::vector<Listed> listed_; // while samples are counted
    std::vector<size_t> timed_;
};

} // namespace palpate
