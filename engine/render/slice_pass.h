#pragma once

#include <memory>
#include <optional>

#include "engine/render/changed_pixels.h"
#include "engine/render/render_store.h"

namespace palpate {

// Draws a scene's slices: behind all rays where it casts any, else as the picture.
class SlicePass {
 public:
    explicit SlicePass(RenderStore& store) : store_(&store) {}
    ~SlicePass() {
        store_->transfers.drop(table_);
        store_->transfers.drop(fused_table_);
    }
    SlicePass(const SlicePass&) = delete;
    SlicePass& operator=(const SlicePass&) = delete;

    void prepare(const ViewFrame& frame);
    // `only`: these pixels, with those of their tiles. Returns how many bricks were brought into an
    // atlas.
    size_t record(const ViewFrame& frame, const std::optional<PixelBox>& only);

 private:
    RenderStore* store_;
    std::shared_ptr<TransferImage> table_, fused_table_;
    std::optional<BufferSlice> block_, planes_, over_; // of this frame
};

} // namespace palpate
