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
    by_hand, // the shader, in fp32 and in one order: the same bits as one image and in an atlas
             // that is marched at once (in parts, rays may end within min_transmittance of there)
};

struct RendererOptions {
    TexelFormat volume_format = TexelFormat::automatic;
    // For all that is kept on the device; 0 is three quarters of the device's memory. Mapped memory
    // that uploads and read-backs travel through does not count: mostly one to three times 4 MiB,
    // and what a picture takes that is read back.
    uint64_t memory_limit_bytes = 0;
    bool skipping = true; // jump over empty space; changes no bit of a picture
    Residency residency = Residency::automatic;
    size_t most_resident_bricks = 0; // of an atlas, beside what fits; 0: no other limit
    Sampling sampling = Sampling::device;
    // >= 1: record() waits until the device is past the frame so many before.
    size_t frames_in_flight = 2;
    // Shaded alpha: keep the gradients beside a dense volume (8 bytes a sample), where that fits,
    // so that shading takes one sample and not six. Filling it takes as long as some frames.
    // Colours differ by up to 1e-3, because gradients are then rounded to 11 bits.
    bool stored_gradients = false;
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
    double cell_map_ms = 0;  // CPU time for what is jumped over, where that had to be made
    double gradients_ms = 0; // wall time for stored gradients, where some had to be filled in
    // How the volume lies on the device, and why; of an atlas, the bricks that can be seen, those
    // it has room for, and in how many parts the volume was marched.
    bool atlas = false;
    std::string residency_reason;
    size_t needed_bricks = 0, room_for_bricks = 0, parts = 1;
};

// What a recorded frame will have cost. It must not outlive the device.
class FrameTicket {
 public:
    bool ready() const { return ticket_.ready(); } // never waits
    // After the commands were submitted: waits where not ready(). wall_ms is 0: who submits knows
    // when the work began.
    FrameStats stats() const;

 private:
    friend class Renderer;
    FrameTicket(Ticket ticket, FrameStats known, size_t first, size_t last)
        : ticket_(std::move(ticket)), known_(std::move(known)), first_(first), last_(last) {}
    Ticket ticket_;
    FrameStats known_;
    size_t first_, last_; // its passes among those of the commands
};

// A frame that was recorded. The images stay the renderer's and hold the frame for what is recorded
// into the same commands before the renderer's next frame.
struct RecordedFrame {
    GpuImage* picture; // RGBA, display values (image.h), a layer an eye
    GpuImage* values;  // value and depth; null where the scene does not ask for them
    FrameTicket ticket;
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
    // Every second pixel both ways has a ray. Between four rays that differ by more than this, the
    // other pixels have rays, too; elsewhere they take the mean of their neighbours. What counts is
    // the root of the mean square between neighbours over the colour's channels (0 .. 1), and half
    // of what no mean of two rays fits: a - b - c + d of the channel where that is largest. Left
    // out, it is 0.06, and 0.115 between iso-surfaces, which are smooth from edge to edge, so that
    // a mean errs less (docs/log/rendering.md).
    // Of iso-surfaces (but with the exact integrator, or among see-through meshes) a ray between
    // four others begins two steps before the nearest of what these meet: what is thinner than two
    // pixels and lies in front of all that may be missed. refine() shows it; error_estimate counts
    // it.
    std::optional<double> contrast{};
    // 2: as above. 4, 8 or 16: rays lie so many pixels apart both ways, and there are no others.
    uint32_t px_per_ray = 2;
};

// The rays that an interactive frame is judged by lie this many pixels apart both ways: odd, for
// every other one has a ray anyhow.
inline constexpr uint32_t kJudgedSpacing_px = 19;

struct CoarseStats {
    FrameStats frame;
    // RMSE of the picture's colours (1 is white), from rays of full quality through one pixel in
    // kJudgedSpacing_px squared: every such one both ways from `first_judged` on, which wanders
    // from frame to frame.
    double error_estimate = 0;
    glm::uvec2 first_judged{0};
    double traced_share = 0; // of the pixels: those with rays of their own; empty tiles have none
                             // (but are counted where px_per_ray is above 2)
};

// Draws scenes with at least one of ray casting, slices and surfaces. Keeps on the GPU what the
// last scene needed and makes nothing else; the same snapshot is never uploaded twice, and of a
// later one only the bricks that changed.
class Renderer {
 public:
    explicit Renderer(GpuDevice& device, RendererOptions options = {});
    ~Renderer();

    // Records one frame and waits for nothing but RendererOptions::frames_in_flight. Uploads beyond
    // 4 MiB, long dispatches on a device with a watchdog and the parts of an atlas are submitted on
    // the way; the caller submits the rest, also where this fails, before the next frame is
    // recorded into other commands.
    Result<RecordedFrame> record(Commands& commands, const Scene& scene, const SceneData& data);

    // Draws one frame and leaves it on the GPU; `stats` says what that took. Fails with a sentence
    // where the volume does not fit the device.
    Result<FrameStats> draw(const Scene& scene, const SceneData& data);

    // The same from fewer rays, for a hand that is moving. `scene` has a ray-cast layer, and its
    // value_and_depth is left out. Fails, as refine() does, where a volume in an atlas is marched
    // in several parts: uploads would take longer than the rays do.
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

