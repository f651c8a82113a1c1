#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "engine/render/interactive.h"

namespace palpate {

// The frames of `palpate render`: how many, how the camera turns, what time they may take.
struct FrameOptions {
    uint32_t frames = 1;
    double orbit_deg = 0.0; // from frame to frame, about the camera's up
    double frame_ms = 0.0;  // a budget for a moving hand; 0: full quality always
    bool settle = false;    // with a budget: the last frame rests until it is of full quality
};

// Times of the frames of one run.
struct Timing {
    double first_frame_ms = 0;           // pipelines, uploads and the first frame
    std::vector<double> wall_ms, gpu_ms; // of the frames after it; of the first if it is alone
    std::vector<PassTime> passes;        // medians
    double cell_map_ms = 0;              // of the first frame
    uint64_t samples = 0;                // of the last frame; none with --frame-ms
    FrameStats first;                    // of the first frame: uploads, residency
    std::optional<InteractiveFrame> interactive; // the last frame with --frame-ms
    bool moving = false, coarsest = false;       // the last frame before it settled
    double budget_ms = 0;                        // --frame-ms; 0 without

    // Median over the frames of how far the GPU's timestamps and the fenced wall clock are apart,
    // as a share of the latter. Clocks that lie, passes that nobody timed and waits between
    // submissions show here.
    double disagreement() const;
};
constexpr double kClocksMayDiffer = 0.1;

// Says where the two clocks are further apart than that.
void say_clocks(const Timing& timing);

// Draws all frames; the renderer then holds the last. `count_samples`: once more with the variant
// that counts, which no timed frame pays for.
Result<Timing> draw_frames(Renderer& renderer, Scene scene, const SceneData& data,
                           const FrameOptions& options, bool count_samples, std::stop_token stop);

} // namespace palpate
