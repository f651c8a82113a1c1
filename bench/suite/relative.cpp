#include "bench/suite/relative.h"

#include <cmath>

#include "bench/suite/panel.h"
#include "engine/image/compare.h"

namespace palpate::bench {

namespace {

// The largest channel is 1: PSNR is -20 log10 of the RMSE.
double decibels(double rmse) {
    return rmse > 0.0 ? -20.0 * std::log10(rmse) : 200.0;
}

Json json_of(const Spread& ratio) {
    return {
        {"median", ratio.median}, {"low", ratio.low}, {"high", ratio.high}, {"pairs", ratio.count}};
}

// A frame of `slow` by one of `fast`, drawn in turn; one pair that is not counted comes first, for
// pipelines and images are made then.
template <class Slow, class Fast>
Result<Spread> ratio_of(Bench& bench, const std::string& name, int pairs, const Slow& slow,
                        const Fast& fast) {
    std::vector<double> ratios;
    for (int pair = -1; pair < pairs && !(pair > 0 && bench.late(0.9)); ++pair) {
        if (bench.options().stop.stop_requested())
            return fail("interrupted at {}", name);
        const Result<FrameStats> a = slow();
        if (!a)
            return fail("{}: {}", name, a.error().message);
        const auto b = fast();
        if (!b)
            return fail("{}: {}", name, b.error().message);
        if (pair >= 0)
            ratios.push_back(a->wall_ms / b->wall_ms);
    }
    return spread(ratios);
}

struct Watched {
    Renderer& renderer;
    Scene mono;
    SceneData data;
    std::string what; // of the aims: the subject and its size
};

Result<Spread> stereo_by_mono(Bench& bench, const Watched& m, const Subject& subject, int pairs,
                              Json& aims) {
    Scene stereo = m.mono;
    stereo.stereo.emplace();
    stereo.stereo->rig.convergence_mm =
        glm::length(subject.camera.eye_mm - subject.camera.target_mm);
    Result<Spread> ratio = ratio_of(
        bench, subject.name, pairs, [&] { return m.renderer.draw(stereo, m.data); },
        [&] { return m.renderer.draw(m.mono, m.data); });
    if (ratio) {
        const double most = bench.device().info().is_cpu() ? 1.95 : 1.9;
        add_aim(aims, m.what + ": a stereo frame beside one of one eye",
                fmt::format("at most {:g}", most), ratio->median, ratio->median <= most);
    }
    return ratio;
}

Result<Json> full_by_interactive(Bench& bench, const Watched& m, const Subject& subject, int pairs,
                                 double turned_degrees, Json& aims) {
    Scene scene = m.mono;
    scene.camera = orbit(scene.camera, turned_degrees);
    const Result<Frame> full = m.renderer.render(scene, m.data);
    if (!full)
        return fail("{}: {}", subject.name, full.error().message);
    const Result<FrameStats> few = m.renderer.draw(scene, m.data, CoarseSettings{});
    if (!few)
        return fail("{}: {}", subject.name, few.error().message);
    const CoarseStats coarse = *few->coarse;
    const double error = color_rmse(m.renderer.read_back()[0], full->eyes[0]);
    PALPATE_TRY(const Spread ratio,
                ratio_of(
                    bench, subject.name, pairs, [&] { return m.renderer.draw(scene, m.data); },
                    [&] { return m.renderer.draw(scene, m.data, CoarseSettings{}); }));
    if (subject.layer.mode != RayMode::alpha)
        add_aim(
            aims,
            fmt::format("{}, turned by {:g} degrees: interactive beside full quality, at {:.1f} dB "
                        "({:.0f} % of the pixels have rays)",
                        m.what, turned_degrees, decibels(error), 100.0 * coarse.traced_share),
            "at least 1.5 at 40 dB or better", ratio.median,
            ratio.median >= 1.5 && decibels(error) >= 40.0);
    return Json{{"turned_degrees", turned_degrees},
                {"full_by_interactive", json_of(ratio)},
                {"rmse", error},
                {"rmse_estimate", coarse.error_estimate},
                {"db", decibels(error)},
                {"traced_share", coarse.traced_share}};
}

} // namespace

Result<Json> measure_relative(Bench& bench, const Subject& subject, uint32_t size_px, int pairs,
                              std::span<const double> turned_degrees, Json& aims) {
    Renderer renderer(bench.device(), {.stored_gradients = bench.device().info().is_cpu()});
    Watched watched{renderer, scene_of(subject, size_px), subject.data(),
                    fmt::format("{}, {} px", subject.title, size_px)};
    watched.mono.ray_cast = subject.layer;
    watched.mono.value_and_depth = false;
    PALPATE_TRY(const Spread eyes, stereo_by_mono(bench, watched, subject, pairs, aims));
    Json views = Json::array();
    for (const double turned : turned_degrees) {
        PALPATE_TRY(Json view, full_by_interactive(bench, watched, subject, pairs, turned, aims));
        views.push_back(std::move(view));
    }
    return Json{{"subject", subject.name},
                {"size_px", size_px},
                {"stereo_by_mono", json_of(eyes)},
                {"interactive", std::move(views)}};
}

} // namespace palpate::bench
