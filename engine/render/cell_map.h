#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/resource.h"
#include "engine/render/cell_distances.h"
#include "engine/render/occupancy.h"
#include "engine/scene/scene.h"
#include "engine/volume/cell_range.h"

namespace palpate {

// The macro-cells that share a sample with the changed blocks of a brick.
CellBox changed_cells(const ChangedBrick& brick, uint32_t side, glm::uvec3 count);

// The ranges of a volume's macro-cells, which all maps of it are made from: voxels are read once,
// and again where they change.
class VolumeCells {
 public:
    explicit VolumeCells(const Volume& volume);

    // Takes a later snapshot of the volume; `changed` is where it differs.
    void update(const Volume& next, std::span<const ChangedBrick> changed);

    const CellRanges& ranges() const { return ranges_; }
    double margin() const { return margin_; } // at least range_margin() of the snapshot
    uint64_t next_generation() { return ++generations_; }

 private:
    CellRanges ranges_;
    double margin_;
    uint64_t generations_ = 0;
};

// The image that rays skip empty space by: one texel (R32F) for each macro-cell of the volume.
//
// Modes alpha and iso: the distance, in cells and on the longest axis, to the nearest cell in which
// something can be seen (occupancy.h). Mode MIP: the highest texel of the cell, or the lowest with
// its sign turned where the smallest value is shown; -infinity where it has no data. From these
// bounds are made for the rays of a tile (shaders/mip_slabs.comp). A new transfer function or
// iso-value costs one pass over the cells, an edit what it changed.
class CellMap {
 public:
    CellMap(GpuDevice& device, std::shared_ptr<VolumeCells> cells)
        : device_(&device), cells_(std::move(cells)) {}

    // Whether it is one for such a layer, but for edits. value = texel * scale + bias.
    bool is_for(const RayCastLayer& layer, float value_scale, float value_bias) const;

    // Makes the image what `layer` needs, where it is not that already; once a frame. `changed` is
    // where the volume of the cells differs from that of the last call (nothing: anywhere); only
    // these cells and those that they lower are worked out. Around cells that became empty,
    // distances stay what they were, which is safe, and are raised over the frames that follow, a
    // few tiles in each.
    void show(const RayCastLayer& layer, float value_scale, float value_bias,
              std::optional<std::span<const ChangedBrick>> changed, Commands& commands);

    // After show() for alpha or iso: the distances; perhaps lower than they could be after edits
    // that take things away.
    const std::vector<uint8_t>& distances() const { return distances_.values(); }
    // A number that changes when show() works out all cells and not just those of an edit; no other
    // map of the volume's has the same.
    uint64_t generation() const { return generation_; }

    // After show().
    GpuImage& image() { return *image_; }
    uint32_t side() const { return shown_->side; }
    glm::uvec3 count() const { return shown_->count; }
    double margin() const { return cells_->margin(); } // of values

    // Cells whose range, occupancy or distance was computed, over all calls.
    uint64_t cells_visited() const { return cells_visited_; }

 private:
    struct Shown { // what the image was made from
        RayMode mode;
        TransferFunction transfer;
        std::vector<double> isos;
        float value_scale, value_bias;
        double margin;
        uint32_t side;
        glm::uvec3 count;
        bool least = false; // MIP: of the smallest value
    };
    const CellRanges& ranges() const { return cells_->ranges(); }
    void show_all(const RayCastLayer& layer, float value_scale, float value_bias,
                  Commands& commands);
    CellBox update_distances(const CellBox& touched);
    void upload(std::span<const CellBox> boxes, Commands& commands);
    float texel_of(glm::uvec3 cell) const;

    GpuDevice* device_;
    std::shared_ptr<VolumeCells> cells_;
    CellDistances distances_;
    VisibleValues visible_{std::span<const double>{}}; // of what is shown, but for MIP
    std::optional<Shown> shown_;
    std::optional<GpuImage> image_;
    uint64_t generation_ = 0, cells_visited_ = 0;
};

} // namespace palpate
