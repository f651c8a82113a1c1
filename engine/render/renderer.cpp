#include "engine/render/renderer.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/render/coarse_pass.h"
#include "engine/render/ray_cast_pass.h"
#include "engine/render/slice_pass.h"
#include "engine/render/surface_pass.h"
#include "engine/volume/thickness.h"
#include "shaders/shared/tiles.h"

namespace palpate {

// A pass is there when the last scene had a layer for it.
struct Renderer::Passes {
    explicit Passes(RenderStore& store) : voxels(store.volume) {}
    VolumeUse voxels;
    std::shared_ptr<LabelStyles> styles, overlay_styles;
    std::optional<Targets> targets;
    std::optional<SurfacePass> surfaces;
    std::optional<SlicePass> slices;
    std::optional<RayCastPass> ray_cast;
    std::optional<CoarsePass> coarse;
};

struct Renderer::Task {
    Commands& commands;
    const Scene& scene;
    SceneData data;         // of a volume one sample thick, its thickened one
    Timer* timer = nullptr; // where somebody waits: begins when uploads are through
    bool counts_samples = false;
    std::optional<PixelBox> only{}; // over the frame before; none: all
    std::vector<View> views = views_of(scene);
    size_t first_pass = commands.pass_count();
    std::optional<ViewFrame> frame{};
};

Renderer::Renderer(GpuDevice& device, RendererOptions options)
    : Renderer(std::make_shared<RenderStore>(device, std::move(options))) {}

Renderer::Renderer(std::shared_ptr<RenderStore> store)
    : store_(std::move(store)), passes_(std::make_unique<Passes>(*store_)) {
    store_->views.push_back(this);
}

Renderer::~Renderer() {
    store_->styles.drop(passes_->styles);
    store_->styles.drop(passes_->overlay_styles);
    std::erase(store_->views, this);
}

uint32_t Renderer::tile_rows(const Scene& scene) {
    return tile_count(scene.size_px).y;
}

double Renderer::pipeline_creation_ms() const {
    return store_->pipelines.creation_ms();
}

double Renderer::pipeline_wait_ms() const {
    return store_->pipelines.wait_ms();
}

FrameStats FrameTicket::stats() const {
    FrameStats stats = known_;
    const std::vector<PassTime> times = ticket_.times();
    for (const size_t i : ray_passes_)
        stats.ray_ms += times[i].gpu_ms;
    for (size_t i = first_; i < last_; ++i) { // those of the same name added up
        const auto same = std::find_if(stats.passes.begin(), stats.passes.end(),
                                       [&](const PassTime& p) { return p.name == times[i].name; });
        if (same != stats.passes.end())
            same->gpu_ms += times[i].gpu_ms;
        else
            stats.passes.push_back(times[i]);
    }
    if (coarse_)
        stats.coarse = coarse_->stats();
    return stats;
}

// Brings what is kept in line with the scene, by copies recorded into the commands.
Result<FrameStats> Renderer::prepare(Task& task, double step_factor) {
    const profile::Scope scope("prepare");
    task.data.volume = thickened(task.data.volume);
    const auto& [scene, data] = std::tie(task.scene, task.data);
    PALPATE_ASSERT(scene.ray_cast || !scene.slices.empty() || !scene.surfaces.empty());
    PALPATE_ASSERT(scene.labels.has_value() == data.labels.has_value());
    PALPATE_ASSERT(scene.fusion.has_value() == data.fused.has_value());
    PALPATE_ASSERT(scene.overlay.has_value() == data.overlay.has_value());
    PALPATE_ASSERT_CMP(scene.surfaces.size(), ==, data.meshes.size());
    PALPATE_ASSERT_CMP(scene.surfaces.size(), <=, kMaxSurfaces);
    PALPATE_ASSERT(scene.surface_depth >= 1 && scene.surface_depth <= kMaxSurfaceDepth);
    // Waits for nothing but the frame so many before.
    while (in_flight_.size() >= std::max<size_t>(1, store_->options.frames_in_flight)) {
        in_flight_.front().wait();
        in_flight_.pop_front();
    }
    in_flight_.push_back(task.commands.ticket());
    const uint64_t submitted = store_->device.last_submitted();
    if (scene.ray_cast)
        PALPATE_TRY(check_steps(*scene.ray_cast, data.volume.grid()));
    Passes& passes = *passes_;
    if (scene.surfaces.empty())
        passes.surfaces.reset();
    else if (!passes.surfaces)
        passes.surfaces.emplace(*store_);
    if (passes.surfaces)
        PALPATE_TRY(passes.surfaces->prepare(scene, data, task.commands));
    const bool see_through = passes.surfaces && passes.surfaces->has_see_through();
    if (!passes.targets || !passes.targets->suit(scene, see_through)) {
        passes.targets.reset();
        passes.targets.emplace(store_->device, scene, see_through);
        task.only.reset();
    }
    const bool among_layers = passes.targets->layers.has_value();

    FrameStats stats;
    stats.made_blocks = passes.surfaces ? passes.surfaces->made_blocks() : 0;
    VolumeResidency::Wish wish;
    if (!scene.ray_cast) {
        passes.ray_cast.reset();
        passes.coarse.reset();
    } else {
        if (!passes.ray_cast)
            passes.ray_cast.emplace(*store_);
        wish = passes.ray_cast->begin(scene, data, among_layers, step_factor);
    }
    if (scene.slices.empty())
        passes.slices.reset();
    else if (!passes.slices)
        passes.slices.emplace(*store_);
    if (scene.ray_cast || passes.slices) {
        PALPATE_TRY(stats.uploaded_bricks,
                    store_->volume.prepare(passes.voxels, scene, data, wish, task.commands));
    } else {
        passes.voxels.leave();
    }
    if (data.labels && passes.voxels.shows_voxels())
        store_->take_styles(passes.styles, *scene.labels, *data.labels, task.commands);
    else
        store_->styles.drop(passes.styles);
    if (data.overlay && passes.slices)
        store_->take_styles(passes.overlay_styles, *scene.overlay, *data.overlay, task.commands);
    else
        store_->styles.drop(passes.overlay_styles);
    task.frame.emplace(ViewFrame{scene, data, task.views, task.commands, *passes.targets,
                                 passes.voxels, passes.styles.get(), step_factor,
                                 passes.overlay_styles.get()});
    if (passes.ray_cast)
        passes.ray_cast->prepare(*task.frame, task.counts_samples);
    if (passes.slices)
        passes.slices->prepare(*task.frame);
    PALPATE_TRY(passes.voxels.plan(scene, task.views, step_factor, among_layers));
    passes.voxels.tell(stats);
    if (task.timer) {
        if (store_->device.last_submitted() > submitted) { // uploads that did not fit this frame's
            task.commands.flush();
            store_->device.wait(store_->device.last_submitted());
        }
        *task.timer = Timer();
    }
    return stats;
}

// Slices, meshes and background: what rays are cast before.
size_t Renderer::record_behind(Task& task) {
    const ViewFrame& frame = *task.frame;
    Targets& targets = frame.targets;
    const size_t uploaded = passes_->slices ? passes_->slices->record(frame, task.only) : 0;
    if (passes_->surfaces) {
        if (!passes_->slices)
            targets.clear_behind(task.scene, task.commands);
        passes_->surfaces->record(frame, {*targets.behind, *targets.behind_values, *targets.color,
                                          targets.values ? &*targets.values : nullptr,
                                          targets.layers ? &*targets.layers : nullptr});
    } else if (passes_->ray_cast) {
        targets.record_background(task.scene, task.commands);
    }
    return uploaded;
}

// The same of a scene with meshes, all opaque, for a picture of which some pixels are drawn anew:
// meshes may have moved.
size_t Renderer::record_meshes_behind(Task& task) {
    PALPATE_ASSERT(!passes_->surfaces->has_see_through());
    Targets& targets = task.frame->targets;
    const size_t uploaded = passes_->slices ? passes_->slices->record(*task.frame, task.only) : 0;
    if (!task.only && !passes_->slices)
        targets.clear_behind(task.scene, task.commands);
    passes_->surfaces->record(
        *task.frame, {*targets.behind, *targets.behind_values, *targets.behind, nullptr, nullptr},
        task.only);
    return uploaded;
}

RecordedFrame Renderer::recorded(Task& task, FrameStats stats) {
    Targets& targets = *passes_->targets;
    FrameTicket ticket(task.commands.ticket(), std::move(stats), task.first_pass,
                       task.commands.pass_count());
    if (passes_->ray_cast)
        ticket.ray_passes_ = passes_->ray_cast->take_timed();
    return {&*targets.color, targets.returned_values(), std::move(ticket)};
}

Result<RecordedFrame> Renderer::record_full(Task& task) {
    PALPATE_TRY(FrameStats stats, prepare(task, 1.0));
    stats.uploaded_bricks += record_behind(task);
    if (passes_->ray_cast) {
        PALPATE_TRY(const size_t uploaded, passes_->ray_cast->record(*task.frame));
        stats.uploaded_bricks += uploaded;
    }
    return recorded(task, std::move(stats));
}

// prepare() for frames that have no time for several parts.
Result<FrameStats> Renderer::prepare_interactive(Task& task, double step_factor) {
    Result<FrameStats> stats = prepare(task, step_factor);
    if (stats && stats->parts > 1)
        return fail(
            "an interactive frame: expected room on the device for the {} bricks that can be seen, "
            "found room for {}",
            stats->needed_bricks, stats->room_for_bricks);
    return stats;
}

Result<RecordedFrame> Renderer::record_few(Task& task, const CoarseSettings& settings) {
    PALPATE_ASSERT(task.scene.ray_cast.has_value());
    PALPATE_ASSERT(settings.px_per_ray == 2 || settings.px_per_ray == 4 ||
                   settings.px_per_ray == 8 || settings.px_per_ray == 16);
    std::optional<CoarsePass>& coarse = passes_->coarse;
    if (!coarse || !coarse->suits(task.scene)) { // first: the volume takes what is left
        coarse.reset();
        coarse.emplace(*store_, task.scene);
    }
    PALPATE_TRY(FrameStats stats,
                prepare_interactive(task, CoarsePass::step_factor(*task.scene.ray_cast, settings)));
    stats.uploaded_bricks += record_behind(task);
    // slices may show other bricks than rays
    stats.uploaded_bricks += passes_->voxels.show_part(0, task.commands);
    const CoarseRays rays = coarse->record(*task.frame, *passes_->ray_cast, settings);
    RecordedFrame frame = recorded(task, std::move(stats));
    frame.ticket.coarse_ = rays;
    return frame;
}

// Rays at full quality through some pixels' tiles, over what is there. `behind`: and the slices
// behind them.
Result<RecordedFrame> Renderer::record_only(Task& task, bool behind) {
    PALPATE_ASSERT(task.scene.ray_cast.has_value());
    PALPATE_TRY(FrameStats stats, prepare_interactive(task, 1.0));
    if (behind && passes_->surfaces)
        stats.uploaded_bricks += record_meshes_behind(task);
    else if (behind && passes_->slices)
        stats.uploaded_bricks += passes_->slices->record(*task.frame, task.only);
    stats.uploaded_bricks += passes_->voxels.show_part(0, task.commands);
    const PixelBox box = task.only.value_or(PixelBox{glm::uvec2(0), task.scene.size_px});
    passes_->ray_cast->record_tiles(*task.frame, {box.low / gpu::kTileSide, tile_count(box.high)});
    return recorded(task, std::move(stats));
}

namespace {

// Value and depth are those of a full picture alone.
Scene without_values(Scene scene) {
    scene.value_and_depth = false;
    return scene;
}

// `changed` is of the samples alone, beside which a volume one sample thick is drawn, too.
PixelBox pixels_to_draw(const Scene& scene, const SceneData& data, const PixelBox& changed) {
    return is_thin(data.volume.grid()) ? PixelBox{glm::uvec2(0), scene.size_px} : changed;
}

PixelBox rows_of(const Scene& scene, const TileRows& rows) {
    const uint32_t side = gpu::kTileSide, end = rows.first + rows.count;
    PALPATE_ASSERT_CMP(end, <=, Renderer::tile_rows(scene));
    return {{0, rows.first * side}, {scene.size_px.x, std::min(end * side, scene.size_px.y)}};
}

// The scene as a request asks for it, where that is not the scene itself.
std::optional<Scene> asked_of(const Scene& scene, const Request& request) {
    if (std::holds_alternative<WholePicture>(request) || !scene.ray_cast || !scene.value_and_depth)
        return std::nullopt;
    return without_values(scene);
}

} // namespace

// Returns what `work` returns. If it throws, as for a brick that cannot be read, nothing recorded
// so far may be relied upon: the next frame of every view begins from nothing.
template <class Work>
auto Renderer::or_from_nothing(const Work& work) -> decltype(work()) {
    try {
        return work();
    } catch (...) {
        store_->forget();
        for (Renderer* const view : store_->views)
            view->passes_ = std::make_unique<Passes>(*store_);
        throw;
    }
}

Result<RecordedFrame> Renderer::record_request(Task& task, const Request& request) {
    return or_from_nothing([&]() -> Result<RecordedFrame> {
        if (const auto* const coarse = std::get_if<CoarseSettings>(&request))
            return record_few(task, *coarse);
        if (const auto* const rows = std::get_if<TileRows>(&request)) {
            task.only = rows_of(task.scene, *rows);
            return record_only(task, false);
        }
        if (const auto* const changed = std::get_if<ChangedPixels>(&request)) {
            if (task.scene.ray_cast || task.scene.surfaces.empty()) // meshes alone are drawn whole
                task.only = pixels_to_draw(task.scene, task.data, changed->box);
            if (task.scene.ray_cast)
                return record_only(task, true);
        }
        return record_full(task);
    });
}

// Submits what was recorded and waits for it.
Result<FrameStats> Renderer::wait_for(Commands& commands, const Timer& timer,
                                      Result<RecordedFrame> recorded) {
    commands.submit(); // also of a frame that failed: images are as tracked
    if (!recorded)
        return pass_on(recorded);
    FrameStats stats = recorded->ticket.stats();
    stats.wall_ms = timer.ms();
    return stats;
}

Result<RecordedFrame> Renderer::record(Commands& commands, const Scene& scene,
                                       const SceneData& data, const Request& request) {
    constexpr std::array<const char*, std::variant_size_v<Request>> kScopes{
        "record a frame", "record changed pixels", "record rows", "record a coarse frame"};
    const profile::Scope scope(kScopes[request.index()]);
    const std::optional<Scene> asked = asked_of(scene, request);
    Task task{.commands = commands, .scene = asked ? *asked : scene, .data = data};
    return record_request(task, request);
}

Result<FrameStats> Renderer::draw(const Scene& scene, const SceneData& data,
                                  const Request& request) {
    profile::Scope scope("frame");
    const std::optional<Scene> asked = asked_of(scene, request);
    Commands commands(store_->device);
    Timer timer;
    Task task{.commands = commands, .scene = asked ? *asked : scene, .data = data, .timer = &timer};
    Result<FrameStats> stats = wait_for(commands, timer, record_request(task, request));
    if (stats && scope.recorded())
        scope.tell("wall_ms", stats->wall_ms);
    return stats;
}

Result<uint64_t> Renderer::count_samples(const Scene& scene, const SceneData& data) {
    Commands commands(store_->device);
    Timer timer;
    Task task{.commands = commands,
              .scene = scene,
              .data = data,
              .timer = &timer,
              .counts_samples = true};
    PALPATE_TRY(wait_for(commands, timer, record_request(task, WholePicture{})));
    return passes_->ray_cast->read_sample_counts();
}

GpuImage& Renderer::picture() {
    PALPATE_ASSERT(passes_->targets.has_value());
    return *passes_->targets->color;
}

std::vector<Image> Renderer::read_back() {
    const profile::Scope scope("read back");
    PALPATE_ASSERT(passes_->targets.has_value());
    Targets& targets = *passes_->targets;
    const size_t pixels = size_t{targets.size_px.x} * targets.size_px.y;
    Commands commands(store_->device);
    const auto fetch = [&](GpuImage& image, size_t channels) {
        const Commands::Region region{.buffer_offset = 0,
                                      .image_offset = {},
                                      .size = {targets.size_px, 1},
                                      .layers = targets.eyes};
        const BufferSlice bytes = commands.read_back(
            image, std::span(&region, 1), pixels * targets.eyes * channels * sizeof(float));
        return reinterpret_cast<const float*>(bytes.mapped().data());
    };
    const float* const color = fetch(*targets.color, 4);
    const float* const values = targets.return_values ? fetch(*targets.values, 2) : nullptr;
    commands.submit();
    commands.finish();
    std::vector<std::string> channels{"R", "G", "B", "A"};
    if (targets.return_values)
        channels.insert(channels.end(), {"value", "depth"});
    std::vector<Image> eyes;
    for (uint32_t eye = 0; eye < targets.eyes; ++eye) {
        Image image = make_image(targets.size_px, channels);
        for (size_t p = 0; p < pixels; ++p) {
            float* out = &image.samples[p * channels.size()];
            std::copy_n(&color[(eye * pixels + p) * 4], 4, out);
            if (targets.return_values)
                std::copy_n(&values[(eye * pixels + p) * 2], 2, out + 4);
        }
        eyes.push_back(std::move(image));
    }
    return eyes;
}

Result<Frame> Renderer::render(const Scene& scene, const SceneData& data) {
    PALPATE_TRY(FrameStats stats, draw(scene, data));
    return Frame{read_back(), std::move(stats)};
}

} // namespace palpate
