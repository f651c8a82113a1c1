#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "engine/base/error.h"
#include "engine/render/changed_pixels.h"
#include "engine/render/frame.h"
#include "engine/render/render_options.h"

namespace palpate {

class Timer;

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

    // Records a frame of what is asked for and waits for nothing but
    // RendererOptions::frames_in_flight, and, where an old volume and its successor do not fit the
    // device together, until the old one is gone. Uploads beyond 4 MiB, long dispatches on a device
    // with a watchdog and the parts of an atlas are submitted on the way; the caller submits the
    // rest, also where this fails, before the next frame is recorded into other commands. Fails
    // with a sentence where the volume does not fit the device; with rays and anything but a whole
    // picture asked for also where a volume in an atlas is marched in several parts: uploads would
    // take longer than the rays do.
    Result<RecordedFrame> record(Commands& commands, const Scene& scene, const SceneData& data,
                                 const Request& request = WholePicture{});

    // Records, submits and waits: the frame stays on the device, and its cost is known at once.
    Result<FrameStats> draw(const Scene& scene, const SceneData& data,
                            const Request& request = WholePicture{});

    static uint32_t tile_rows(const Scene& scene); // that TileRows counts

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
    Result<FrameStats> prepare(Task& task, double step_factor);
    Result<FrameStats> prepare_interactive(Task& task, double step_factor);
    size_t record_behind(Task& task);
    size_t record_meshes_behind(Task& task);
    RecordedFrame recorded(Task& task, FrameStats stats);
    Result<RecordedFrame> record_full(Task& task);
    Result<RecordedFrame> record_few(Task& task, const CoarseSettings& settings);
    Result<RecordedFrame> record_only(Task& task, bool behind);
    Result<RecordedFrame> record_request(Task& task, const Request& request);
    Result<FrameStats> wait_for(Commands& commands, const Timer& timer,
                                Result<RecordedFrame> recorded);

    std::shared_ptr<RenderStore> store_;
    std::unique_ptr<Passes> passes_;
    std::deque<Ticket> in_flight_; // the last frames, oldest first
};

} // namespace palpate
