#include "bench/suite/panel.h"

#include <algorithm>
#include <cmath>

#include "engine/image/png.h"
#include "engine/volume/extent.h"

namespace palpate::bench {

namespace {

bool is_default(const Setting& setting) {
    const Setting usual = default_setting();
    return setting.integrator == usual.integrator && setting.step_samples == usual.step_samples &&
           setting.sub_steps == usual.sub_steps;
}

Json point_json(const Bench::Drawn& drawn) {
    Json v{{"renderer", "palpate"},
           {"name", drawn.setting.name()},
           {"integrator", drawn.setting.integrator},
           {"step_samples", drawn.setting.step_samples},
           {"default", is_default(drawn.setting)},
           {"error", drawn.errors.json()}};
    if (drawn.setting.sub_steps > 0)
        v["sub_steps"] = drawn.setting.sub_steps;
    if (!drawn.frames.wall_ms.empty())
        v["time"] = drawn.frames.json();
    return v;
}

Json point_json(const PeerPoint& peer) {
    const Spread wall = spread(peer.wall_ms);
    Json v{{"renderer", peer.mapper == "gpu" ? "VTK GPU mapper" : "VTK fixed-point mapper"},
           {"name", peer.name()},
           {"step_samples", peer.step_samples},
           {"first_frame_ms", peer.first_frame_ms},
           {"time",
            {{"wall_ms",
              {{"median", wall.median}, {"p95", wall.p95}, {"low", wall.low}, {"high", wall.high}}},
             {"cpu_ms", {{"median", spread(peer.cpu_ms).median}}},
             {"frames", wall.count},
             {"noise", wall.noise()},
             {"all_wall_ms", peer.wall_ms}}}};
    if (peer.errors)
        v["error"] = peer.errors->json();
    return v;
}

// Dark blue, violet, orange, pale yellow: light grows steadily, so it reads in grey too.
glm::vec3 heat(double share) {
    constexpr glm::vec3 kStops[] = {{0.0f, 0.0f, 0.02f},
                                    {0.34f, 0.06f, 0.43f},
                                    {0.78f, 0.23f, 0.33f},
                                    {0.98f, 0.62f, 0.20f},
                                    {0.99f, 1.0f, 0.70f}};
    const double place = std::clamp(share, 0.0, 1.0) * 4.0;
    const auto below = static_cast<int>(std::min(3.0, std::floor(place)));
    return glm::mix(kStops[below], kStops[below + 1], static_cast<float>(place - below));
}

} // namespace

void add_aim(Json& aims, const std::string& what, const std::string& aim, const Json& figure,
             bool reached) {
    aims.push_back({{"what", what}, {"aim", aim}, {"figure", figure}, {"reached", reached}});
}

Json panel_json(const Subject& subject, const std::vector<Bench::Drawn>& ours,
                const std::vector<PeerPoint>& peers, Sampling sampling,
                std::vector<std::string>& failures) {
    Json v{{"subject", subject.name},
           {"title", subject.title},
           {"size_px", sampling.size_px},
           {"scored_rays", sampling.rays() * sampling.rays()},
           {"unit", ours.empty() ? "" : ours[0].errors.unit}};
    std::vector<Cost> costs;
    std::vector<Measured> measured;
    for (const Bench::Drawn& drawn : ours) {
        const Spread wall = spread(drawn.frames.wall_ms);
        costs.push_back({wall.median, drawn.errors.rmse});
        measured.push_back({costs.back(), wall.noise()});
    }
    v["points"] = Json::array();
    const std::vector<size_t> front = pareto_front(costs);
    for (size_t i = 0; i < ours.size(); ++i) {
        Json point = point_json(ours[i]);
        point["on_front"] = std::find(front.begin(), front.end(), i) != front.end();
        if (is_default(ours[i].setting)) {
            const auto better = beaten_by(measured, i);
            v["default_on_front"] = !better.has_value();
            v["default_is_judged"] = subject.judged;
            if (better && subject.judged)
                failures.push_back(
                    fmt::format("{}: the default ({}: {:.1f} ms, {:.3g} {}) is not on its front: "
                                "{} takes {:.1f} "
                                "ms and errs by {:.3g}",
                                subject.name, ours[i].setting.name(), costs[i].ms, costs[i].error,
                                ours[i].errors.unit, ours[*better].setting.name(),
                                costs[*better].ms, costs[*better].error));
        }
        v["points"].push_back(std::move(point));
    }
    bool all_below = true, any = false;
    for (const PeerPoint& peer : peers) {
        if (peer.subject != subject.name)
            continue;
        Json point = point_json(peer);
        if (peer.errors) {
            any = true;
            const Cost cost{spread(peer.wall_ms).median, peer.errors->rmse};
            // The most exact of ours that are faster.
            std::optional<size_t> best;
            for (size_t i = 0; i < costs.size(); ++i)
                if (strictly_below(costs[i], cost) &&
                    (!best || costs[i].error < costs[*best].error))
                    best = i;
            point["we_are_below"] = best.has_value();
            all_below = all_below && best.has_value();
            if (best) {
                point["our_point"] = ours[*best].setting.name();
                point["times_faster"] = cost.ms / costs[*best].ms;
                if (costs[*best].error > 0)
                    point["times_less_error"] = cost.error / costs[*best].error;
            }
        }
        v["points"].push_back(std::move(point));
    }
    if (any)
        v["below_all_peers"] = all_below;
    return v;
}

Result<Json> map_json(const Bench& bench, const std::string& title, const Image& picture,
                      const Image& truth, const Subject& subject, double scale) {
    const std::vector<double> map = difference_map(
        picture, truth, subject.metric, smallest_spacing_mm(subject.sample->volume.grid()));
    Image shown = make_image(truth.size_px, {"R", "G", "B"});
    for (size_t p = 0; p < map.size(); ++p) {
        // The root, so that small errors show beside large ones.
        const glm::vec3 color =
            std::isnan(map[p]) ? glm::vec3(0.0f) : heat(std::sqrt(map[p] / scale));
        for (int c = 0; c < 3; ++c)
            shown.samples[p * 3 + static_cast<size_t>(c)] = color[c];
    }
    std::string name = title;
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c)))
            c = '_';
    const fs::path folder = bench.options().out / "maps";
    std::error_code ignored;
    fs::create_directories(folder, ignored);
    const fs::path path = folder / (name + ".png");
    PALPATE_TRY(save_png(path, shown));
    return Json{{"title", title},
                {"subject", subject.name},
                {"png", "maps/" + name + ".png"},
                {"brightest", scale}};
}

