#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/gpu/commands.h"
#include "engine/image/image.h"
#include "engine/render/cell_map.h"
#include "engine/render/gpu_volume.h"
#include "engine/render/pipelines.h"
#include "engine/scene/scene.h"

namespace palpate {

struct RendererOptions {
    TexelFormat volume_format = TexelFormat::automatic;
    uint64_t memory_limit_bytes = 0; // for volumes; 0 is three quarters of the device's memory
    bool skipping = true;            // jump over empty space; changes no bit of a picture
};

// How many segments of the sample lattice lie inside the volume's box, over all rays of a picture:
// what a ray caster that skips and stops nowhere would sample. Clip planes and slices left out.
uint64_t count_segments(const Scene& scene, const Grid& grid);

// What one frame cost.
struct FrameStats {
    std::vector<PassTime> passes; // GPU time of each, in order
    double wall_ms = 0;           // from recording to the GPU's last word, fenced
    size_t uploaded_bricks = 0;
    double cell_map_ms = 0; // CPU time for what is jumped over, where that had to be made
};

// One eye's picture: R, G, B, A and, where the scene asks for them, "value" and "depth".
struct Frame {
    std::vector<Image> eyes; // one, or left and right
    FrameStats stats;
};

// How a picture is made from fewer rays than it has pixels.
struct CoarseSettings {
    // Steps this much longer than the scene's; >= 1. The exact integrator has none to lengthen.
    double step_factor = 1.0;
    // Every second pixel both ways has a ray. Between rays that differ by more than this in some
    // channel (0 .. 1), the others have rays, too; elsewhere they take the mean of their
    // neighbours.
    double contrast = 0.06;
};

struct CoarseStats {
    FrameStats frame;
    // RMSE of the picture's colours (1 is white), from rays of full quality through one pixel in
    // 225, other ones in each frame.
    double error_estimate = 0;
    double traced_share = 0; // of the pixels: those with rays of their own
};

// Draws scenes. Keeps on the GPU what the last scene needed and makes nothing else; the same
// snapshot is never uploaded twice, and of a later one only the bricks that changed.
class Renderer {
 public:
    explicit Renderer(Device& device, RendererOptions options = {});
    ~Renderer();

    // Draws one frame and leaves it on the GPU; `stats` says what that took. Fails with a sentence
    // where the volume does not fit the device.
    Result<FrameStats> draw(const Scene& scene, const SceneData& data);

    // The same from fewer rays, for a hand that is moving. `scene` has a ray-cast layer, and its
    // value_and_depth is left out.
    Result<CoarseStats> draw_coarse(const Scene& scene, const SceneData& data,
                                    const CoarseSettings& settings);

    // Draws `rows` rows of tiles (kTileSide pixels high) of the scene over what is there, at full
    // quality. When all rows of tile_rows() have been drawn the picture is that of draw().
    Result<FrameStats> refine(const Scene& scene, const SceneData& data, uint32_t first_row,
                              uint32_t rows);
    static uint32_t tile_rows(const Scene& scene);

    // Draws the frame once more with a variant that counts how many samples of the volume its rays
    // take. Leaves the same picture.
    Result<uint64_t> count_samples(const Scene& scene, const SceneData& data);

    // Copies the last frame drawn to the CPU.
    std::vector<Image> read_back();

    Result<Frame> render(const Scene& scene, const SceneData& data);

    double pipeline_creation_ms() const { return pipelines_.creation_ms(); }

 private:
    struct Targets; // the images a frame is drawn into
    struct Held;    // everything kept on the GPU between frames
    struct RayPass;
    struct Coarse;

    // Brings what is kept in line with the scene; the number of bricks uploaded.
    Result<size_t> prepare(const Scene& scene, const SceneData& data);
    Result<size_t> keep_volume(std::optional<GpuVolume>& held, std::optional<CellMap>* cells,
                               const char* name, const Volume& volume, TexelFormat format,
                               uint64_t limit_bytes);
    void keep_targets(const Scene& scene);
    void keep_cells(const RayCastLayer& layer, const Volume& volume);
    void keep_coarse(const Scene& scene, const SceneData& data, const CoarseSettings& settings);
    uint32_t tiles_to_list(const Scene& scene) const; // gpu::kList...
    RayPass full_pass(const Scene& scene);
    void record_slices(Commands& commands, const Scene& scene);
    void record_background(Commands& commands, const Scene& scene);
    void record_tiles(Commands& commands, RayPass& pass, uint32_t eyes, uint32_t which,
                      uint32_t first_row, uint32_t rows);
    void record_ray_cast(Commands& commands, const RayPass& pass, const Scene& scene);
    void record_interpolation(Commands& commands, const Scene& scene);
    void record_judgement(Commands& commands);
    uint64_t read_sample_count();

    Device* device_;
    RendererOptions options_;
    bool counting_ = false; // within count_samples()
    uint64_t samples_ = 0;
    Pipelines pipelines_;
    Sampler linear_, nearest_, label_sampler_;
    std::unique_ptr<Held> held_;
};

} // namespace palpate
