#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/resource.h"
#include "engine/scene/scene.h"
#include "engine/volume/cell_range.h"

namespace palpate {

// What the ray caster jumps by: one texel (R32F) for each macro-cell of the volume.
//
// Modes alpha and iso: the distance, in cells and on the longest axis, to the nearest cell in which
// something can be seen (occupancy.h). Mode MIP: the highest texel of the cell, -infinity where it
// has no data, from which bounds are made for the rays of a tile (shaders/mip_slabs.comp). Voxels
// are read once, and again where they change; a new transfer function or iso-value costs one pass
// over the cells.
class CellMap {
 public:
    CellMap(GpuDevice& device, const Volume& volume);

    // Takes a later snapshot of the volume; `changed` is where it differs.
    void update(const Volume& next, std::span<const ChangedBrick> changed);

    // Makes the image what `layer` needs, if it is not that already. value = texel * scale + bias.
    // Where an edit of a few cells is all that is new, only they and what lies within reach of them
    // is worked out and recorded into `commands`: cells that come to hold something lower the
    // distances around them; around cells that became empty, distances stay what they were, which
    // is safe, until a frame that brings no edit.
    void show(const RayCastLayer& layer, float value_scale, float value_bias, Commands& commands);

    // A frame has come without an edit: show() works all out anew where distances could be larger.
    void settle() {
        if (loose_)
            shown_.reset();
    }

    // After show() for alpha or iso: the distances, x fastest; perhaps lower than they could be
    // after edits that take things away.
    const std::vector<uint8_t>& distances() const { return distances_; }

    // After show().
    GpuImage& image() { return *image_; }
    uint32_t side() const { return shown_->side; }
    size_t cell_count() const { return ranges_.cells(); } // of the finest; before show(), too
    glm::uvec3 count() const { return shown_->count; }
    double margin() const { return margin_; } // of values, see range_margin()

 private:
    struct Shown { // what the image was made from
        RayMode mode;
        TransferFunction transfer;
        std::vector<double> isos;
        float value_scale, value_bias;
        uint32_t side;
        glm::uvec3 count;
        uint64_t version;
    };
    void upload(const std::vector<float>& texels, glm::uvec3 count, Commands& commands);
    bool patch(const Shown& wanted, Commands& commands);

    GpuDevice* device_;
    CellRanges ranges_;
    uint64_t version_;
    double margin_;
    std::vector<uint8_t> distances_;
    std::optional<Shown> shown_;
    std::optional<GpuImage> image_;
    // Cells that edits touched since show(), low .. high - 1 on each axis; and whether some of them
    // became empty, so that distances could be larger.
    glm::ivec3 touched_low_{0}, touched_high_{0};
    bool loose_ = false;
};

} // namespace palpate