Json convergence_json(const std::string& title, const std::string& integrator,
                      const std::vector<double>& steps, const std::vector<double>& errors) {
    Json v{{"title", title}, {"integrator", integrator}, {"steps", steps}, {"rmse", errors}};
    constexpr double kAboveFloor = 4.0;
    constexpr double kStillFalls = 0.6, kSlower = 1.25;
    const size_t last = errors.size() - 1;
    const auto left = [&](size_t i) { return errors[i] / errors[i - 1]; };
    const bool floored = last == 0   ? false
                         : last == 1 ? left(1) > kStillFalls
                                     : left(last) > kSlower * left(last - 1);
    const double floor = floored ? *std::min_element(errors.begin(), errors.end()) : 0.0;
    std::vector<double> x, y;
    for (size_t i = 0; i < steps.size(); ++i)
        if (errors[i] > kAboveFloor * floor) {
            x.push_back(steps[i]);
            y.push_back(errors[i]);
        }
    if (x.size() >= 2) {
        const PowerLaw law = fit_power(x, y);
        v["order"] = law.order;
        v["factor"] = law.factor;
        if (law.band)
            v["band_95"] = *law.band;
        v["fitted_points"] = law.points;
        v["fitted_from"] = *std::min_element(x.begin(), x.end());
        v["fitted_to"] = *std::max_element(x.begin(), x.end());
    }
    return v;
}

} // namespace palpate::bench
