#pragma once

#include <optional>

#include "engine/render/gradient_image.h"
#include "engine/render/mirrored_buffer.h"
#include "engine/render/needed_bricks.h"
#include "engine/render/renderer.h"
#include "engine/render/surface_pass.h"
#include "engine/render/transfer_image.h"
#include "shaders/shared/frame.h"

// What a Renderer keeps between frames. For its own sources only.
namespace palpate {

uint32_t eye_count(const Scene& scene);
uint32_t all_eyes(const Scene& scene); // bit e: eye e
glm::uvec2 tile_count(glm::uvec2 rays);
std::vector<View> views_of(const Scene& scene);

// Rows of tiles that one submission marches: as many as a dispatch has workgroups for, and on a
// device with a watchdog no more than take a moment.
uint32_t tile_rows_per_submission(const GpuDevice& device, const Scene& scene, const Grid& grid);

// Whether its rays take their lattice slab by slab, highest first (shaders/mip_slabs.comp).
bool takes_slabs(const RayCastVariant& variant);
size_t slab_bytes(const Scene& scene);

// Adds the times of passes to those of the same name.
void add_time(std::vector<PassTime>& sums, const PassTime& time);
void add_times(std::vector<PassTime>& sums, const std::vector<PassTime>& times);

// Gives a variable another value for as long as this lives.
template <class T>
class Restored {
 public:
    Restored(T& variable, T value) : variable_(&variable), before_(variable) { variable = value; }
    ~Restored() { *variable_ = before_; }
    Restored(const Restored&) = delete;
    Restored& operator=(const Restored&) = delete;

 private:
    T* variable_;
    T before_;
};

struct Renderer::Targets {
    glm::uvec2 size_px;
    uint32_t eyes;
    bool return_values;                            // the scene asks for value and depth
    std::optional<GpuImage> color, values;         // what is read back
    std::optional<GpuImage> behind, behind_values; // slices and opaque meshes: behind all rays
    std::optional<GpuImage> layers;                // see-through meshes in a ray's way
    std::optional<GpuImage> carry;                 // what rays bring from part to part of an atlas
};

// Rays of one kind: their block, what they are listed in and where their colours go.
struct Renderer::RayPass {
    const char* name;
    RayCastVariant variant;
    glm::uvec2 rays; // across and down
    BufferSlice frame;
    GpuImage* table; // none in mode iso
    GpuImage& color;
    GpuImage* values;             // where the scene asks for value and depth
    Buffer& groups;               // how many workgroups
    Buffer& list;                 // tiles, or rays (kRaysListed)
    Buffer* slabs = nullptr;      // where takes_slabs(variant)
    Buffer* spans = nullptr;      // of the picture's tiles, where rays lie between them
    Buffer* first_hits = nullptr; // of every second pixel, where variant.has_first_hits()
};

// A picture from fewer rays: see CoarseSettings.
struct Renderer::Coarse {
    glm::uvec2 size_px, probes; // of the picture; sparse rays
    uint32_t eyes;
    GpuImage truth, few;              // of sparse rays; of rays more than two pixels apart
    Buffer spans, tile_groups, tiles; // the latter of sparse rays
    Buffer ray_groups, rays_listed, first_hits, squares;
    std::optional<BufferSlice> frame{}, probe_frame{}, few_frame{}, interpolate{}, enlarge{},
        judge{};                             // of this frame
    std::optional<TransferImage> transfer{}; // where the step differs
    uint32_t drawn = 1;                      // frames so far: the sparse rays wander
    glm::uvec2 first_probe{0};
    glm::uvec2 few_rays{0}; // how many of them
};

struct Renderer::Held {
    std::optional<GpuVolume> volume, labels;
    std::optional<GradientImage> gradients;
    std::optional<std::pair<RayCastLayer, double>> gradients_filled_for; // and step factor
    std::optional<CellMap> cells;
    std::optional<Buffer> tile_groups, tiles, slabs;
    double cell_map_ms = 0, gradients_ms = 0;
    std::optional<TransferImage> transfer, slice_transfer;
    gpu::Frame block;                                                   // what `frame` holds
    std::optional<BufferSlice> frame, slice_frame, planes, atlas_frame; // of this frame
    MirroredBuffer styles;
    std::optional<std::pair<LabelLayer, uint32_t>> styles_of; // up to which label
    std::optional<SurfacePass> surfaces;
    std::optional<Targets> targets;
    std::optional<Coarse> coarse;
    RayCastVariant variant;
    // Of a volume in an atlas:
    std::optional<NeededBricks> needed; // also for stored gradients
    bool all_fit = false;               // the atlas has room for all that is needed, and holds it
    size_t needed_bricks = 0;
    std::vector<Part> parts;
};

// What `draw` returns. Where it throws, as for a brick that cannot be read, nothing recorded so far
// may be relied upon: the next frame begins from nothing.
template <class Draw>
auto Renderer::or_from_nothing(const Draw& draw) -> decltype(draw()) {
    try {
        return draw();
    } catch (...) {
        held_ = std::make_unique<Held>();
        throw;
    }
}

} // namespace palpate
