#include "engine/render/interactive.h"

#include <algorithm>
#include <array>

#include "engine/base/assert.h"
#include "engine/render/coarse_pass.h"
#include "engine/render/targets.h"
#include "shaders/shared/tiles.h"

namespace palpate {

namespace {

// From the best to the coarsest: the front of error against time, for MIP, iso and alpha alike.
// Longer steps take off little time beside rays that are few (docs/log/rendering.md).
struct Level {
    double step_factor;
    double contrast_factor; // of the mode's contrast; for two pixels a ray
    uint32_t px_per_ray;
};
constexpr double kNoneBetween = 1e9; // of the rays of every second pixel
constexpr std::array<Level, 10> kLevels{{{1.0, 1.0, 2},
                                         {1.0, 1.5, 2},
                                         {1.0, 2.0, 2},
                                         {1.0, 3.0, 2},
                                         {1.0, 4.0, 2},
                                         {1.0, 6.0, 2},
                                         {1.0, kNoneBetween, 2},
                                         {1.0, 1.0, 4},
                                         {2.0, 1.0, 8},
                                         {2.0, 1.0, 16}}};

// How many samples a level takes, beside one step and one ray a pixel, where one in two pixels both
// ways and those listed are `listed_share` of all.
double samples_of(const Level& level, bool has_steps, double listed_share) {
    const double rays =
        level.px_per_ray == 2 ? listed_share : 1.0 / (1.0 * level.px_per_ray * level.px_per_ray);
    return rays / (has_steps ? level.step_factor : 1.0);
}

// A level is left for a better one when that is expected to take less than this share of the
// budget, so that the two do not take turns.
constexpr double kComfortable = 0.9;

// A coarser level is tried, one at a time, by frames that take more than the budget and whose error
// is below the aim by this factor: a level and the next are less far apart.
constexpr double kFarBetter = 0.3;

// A better level that is not known is tried where frames take less than this share of the room.
constexpr double kTried = 0.6;

// The known time of a level fades by this factor a frame, so that a level that took a tenth too
// long is tried again within 40 frames.
constexpr double kForgotten = 0.995;

// The known time of pixels that are drawn anew fades by this factor if it let a frame of fewer rays
// be drawn instead: the first of their kind waits for its pipeline.
constexpr double kDoubted = 0.5;

// A frame that takes so much longer than those before is of another view, and not averaged.
constexpr double kSudden = 1.5;

// Rays take the part of a frame's time that changes with their number.
Interactive::Times measured(const FrameStats& frame) {
    double sum = 0.0;
    for (const PassTime& pass : frame.passes)
        for (const char* const name :
             {"few pixels", "every second pixel", "listed pixels", "ray cast"})
            sum += pass.name == name ? pass.gpu_ms : 0.0;
    return {frame.wall_ms, std::min(sum, frame.wall_ms)};
}

uint32_t tiles_of(const PixelBox& box) {
    if (box.empty())
        return 0;
    const glm::uvec2 count = tile_count(box.high) - box.low / gpu::kTileSide;
    return count.x * count.y;
}

// The pixels of the tiles that a box touches.
PixelBox of_whole_tiles(const PixelBox& box, glm::uvec2 size_px) {
    const uint32_t side = gpu::kTileSide;
    return {box.low / side * side, glm::min((box.high + (side - 1)) / side * side, size_px)};
}

// ChangedPixels need meshes that are known and not see-through.
bool can_redraw(const Scene& scene) {
    return std::all_of(scene.surfaces.begin(), scene.surfaces.end(), [](const SurfaceLayer& layer) {
        const auto is_whole = [](double opacity) { return opacity <= 0.0 || opacity >= 1.0; };
        return !layer.live_iso && is_whole(layer.style.opacity) &&
               std::all_of(layer.label_styles.begin(), layer.label_styles.end(),
                           [&](const auto& style) { return is_whole(style.opacity); });
    });
}

uint64_t version_of(const std::optional<Volume>& volume) {
    return volume ? volume->version() : 0;
}

} // namespace

Interactive::Interactive(Renderer& renderer, double budget_ms)
    : renderer_(&renderer), budget_ms_(budget_ms), times_of_(measured) {
    PALPATE_ASSERT(budget_ms > 0);
}

Result<InteractiveFrame> Interactive::draw(const Scene& scene, const SceneData& data,
                                           const std::optional<PixelBox>& changed) {
    const bool is_same_scene = last_ == scene;
    const bool is_same = is_same_scene && last_meshes_ == data.meshes;
    const std::array<uint64_t, 4> versions{data.volume.version(), version_of(data.labels),
                                           version_of(data.fused), version_of(data.overlay)};
    if (is_same && last_versions_ == versions)
        return draw_resting(scene, data);
    last_ = scene;
    last_meshes_ = data.meshes;
    last_versions_ = versions;
    if (!is_same_scene)
        tile_ms_ = others_ms_ = 0;
    // A picture from fewer rays may take longer than the budget; then these pixels may, too.
    const double longest_ms = std::max(budget_ms_, level_ms_[level_]);
    if (is_same_scene && changed && can_redraw(scene) &&
        expected_ms(*changed, tile_count(scene.size_px).x) <= longest_ms)
        return draw_changed(scene, data, *changed);
    next_row_ = 0;
    return draw_moving(scene, data);
}

// The time to draw only the pixels that an edit changed.
double Interactive::expected_ms(const PixelBox& changed, uint32_t columns) const {
    return others_ms_ + tiles_of(changed) * std::max(tile_ms_, row_ms_ / columns);
}

// The state of the picture that is there. Rows that are not refined are those of the last moving
// frame.
InteractiveFrame Interactive::unchanged() const {
    InteractiveFrame frame{.changed = PixelBox{}};
    frame.complete = next_row_ == Renderer::tile_rows(*last_);
    frame.error_estimate = frame.complete ? 0.0 : last_error_;
    return frame;
}

Result<InteractiveFrame> Interactive::draw_changed(const Scene& scene, const SceneData& data,
                                                   const PixelBox& changed) {
    if (changed.empty())
        return unchanged();
    auto drawn = renderer_->draw(scene, data, ChangedPixels{changed});
    if (!drawn) {
        last_.reset(); // nobody knows what is there
        return pass_on(drawn);
    }
    const Times took = times_of_(*drawn);
    tile_ms_ = took.ray_ms / tiles_of(changed);
    others_ms_ = took.wall_ms - took.ray_ms;
    InteractiveFrame frame = unchanged();
    frame.frame = std::move(*drawn);
    frame.changed = of_whole_tiles(changed, scene.size_px);
    return frame;
}

Result<InteractiveFrame> Interactive::draw_moving(const Scene& scene, const SceneData& data) {
    const Level level = kLevels[level_];
    CoarseSettings settings{.step_factor = level.step_factor, .px_per_ray = level.px_per_ray};
    settings.contrast = level.contrast_factor * default_contrast(scene.ray_cast->mode);
    tile_ms_ *= kDoubted;
    others_ms_ *= kDoubted;
    auto few = renderer_->draw(scene, data, settings);
    if (!few) {
        last_.reset(); // nobody knows what is there
        return pass_on(few);
    }
    const CoarseStats& drawn = *few->coarse;
    if (level.px_per_ray == 2)
        listed_share_ = std::max(drawn.traced_share, 0.01);
    InteractiveFrame frame{
        *few, drawn.error_estimate, level.step_factor, drawn.traced_share, level.px_per_ray, false,
        false};
    frame.coarsest = level_ + 1 == kLevels.size();
    last_error_ = frame.error_estimate;
    choose_level(*few, scene);
    return frame;
}

// Chooses the level of the next moving frame.
void Interactive::choose_level(const FrameStats& drawn, const Scene& scene) {
    static_assert(kLevels.size() == kLevelCount);
    const Level level = kLevels[level_];
    const bool has_steps = scene.ray_cast->integrator != Integrator::exact;
    const Times took = times_of_(drawn);
    const double frame_ms = took.wall_ms, ray_ms = took.ray_ms;
    const double longest_ms = std::max(budget_ms_, longest_ms_);
    for (double& known_ms : level_ms_)
        known_ms *= kForgotten; // so that it is tried again
    double& own_ms = level_ms_[level_];
    const bool is_alike = own_ms > 0.0 && frame_ms < kSudden * own_ms;
    own_ms = is_alike ? 0.5 * (own_ms + frame_ms) : frame_ms;
    const double wall_ms = own_ms;
    // The time of an unknown level is guessed from its samples. That is too much for a better
    // level: rays that lie far apart take longer each.
    const auto expected_ms = [&](size_t other) {
        if (level_ms_[other] > 0.0)
            return level_ms_[other];
        return wall_ms - ray_ms +
               ray_ms * samples_of(kLevels[other], has_steps, listed_share_) /
                   samples_of(level, has_steps, listed_share_);
    };
    const bool is_good = drawn.coarse->error_estimate <= aim_;
    // A good frame may take less than its time, and one that is far better than it need be should.
    const bool is_too_good = drawn.coarse->error_estimate <= kFarBetter * aim_;
    if (wall_ms > longest_ms) {
        while (level_ + 1 < kLevels.size() && expected_ms(level_) > longest_ms)
            ++level_;
    } else if (wall_ms > budget_ms_ && is_too_good) {
        level_ = std::min(level_ + 1, kLevels.size() - 1);
    } else if (level_ > 0) {
        const double room_ms = kComfortable * (is_good ? budget_ms_ : longest_ms);
        const bool is_unknown = level_ms_[level_ - 1] == 0.0;
        if (expected_ms(level_ - 1) < room_ms || (is_unknown && wall_ms < kTried * room_ms))
            --level_;
    }
}

Result<InteractiveFrame> Interactive::draw_resting(const Scene& scene, const SceneData& data) {
    const uint32_t all = Renderer::tile_rows(scene);
    if (next_row_ == all)
        return unchanged();
    // As many rows as the budget has room for, and always some.
    const double room = row_ms_ > 0 ? budget_ms_ / row_ms_ : 1.0;
    const auto rows =
        static_cast<uint32_t>(std::clamp(room, 1.0, static_cast<double>(all - next_row_)));
    PALPATE_TRY(FrameStats drawn, renderer_->draw(scene, data, TileRows{next_row_, rows}));
    row_ms_ = times_of_(drawn).wall_ms / rows;
    const uint32_t side = gpu::kTileSide;
    const PixelBox drawn_box{{0, next_row_ * side}, {scene.size_px.x, (next_row_ + rows) * side}};
    next_row_ += rows;
    InteractiveFrame frame = unchanged();
    frame.frame = std::move(drawn);
    frame.changed = of_whole_tiles(drawn_box, scene.size_px);
    return frame;
}

} // namespace palpate
