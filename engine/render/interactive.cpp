#include "engine/render/interactive.h"

#include <algorithm>
#include <array>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// The steps to choose from, in steps of the scene. Each is at most 1.5 times the one before it.
constexpr std::array kStepFactors{1.0, 1.5, 2.0, 3.0, 4.0};
// A level is left for a better one when a frame takes less than this share of the budget. Samples
// grow as steps shrink, by 1.5 at most, so that the better one takes 0.9 of the budget at most and
// the two do not take turns.
constexpr double kComfortable = 0.6;

uint64_t version_of(const std::optional<Volume>& volume) {
    return volume ? volume->version() : 0;
}

} // namespace

Interactive::Interactive(Renderer& renderer, double budget_ms)
    : renderer_(&renderer), budget_ms_(budget_ms) {
    PALPATE_ASSERT(budget_ms > 0);
}

Result<InteractiveFrame> Interactive::draw(const Scene& scene, const SceneData& data) {
    const bool resting = last_ == scene && last_version_ == data.volume.version() &&
                         last_label_version_ == version_of(data.labels);
    if (resting)
        return draw_resting(scene, data);
    last_ = scene;
    last_version_ = data.volume.version();
    last_label_version_ = version_of(data.labels);
    next_row_ = 0;
    return draw_moving(scene, data);
}

Result<InteractiveFrame> Interactive::draw_moving(const Scene& scene, const SceneData& data) {
    const double factor = kStepFactors[level_];
    Result<CoarseStats> drawn = renderer_->draw_coarse(scene, data, {.step_factor = factor});
    if (!drawn)
        return tl::unexpected(drawn.error());
    InteractiveFrame frame{std::move(drawn->frame), drawn->error_estimate, factor,
                           drawn->traced_share, false};
    last_error_ = frame.error_estimate;
    if (frame.frame.wall_ms > budget_ms_)
        level_ = std::min(level_ + 1, kStepFactors.size() - 1);
    else if (frame.frame.wall_ms < kComfortable * budget_ms_ && level_ > 0)
        --level_;
    return frame;
}

Result<InteractiveFrame> Interactive::draw_resting(const Scene& scene, const SceneData& data) {
    const uint32_t all = Renderer::tile_rows(scene);
    InteractiveFrame frame;
    if (next_row_ < all) {
        // As many rows as the budget has room for, and always some.
        const double room = row_ms_ > 0 ? budget_ms_ / row_ms_ : 1.0;
        const auto rows =
            static_cast<uint32_t>(std::clamp(room, 1.0, static_cast<double>(all - next_row_)));
        Result<FrameStats> drawn = renderer_->refine(scene, data, next_row_, rows);
        if (!drawn)
            return tl::unexpected(drawn.error());
        frame.frame = std::move(*drawn);
        row_ms_ = frame.frame.wall_ms / rows;
        next_row_ += rows;
    }
    frame.complete = next_row_ == all;
    // The rows below are still those of the last moving frame.
    frame.error_estimate = frame.complete ? 0.0 : last_error_;
    return frame;
}

} // namespace palpate
