#pragma once

#include <deque>
#include <functional>
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

// Who interpolates between samples.
enum class Sampling {
    device,  // its sampler: fast; positions are rounded to a few units in their last place, and on
             // most graphics cards weights to 8 bits
    by_hand, // the shader, in fp32 and in one order: the same bits however the volume lies
};

struct RendererOptions {
    TexelFormat volume_format = TexelFormat::automatic;
    // For all that is kept on the device; 0 is three quarters of the device's memory.
    uint64_t memory_limit_bytes = 0;
    bool skipping = true; // jump over empty space; changes no bit of a picture
    Residency residency = Residency::automatic;
    size_t most_resident_bricks = 0; // of an atlas, beside what fits; 0: no other limit
    Sampling sampling = Sampling::device;
    // Called while a frame is drawn in several parts, with the share that is done; false stops it.
    std::function<bool(double share)> progress;
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
    // How the volume lies on the device, and why; of an atlas, the bricks that can be seen, those
    // it has room for, and in how many parts the volume was marched.
    bool atlas = false;
    std::string residency_reason;
    size_t needed_bricks = 0, room_for_bricks = 0, parts = 1;
};

// One eye's picture: R, G, B, A and, where the scene asks for them, "value" and "depth".
struct Frame {
    std::vector<Image> eyes; // one, or left and right
    FrameStats stats;
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

    // Brings what is kept in line with the scene; the number of bricks uploaded.
    Result<size_t> prepare(const Scene& scene, const SceneData& data);
    Result<size_t> keep_volume(std::optional<GpuVolume>& held, const char* name,
                               const Volume& volume, const GpuVolumeWish& wish,
                               std::span<const ChangedBrick> changed);
    Result<size_t> keep_volumes(const Scene& scene, const SceneData& data);
    uint64_t free_bytes(std::optional<GpuVolume>& apart) const;
    uint64_t room_for_volume(const Scene& scene);
    void find_needed_bricks(const Scene& scene, const Volume& volume);
    Result<void> plan_atlas(const Scene& scene, const SceneData& data);
    void bind_atlas(std::vector<Bound>& bound, uint32_t pages, uint32_t frame);
    void show_part(const Part& part, bool first);
    Result<size_t> draw_all(const Scene& scene, const SceneData& data,
                            std::deque<Commands>& submissions);
    void keep_targets(const Scene& scene);
    void record_slices(Commands& commands, const Scene& scene);
    void record_background(Commands& commands, const Scene& scene);
    void record_tiles(Commands& commands, const Scene& scene, uint32_t first_row, uint32_t rows);
    void record_ray_cast(Commands& commands, const Scene& scene);
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
