#include "engine/program/render_timing.h"

#include <cmath>
#include <map>
#include <string>

#include "engine/base/log.h"
#include "engine/base/option_name.h"
#include "engine/base/percentile.h"
#include "engine/base/timer.h"

namespace palpate {

namespace {

// Draws the scene once, for a moving hand where a budget is given.
Result<FrameStats> draw_once(Renderer& renderer, std::optional<Interactive>& interactive,
                             const Scene& scene, const SceneData& data, Timing& timing) {
    if (!interactive)
        return renderer.draw(scene, data);
    PALPATE_TRY(const InteractiveFrame drawn, interactive->draw(scene, data));
    timing.interactive = drawn;
    return drawn.frame;
}

} // namespace

void say_clocks(const Timing& timing) {
    if (timing.disagreement() > kClocksMayDiffer)
        log::warning(
            "GPU timestamps give {:.3f} ms a frame and the fenced wall clock {:.3f} ms: they "
            "differ by {:.0f} %",
            percentile(timing.gpu_ms, 0.5), percentile(timing.wall_ms, 0.5),
            100.0 * timing.disagreement());
}

double Timing::disagreement() const {
    std::vector<double> shares;
    for (size_t i = 0; i < wall_ms.size(); ++i)
        shares.push_back(std::abs(gpu_ms[i] - wall_ms[i]) / wall_ms[i]);
    return percentile(shares, 0.5);
}

Result<Timing> draw_frames(Renderer& renderer, Scene scene, const SceneData& data,
                           const FrameOptions& options, bool count_samples, std::stop_token stop) {
    Timing timing;
    timing.budget_ms = options.frame_ms;
    std::map<std::string, std::vector<double>> passes;
    std::optional<Interactive> interactive;
    if (options.frame_ms > 0)
        interactive.emplace(renderer, options.frame_ms);
    // One frame more than asked for: the first pays for pipelines and uploads, and is told apart.
    const uint32_t count = options.frames > 1 ? options.frames + 1 : 1;
    for (uint32_t i = 0; i < count; ++i) {
        if (stop.stop_requested())
            return fail("interrupted after {} of {} frames", i, count);
        const Timer timer;
        PALPATE_TRY(const FrameStats stats, draw_once(renderer, interactive, scene, data, timing));
        if (interactive) {
            timing.moving = timing.interactive->px_per_ray > 1;
            timing.coarsest = timing.interactive->coarsest;
        }
        if (i == 0) {
            timing.first_frame_ms = timer.ms();
            timing.cell_map_ms = stats.cell_map_ms;
            timing.first = stats;
        }
        if (i > 0 || count == 1) {
            timing.wall_ms.push_back(stats.wall_ms);
            double gpu = 0;
            for (const PassTime& pass : stats.passes) {
                gpu += pass.gpu_ms;
                passes[pass.name].push_back(pass.gpu_ms);
            }
            timing.gpu_ms.push_back(gpu);
            timing.passes = stats.passes;
        }
        if (i + 1 < count)
            scene.camera = orbit(scene.camera, options.orbit_deg);
    }
    while (interactive && options.settle && !timing.interactive->complete) {
        if (stop.stop_requested())
            return fail("interrupted during {}", Option{"settle"});
        PALPATE_TRY(draw_once(renderer, interactive, scene, data, timing));
    }
    if (count_samples && scene.ray_cast && !interactive) {
        PALPATE_TRY(timing.samples, renderer.count_samples(scene, data));
    }
    for (PassTime& pass : timing.passes)
        pass.gpu_ms = percentile(passes[pass.name], 0.5);
    return timing;
}

} // namespace palpate
