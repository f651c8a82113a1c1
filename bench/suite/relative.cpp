#include "bench/suite/relative.h"

#include <cmath>

#include "engine/image/compare.h"

namespace palpate::bench {

namespace {

// The largest channel is 1: PSNR is -20 log10 of the RMSE.
double decibels(double rmse) {
    return rmse > 0.0 ? -20.0 * std::log10(rmse) : 200.0;
}

} // namespace

Result<Value> measure_relative(Bench& bench, const Subject& subject, uint32_t size_px, int rounds,
                               Value& aims) {
    const SceneData data = subject.data();
    const bool cpu = bench.device().info().is_cpu();
    Renderer renderer(bench.device(), {.stored_gradients = cpu});
    Scene mono = scene_of(subject, size_px);
    mono.ray_cast = subject.layer;
    mono.value_and_depth = false;
    Scene stereo = mono;
    stereo.stereo.emplace();
    stereo.stereo->rig.convergence_mm =
        glm::length(subject.camera.eye_mm - subject.camera.target_mm);

    const Result<Frame> full = renderer.render(mono, data);
    if (!full)
        return fail("{}: {}", subject.name, full.error().message);
    const Result<CoarseStats> coarse = renderer.draw_coarse(mono, data, {});
    if (!coarse)
        return fail("{}: {}", subject.name, coarse.error().message);
    const double error = color_rmse(renderer.read_back()[0], full->eyes[0]);

    std::vector<double> of_eyes, of_rays;
    for (int round = -1; round < 3 * rounds && !(round > 0 && bench.late(0.9)); ++round) {
        if (bench.options().stop.stop_requested())
            return fail("interrupted at {}", subject.name);
        const Result<FrameStats> one = renderer.draw(mono, data);
        const Result<FrameStats> two = renderer.draw(stereo, data);
        const Result<CoarseStats> few = renderer.draw_coarse(mono, data, {});
        if (!one || !two || !few)
            return fail("{}: a frame cannot be drawn", subject.name);
        if (round < 0) // pipelines and images are made
            continue;
        of_eyes.push_back(two->wall_ms / one->wall_ms);
        of_rays.push_back(one->wall_ms / few->frame.wall_ms);
    }
    const Spread eyes = spread(of_eyes), rays = spread(of_rays);
    const double most = cpu ? 1.95 : 1.9;
    aims.push_back({{"what", fmt::format("{}, {} px: a stereo frame beside one of one eye",
                                         subject.title, size_px)},
                    {"aim", fmt::format("at most {:g}", most)},
                    {"figure", eyes.median},
                    {"reached", eyes.median <= most}});
    if (subject.layer.mode != RayMode::alpha)
        aims.push_back({{"what", fmt::format("{}, {} px: interactive beside full quality, at "
                                             "{:.1f} dB ({:.0f} % of the pixels have rays)",
                                             subject.title, size_px, decibels(error),
                                             100.0 * coarse->traced_share)},
                        {"aim", "at least 1.5 at 40 dB or better"},
                        {"figure", rays.median},
                        {"reached", rays.median >= 1.5 && decibels(error) >= 40.0}});
    return Value{
        {"subject", subject.name},
        {"size_px", size_px},
        {"stereo_by_mono", {{"median", eyes.median}, {"low", eyes.low}, {"high", eyes.high}}},
        {"full_by_interactive", {{"median", rays.median}, {"low", rays.low}, {"high", rays.high}}},
        {"interactive_rmse", error},
        {"interactive_rmse_estimate", coarse->error_estimate},
        {"interactive_db", decibels(error)},
        {"traced_share", coarse->traced_share}};
}

} // namespace palpate::bench
