#include "engine/render/interactive.h"

#include <algorithm>
#include <array>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// From the best to the coarsest.
struct Level {
    double step_factor; // each at most 1.5 times the one before
    uint32_t px_per_ray;
};
constexpr std::array<Level, 8> kLevels{
    {{1.0, 2}, {1.5, 2}, {2.0, 2}, {3.0, 2}, {4.0, 2}, {4.0, 4}, {4.0, 8}, {4.0, 16}}};

// How many samples a level takes, beside one step and one ray a pixel, where one in two pixels both
// ways and those listed are `listed_share` of all.
double samples_of(const Level& level, bool has_steps, double listed_share) {
    const double rays =
        level.px_per_ray == 2 ? listed_share : 1.0 / (1.0 * level.px_per_ray * level.px_per_ray);
    return rays / (has_steps ? level.step_factor : 1.0);
}

// A level is left for a better one when that is expected to take less than this share of the
// budget, by samples: frames have fixed costs besides, so that it takes less and the two do not
// take turns.
constexpr double kComfortable = 0.9;

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
    const Level level = kLevels[level_];
    PALPATE_TRY(CoarseStats drawn, renderer_->draw_coarse(scene, data,
                                                          {.step_factor = level.step_factor,
                                                           .px_per_ray = level.px_per_ray}));
    if (level.px_per_ray == 2)
        listed_share_ = std::max(drawn.traced_share, 0.01);
    InteractiveFrame frame{std::move(drawn.frame),
                           drawn.error_estimate,
                           level.step_factor,
                           drawn.traced_share,
                           level.px_per_ray,
                           false,
                           false};
    frame.coarsest = level_ + 1 == kLevels.size();
    last_error_ = frame.error_estimate;
    const bool has_steps = scene.ray_cast->integrator != Integrator::exact;
    const auto expected_ms = [&](size_t other) {
        return frame.frame.wall_ms * samples_of(kLevels[other], has_steps, listed_share_) /
               samples_of(level, has_steps, listed_share_);
    };
    if (frame.frame.wall_ms > budget_ms_) {
        while (level_ + 1 < kLevels.size() && expected_ms(level_) > budget_ms_)
            ++level_;
    } else if (level_ > 0 && expected_ms(level_ - 1) < kComfortable * budget_ms_) {
        --level_;
    }
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
        PALPATE_TRY(frame.frame, renderer_->refine(scene, data, next_row_, rows));
        row_ms_ = frame.frame.wall_ms / rows;
        next_row_ += rows;
    }
    frame.complete = next_row_ == all;
    // The rows below are still those of the last moving frame.
    frame.error_estimate = frame.complete ? 0.0 : last_error_;
    return frame;
}

} // namespace palpate
