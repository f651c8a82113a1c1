#include "engine/render/interactive.h"

#include <algorithm>
#include <array>

#include "engine/base/assert.h"
#include "engine/render/coarse_pass.h"
#include "engine/render/targets.h"
#include "shaders/shared/tiles.h"

namespace palpate {

namespace {

// The known time of pixels that are drawn anew fades by this factor if it let a frame of fewer rays
// be drawn instead: the first of their kind waits for its pipeline.
constexpr double kDoubted = 0.5;

// Rays take the part of a frame's time that changes with their number.
Interactive::Times measured(const FrameStats& frame) {
    return {frame.wall_ms, std::min(frame.ray_ms, frame.wall_ms)};
}

uint32_t tiles_of(const PixelBox& box) {
    if (box.empty())
        return 0;
    const glm::uvec2 count = tile_count(box.high) - box.low / gpu::kTileSide;
    return count.x * count.y;
}

// ChangedPixels need meshes that are known and not see-through.
bool can_redraw(const Scene& scene) {
    const auto is_whole = [](double opacity) { return opacity <= 0.0 || opacity >= 1.0; };
    const bool whole_labels =
        !scene.labels || std::ranges::all_of(scene.labels->styles, [&](const LabelStyle& style) {
            return is_whole(style.opacity);
        });
    return std::all_of(
        scene.surfaces.begin(), scene.surfaces.end(), [&](const SurfaceLayer& layer) {
            return !layer.live_iso && (!layer.live_labels || whole_labels) &&
                   is_whole(layer.style.opacity) &&
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
    const double longest_ms = std::max(budget_ms_, levels_.known_ms());
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
    const Level level = levels_.level();
    CoarseSettings settings{.step_factor = level.step_factor, .px_per_ray = level.px_per_ray};
    settings.contrast = level.contrast_factor * default_contrast(scene.ray_cast->mode);
    tile_ms_ *= kDoubted;
    others_ms_ *= kDoubted;
    auto drawn = renderer_->draw(scene, data, settings);
    if (!drawn) {
        last_.reset(); // nobody knows what is there
        return pass_on(drawn);
    }
    const CoarseStats few = *drawn->coarse;
    const Times took = times_of_(*drawn);
    InteractiveFrame frame{.frame = std::move(*drawn),
                           .error_estimate = few.error_estimate,
                           .step_factor = level.step_factor,
                           .traced_share = few.traced_share,
                           .px_per_ray = level.px_per_ray,
                           .coarsest = levels_.is_coarsest()};
    last_error_ = few.error_estimate;
    levels_.drawn({took.wall_ms, took.ray_ms, few.error_estimate, few.traced_share,
                   scene.ray_cast->integrator != Integrator::exact},
                  {budget_ms_, aim_, longest_ms_});
    return frame;
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
