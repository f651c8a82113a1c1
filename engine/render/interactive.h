#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "engine/render/level_choice.h"
#include "engine/render/renderer.h"

namespace palpate {

// One interactive frame.
struct InteractiveFrame {
    FrameStats frame;
    // RMSE of the colours against full quality (CoarseStats); 0 where all of it is.
    double error_estimate = 0;
    double step_factor = 1;  // how much longer than the scene's steps; 1 at rest
    double traced_share = 1; // of the pixels that have rays of their own
    uint32_t px_per_ray = 1; // CoarseSettings; 1 at rest
    bool coarsest = false;   // there are no fewer rays to be had
    bool complete = false;   // full quality everywhere
    // Outside of these pixels the picture is the last frame's; none: unknown.
    std::optional<PixelBox> changed{};
};

// Draws for a moving hand: holds a budget of milliseconds a frame by drawing fewer rays, down to
// one in 16 x 16 pixels, and longer steps while anything changes, and refines row by row to full
// quality as soon as nothing does. An edit, and an opaque mesh that moves, has the pixels that it
// changed drawn in full, where that is expected to hold the budget or to take no longer than a
// picture from fewer rays; the rest of the picture stays as refined as it was.
class Interactive {
 public:
    // budget_ms > 0.
    Interactive(Renderer& renderer, double budget_ms);

    // Draws a frame. While the scene is the same, pixels outside of `changed` differ from the last
    // frame by fewer rays alone: pass changed_pixels(), and pixels_of() a mesh that moved, before
    // and after. None: unknown.
    Result<InteractiveFrame> draw(const Scene& scene, const SceneData& data,
                                  const std::optional<PixelBox>& changed = {});

    // The times that decide about a frame: how long it took, and how much of that its rays took.
    struct Times {
        double wall_ms, ray_ms;
    };
    // Gives the times of frames in place of the clock's and the device's, so that tests decide.
    void set_times(std::function<Times(const FrameStats&)> times_of) {
        times_of_ = std::move(times_of);
    }

    void set_budget_ms(double budget_ms) { budget_ms_ = budget_ms; }
    // While the error estimate of moving frames is above `error`, they may take up to longest_ms.
    void set_aim(double error, double longest_ms) {
        aim_ = error;
        longest_ms_ = longest_ms;
    }

 private:
    Result<InteractiveFrame> draw_moving(const Scene& scene, const SceneData& data);
    Result<InteractiveFrame> draw_resting(const Scene& scene, const SceneData& data);
    Result<InteractiveFrame> draw_changed(const Scene& scene, const SceneData& data,
                                          const PixelBox& changed);
    InteractiveFrame unchanged() const;
    double expected_ms(const PixelBox& changed, uint32_t columns) const;

    Renderer* renderer_;
    double budget_ms_;
    std::function<Times(const FrameStats&)> times_of_;
    double aim_ = std::numeric_limits<double>::infinity(), longest_ms_ = 0;
    LevelChoice levels_;
    double last_error_ = 0;     // of the last moving frame
    std::optional<Scene> last_; // what was drawn last
    std::vector<std::shared_ptr<const Mesh>> last_meshes_;
    std::array<uint64_t, 4> last_versions_{}; // of its volume, labels, fused volume and overlay
    uint32_t next_row_ = 0;                   // of tiles, to refine
    double row_ms_ = 0;                       // what a row took lately; 0 before the first
    // Time of a tile drawn anew, and of all but its rays; 0 before the first of this scene.
    double tile_ms_ = 0, others_ms_ = 0;
};

} // namespace palpate
