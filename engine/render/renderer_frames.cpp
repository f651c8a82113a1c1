// A frame from its first command to its picture: recorded for the caller, or drawn and waited for.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/render/held.h"
#include "shaders/shared/tiles.h"

namespace palpate {

void add_time(std::vector<PassTime>& sums, const PassTime& time) {
    const auto same = std::find_if(sums.begin(), sums.end(),
                                   [&](const PassTime& p) { return p.name == time.name; });
    if (same != sums.end())
        same->gpu_ms += time.gpu_ms;
    else
        sums.push_back(time);
}

void add_times(std::vector<PassTime>& sums, const std::vector<PassTime>& times) {
    for (const PassTime& time : times)
        add_time(sums, time);
}

uint64_t count_segments(const Scene& scene, const Grid& grid) {
    const double step = step_mm_of(*scene.ray_cast, grid);
    const glm::dmat4 to_index = index_from_world(grid);
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    uint64_t count = 0;
    for (const View& view : views_of(scene))
        for (uint32_t y = 0; y < scene.size_px.y; ++y)
            for (uint32_t x = 0; x < scene.size_px.x; ++x) {
                const Ray ray = ray_through(view, {x, y}, scene.size_px);
                const glm::dvec3 origin = index_point(grid, ray.origin_mm);
                const glm::dvec3 direction = glm::dmat3(to_index) * ray.direction;
                double near = 0.0, far = std::numeric_limits<double>::infinity();
                for (int axis = 0; axis < 3; ++axis) {
                    if (direction[axis] == 0.0) {
                        if (origin[axis] < 0.0 || origin[axis] > last[axis])
                            far = -1.0;
                        continue;
                    }
                    const double a = -origin[axis] / direction[axis];
                    const double b = (last[axis] - origin[axis]) / direction[axis];
                    near = std::max(near, std::min(a, b));
                    far = std::min(far, std::max(a, b));
                }
                if (near < far)
                    count += static_cast<uint64_t>(std::ceil(far / step) - std::floor(near / step));
            }
    return count;
}

Result<size_t> Renderer::prepare_and_wait(const Scene& scene, const SceneData& data,
                                          Commands& commands) {
    const uint64_t before = device_->last_submitted();
    Result<size_t> uploaded = prepare(scene, data, commands);
    if (uploaded && device_->last_submitted() > before)
        finish(commands);
    return uploaded;
}

void Renderer::finish(Commands& commands) {
    commands.flush();
    device_->wait(device_->last_submitted());
}

// Of the frame that was drawn last; the commands that read it back still live.
uint64_t Renderer::read_sample_counts() {
    uint64_t samples = 0;
    for (const Listed& listed : listed_) {
        uint32_t count = 0;
        std::memcpy(&count, listed.groups.mapped().data(), sizeof count);
        for (uint32_t i = 0; i < count; ++i) {
            gpu::TileEntry entry;
            std::memcpy(&entry, listed.tiles.mapped().data() + i * sizeof entry, sizeof entry);
            samples += entry.samples;
        }
    }
    listed_.clear();
    return samples;
}

Result<size_t> Renderer::draw_rays(const Scene& scene, const SceneData& data, Commands& commands) {
    const uint32_t rows = tile_rows(scene);
    const uint32_t band = tile_rows_per_submission(*device_, scene, data.volume.grid());
    RayPass pass = full_pass(scene);
    const bool atlas = held_->volume->is_atlas();
    const size_t parts = atlas ? held_->parts.size() : 1;
    size_t uploaded = 0;
    for (size_t part = 0; part < parts; ++part) {
        if (parts > 1) {
            const double share = static_cast<double>(part) / static_cast<double>(parts);
            if (options_.progress && !options_.progress(share))
                return fail("drawing was stopped after {} of {} parts", part, parts);
            commands.flush(); // the device draws one part while the next is read
        }
        if (atlas)
            uploaded += show_part(held_->parts[part], part == 0, commands);
        for (uint32_t row = 0; row < rows; row += band) {
            if (row > 0)
                commands.flush();
            record_tiles(commands, pass, eye_count(scene), tiles_to_list(scene), row,
                         std::min(band, rows - row));
            record_ray_cast(commands, pass, scene);
            if (counting_)
                listed_.push_back(
                    {commands.read_back(*held_->tiles), commands.read_back(*held_->tile_groups)});
        }
    }
    return uploaded;
}

FrameStats FrameTicket::stats() const {
    FrameStats stats = known_;
    const std::vector<PassTime> times = ticket_.times();
    for (size_t i = first_; i < last_; ++i)
        add_time(stats.passes, times[i]);
    return stats;
}

void Renderer::begin_frame(const Commands& commands) {
    while (in_flight_.size() >= std::max<size_t>(1, options_.frames_in_flight)) {
        in_flight_.front().wait();
        in_flight_.pop_front();
    }
    in_flight_.push_back(commands.ticket());
}

Result<RecordedFrame> Renderer::record(Commands& commands, const Scene& scene,
                                       const SceneData& data) {
    return or_from_nothing([&] { return record_frame(commands, scene, data); });
}

Result<RecordedFrame> Renderer::record_frame(Commands& commands, const Scene& scene,
                                             const SceneData& data) {
    const profile::Scope scope("record a frame");
    begin_frame(commands);
    const size_t first = commands.pass_count();
    Result<size_t> uploaded = prepare(scene, data, commands);
    if (!uploaded)
        return pass_on(uploaded);
    Result<FrameStats> known = record_passes(commands, scene, data, *uploaded);
    if (!known)
        return pass_on(known);
    Targets& targets = *held_->targets;
    return RecordedFrame{
        &*targets.color, targets.return_values ? &*targets.values : nullptr,
        FrameTicket(commands.ticket(), std::move(*known), first, commands.pass_count())};
}

Result<FrameStats> Renderer::record_passes(Commands& commands, const Scene& scene,
                                           const SceneData& data, size_t uploaded) {
    PALPATE_ASSERT(scene.ray_cast || !scene.slices.empty() || !scene.surfaces.empty());
    FrameStats stats;
    stats.uploaded_bricks = uploaded;
    if (scene.ray_cast) {
        stats.cell_map_ms = held_->cell_map_ms;
        stats.gradients_ms = held_->gradients_ms;
    }
    stats.uploaded_bricks += draw_behind(scene, data, commands);
    Result<size_t> more = scene.ray_cast ? draw_rays(scene, data, commands) : size_t{0};
    if (!more)
        return pass_on(more);
    stats.uploaded_bricks += *more;
    tell_residency(stats);
    return stats;
}

Result<FrameStats> Renderer::draw(const Scene& scene, const SceneData& data) {
    return or_from_nothing([&] { return draw_frame(scene, data); });
}

Result<FrameStats> Renderer::draw_frame(const Scene& scene, const SceneData& data) {
    profile::Scope frame("frame");
    listed_.clear();
    Commands commands(*device_);
    begin_frame(commands);
    Result<size_t> uploaded = prepare_and_wait(scene, data, commands);
    const Timer timer;
    Result<FrameStats> stats = FrameStats{};
    if (uploaded)
        stats = record_passes(commands, scene, data, *uploaded);
    else
        stats = pass_on(uploaded);
    commands.submit(); // also of a frame that failed: images are as tracked
    if (!stats)
        return stats;
    add_times(stats->passes, commands.finish());
    stats->wall_ms = timer.ms();
    samples_ = read_sample_counts();
    if (frame.recorded())
        frame.tell("wall_ms", Json::of(stats->wall_ms));
    return stats;
}

Result<uint64_t> Renderer::count_samples(const Scene& scene, const SceneData& data) {
    const Restored counting(counting_, true);
    Result<FrameStats> drawn = draw(scene, data);
    if (!drawn)
        return pass_on(drawn);
    return samples_;
}

std::vector<Image> Renderer::read_back() {
    const profile::Scope scope("read back");
    PALPATE_ASSERT(held_->targets.has_value());
    Targets& targets = *held_->targets;
    const size_t pixels = size_t{targets.size_px.x} * targets.size_px.y;
    Commands commands(*device_);
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
    Result<FrameStats> stats = draw(scene, data);
    if (!stats)
        return pass_on(stats);
    return Frame{read_back(), std::move(*stats)};
}

} // namespace palpate
