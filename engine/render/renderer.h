#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "engine/base/error.h"
#include "engine/render/changed_pixels.h"
#include "engine/render/frame.h"
#include "engine/render/render_options.h"

namespace palpate {

// The resources that several renderers share on the device.
struct RenderStore;

// Draws scenes with at least one of ray casting, slices and surfaces. Keeps on the device what the
// last scene needed and makes nothing else; the same snapshot is never uploaded twice, and of a
// later one only the bricks that changed.
//
// A renderer draws one view. Renderers with one store draw several views of one volume: volume,
// labels, what rays jump by, surfaces, tables and pipelines lie on the device once; pictures,
// sizes, cameras and layers are each view's own. Their frames may be recorded into the same
// commands. A volume of another size or type replaces the one that is there, for all of them. An
// atlas holds what all views need while it has room for that, else what the drawn view needs. What
// a view needed last stays until it draws something else or is dropped. All belong to one thread.
class Renderer {
 public:
    explicit Renderer(GpuDevice& device, RendererOptions options = {});
    // Another view: Renderer slices(rays.store()). With the options of the first.
    explicit Renderer(std::shared_ptr<RenderStore> store);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    const std::shared_ptr<RenderStore>& store() const { return store_; }

    // Records one frame and waits for nothing but RendererOptions::frames_in_flight, and, where an
    // old volume and its successor do not fit the device together, until the old one is gone.
    // Uploads beyond 4 MiB, long dispatches on a device with a watchdog and the parts of an atlas
    // are submitted on the way; the caller submits the rest, also where this fails, before the next
    // frame is recorded into other commands. Fails with a sentence where the volume does not fit
    // the device.
    Result<RecordedFrame> record(Commands& commands, const Scene& scene, const SceneData& data);

    // Draws a box of pixels alone, with those of the tiles that it touches, at full quality over
    // the view's last frame: for a scene without meshes, and data that changed nothing outside of
    // the box (changed_pixels()). All pixels where no such frame is there. With rays it fails as
    // record_rows() does.
    Result<RecordedFrame> record_changed(Commands& commands, const Scene& scene,
                                         const SceneData& data, const PixelBox& changed);

    // The same from fewer rays, for a hand that is moving. `scene` has a ray-cast layer, and its
    // value_and_depth is left out. Fails, as record_rows() does, where a volume in an atlas is
    // marched in several parts: uploads would take longer than the rays do.
    Result<RecordedCoarse> record_coarse(Commands& commands, const Scene& scene,
                                         const SceneData& data, const CoarseSettings& settings);

    // Draws `rows` rows of tiles (kTileSide pixels high) of the scene over what is there, at full
    // quality. When all rows of tile_rows() have been drawn the picture is that of record().
    Result<RecordedFrame> record_rows(Commands& commands, const Scene& scene, const SceneData& data,
                                      uint32_t first_row, uint32_t rows);
    static uint32_t tile_rows(const Scene& scene);

    // Record, submit and wait: the frame stays on the device, and what it took is known at once.
    Result<FrameStats> draw(const Scene& scene, const SceneData& data);
    Result<CoarseStats> draw_coarse(const Scene& scene, const SceneData& data,
                                    const CoarseSettings& settings);
    Result<FrameStats> refine(const Scene& scene, const SceneData& data, uint32_t first_row,
                              uint32_t rows);
    // For a scene with rays whose meshes are opaque and not live. They may have moved since the
    // last frame; their number and styles are the same.
    Result<FrameStats> redraw(const Scene& scene, const SceneData& data, const PixelBox& changed);

    // Draws the frame once more with a variant that counts how many samples of the volume its rays
    // take. Leaves the same picture.
    Result<uint64_t> count_samples(const Scene& scene, const SceneData& data);

    // The last frame drawn, as RecordedFrame::picture; and a copy of it on the CPU.
    GpuImage& picture();
    std::vector<Image> read_back();

    Result<Frame> render(const Scene& scene, const SceneData& data);

    // Spent on pipelines so far, on threads of their own; and what frames waited for.
    double pipeline_creation_ms() const;
    double pipeline_wait_ms() const;

 private:
    struct Passes; // and the images that they draw into
    struct Task;   // a frame on its way

    template <class Work>
    auto or_from_nothing(const Work& work) -> decltype(work());
    struct Nothing {
        void operator()() const {}
    };
    template <class Work, class Done = Nothing>
    auto drawn(const Work& work, const Done& done = {});
    Result<FrameStats> prepare(Task& task, double step_factor);
    Result<FrameStats> prepare_interactive(Task& task, double step_factor);
    size_t record_behind(Task& task);
    size_t record_meshes_behind(Task& task);
    RecordedFrame recorded(Task& task, FrameStats stats);
    Result<RecordedFrame> record_full(Task task);
    Result<RecordedCoarse> record_few(Task task, const CoarseSettings& settings);
    Result<RecordedFrame> record_only(Task task, bool behind);
    Result<FrameStats> draw_only(const Scene& scene, const SceneData& data, const PixelBox& only,
                                 bool behind);

    std::shared_ptr<RenderStore> store_;
    std::unique_ptr<Passes> passes_;
    std::deque<Ticket> in_flight_; // the last frames, oldest first
};

} // namespace palpate