    // Spent on pipelines so far, on threads of their own; and what frames waited for.
    double pipeline_creation_ms() const { return pipelines_.creation_ms(); }
    double pipeline_wait_ms() const { return pipelines_.wait_ms(); }

 private:
    struct Targets; // the images a frame is drawn into
    struct Held;    // everything kept on the GPU between frames
    struct RayPass;
    struct Coarse;

    template <class Draw>
    auto or_from_nothing(const Draw& draw) -> decltype(draw());
    Result<FrameStats> draw_frame(const Scene& scene, const SceneData& data);
    Result<RecordedFrame> record_frame(Commands& commands, const Scene& scene,
                                       const SceneData& data);
    // After prepare(), which uploaded so many bricks: all passes, and what is known of them so far.
    Result<FrameStats> record_passes(Commands& commands, const Scene& scene, const SceneData& data,
                                     size_t uploaded);
    // Before anything is recorded: waits for frames in flight.
    void begin_frame(const Commands& commands);
    Result<CoarseStats> draw_coarse_frame(const Scene& asked, const SceneData& data,
                                          const CoarseSettings& settings);
    Result<FrameStats> refine_rows(const Scene& asked, const SceneData& data, uint32_t first_row,
                                   uint32_t rows);
    // Brings what is kept in line with the scene, by copies recorded into `commands`, which are
    // submitted even where this fails; the number of bricks uploaded.
    Result<size_t> prepare(const Scene& scene, const SceneData& data, Commands& commands);
    Result<size_t> prepare_interactive(const Scene& scene, const SceneData& data,
                                       double step_factor, Commands& commands);
    Result<size_t> keep_volume(std::optional<GpuVolume>& held, const char* name,
                               const Volume& volume, GpuVolumeWish wish,
                               std::span<const ChangedBrick> changed, Commands& commands);
    Result<size_t> keep_volumes(const Scene& scene, const SceneData& data, Commands& commands);
    void keep_gradients(const Scene& scene, const Volume& volume, Commands& commands);
    // Waits until what is recorded is done: what is dropped then makes room at once.
    void finish(Commands& commands);
    // prepare() for frames that are timed: where uploads did not fit the frame's own submission, it
    // waits until the device has them.
    Result<size_t> prepare_and_wait(const Scene& scene, const SceneData& data, Commands& commands);
    uint64_t free_bytes(std::optional<GpuVolume>& apart) const;
    uint64_t room_for_volume(const Scene& scene);
    void find_needed_bricks(const Scene& scene, const Volume& volume,
                            std::span<const ChangedBrick> changed);
    size_t show_needed(Commands& commands);
    bool wants_gradients(const Scene& scene) const;
    Result<void> plan_atlas(const Scene& scene, const SceneData& data);
    void bind_atlas(std::vector<Bound>& bound, uint32_t pages, uint32_t frame);
    // Of an atlas: brings a part's bricks into it, for passes recorded from here on. Returns how
    // many bricks were uploaded.
    size_t show_part(const Part& part, bool first, Commands& commands);
    void tell_residency(FrameStats& stats) const;
    void drop_volumes();
    Result<void> keep_surfaces(const Scene& scene, const SceneData& data, Commands& commands);
    // Slices, meshes and background: what rays are cast before.
    size_t draw_behind(const Scene& scene, const SceneData& data, Commands& commands);
    Result<size_t> draw_rays(const Scene& scene, const SceneData& data, Commands& commands);
    void keep_targets(const Scene& scene);
    // Asks for the pipelines that a first frame is likely to need, to be made while volumes are
    // uploaded. One too many costs a thread its time.
    void begin_pipelines(const Scene& scene, const SceneData& data);
    void keep_coarse_targets(const Scene& scene);
    void keep_coarse(const Scene& scene, const SceneData& data, const CoarseSettings& settings,
                     Commands& commands);
    uint32_t tiles_to_list(const Scene& scene) const; // gpu::kList...
    Buffer* slabs(const Scene& scene); // for a pass of at most a ray a pixel; none where not taken
    RayPass full_pass(const Scene& scene);
    void record_slices(Commands& commands, const Scene& scene);
    void record_surfaces(Commands& commands, const Scene& scene);
    void record_background(Commands& commands, const Scene& scene);
    void record_tiles(Commands& commands, RayPass& pass, uint32_t eyes, uint32_t which,
                      uint32_t first_row, uint32_t rows);
    void record_ray_cast(Commands& commands, const RayPass& pass, const Scene& scene);
    void record_interpolation(Commands& commands, const Scene& scene);
    void record_few_rays(Commands& commands, const Scene& scene, RayPass every_second,
                         uint32_t which);
    void record_judgement(Commands& commands);
    uint64_t read_sample_counts();

    GpuDevice* device_;
    RendererOptions options_;
    bool counting_ = false;    // within count_samples()
    double step_factor_ = 1.0; // of the longest steps; more within draw_coarse()
    struct Listed {            // tiles that were marched, and their number
        BufferSlice tiles, groups;
    };
    std::vector<Listed> listed_; // while counting
    uint64_t samples_ = 0;
    Pipelines pipelines_;
    Sampler linear_, nearest_, label_sampler_;
    std::deque<Ticket> in_flight_; // the last frames, oldest first
    std::unique_ptr<Held> held_;
};

} // namespace palpate
