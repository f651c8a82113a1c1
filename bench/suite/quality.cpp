// Error against time: fronts beside VTK's points, orders of convergence, what each factor does.

#include <algorithm>
#include <cmath>

#include "bench/suite/factors.h"
#include "bench/suite/suites.h"
#include "engine/base/log.h"
#include "engine/scene/presets.h"
#include "engine/volume/extent.h"

namespace palpate::bench {

namespace {

struct Plan {
    Sampling sampling;
    int rounds;           // of three frames each
    double peer_budget_s; // a case, step and round
    uint32_t hypercube;
    uint32_t phantom_side, convergence_side, convergence_px;
    double finest_step; // of the convergence, in samples
};

Plan plan_of(const Options& options) {
    if (options.tiny)
        return {{32, 2}, 1, 0.1, 4, 32, 24, 12, 0.25};
    if (options.full)
        return {{512, 2}, 10, 3.0, 200, 256, 128, 128, 1.0 / 32.0};
    return {{512, 3}, 3, 1.0, 24, 256, 128, 72, 1.0 / 16.0};
}

// A transfer function without kinks that a table of 4096 entries would notice: tau rises and falls
// as sin^2 over the values 0 .. 1, colour turns with it.
TransferFunction smooth_transfer(double unit_mm) {
    TransferFunction transfer;
    transfer.colors.clear();
    constexpr int kPoints = 129;
    for (int i = 0; i < kPoints; ++i) {
        const double value = i / (kPoints - 1.0);
        const double rise = 0.5 - 0.5 * std::cos(2.0 * 3.14159265358979323846 * value);
        transfer.colors.push_back(
            {value, {1.0 - 0.6 * value, 0.4 + 0.4 * rise, 0.2 + 0.7 * value}});
        transfer.opacities.push_back({value, -std::expm1(-0.5 * rise)});
    }
    transfer.opacity_unit_mm = unit_mm;
    return transfer;
}

Result<Json> convergence(Bench& bench, const Plan& plan) {
    const Sample sample = marschner_lobb(plan.convergence_side);
    const double unit = 8.0 * smallest_spacing_mm(sample.volume.grid());
    std::vector<Subject> subjects{alpha_subject(sample, smooth_transfer(unit), "smooth"),
                                  alpha_subject(sample, peak(0.5, 0.02, 0.9, unit), "2 % peak")};
    Json all = Json::array();
    for (Subject& subject : subjects) {
        subject.layer.min_transmittance = 0.0; // the integrator's error alone
        for (const char* integrator : {"fast", "preintegrated", "exact"}) {
            std::vector<Setting> settings;
            std::vector<double> steps, errors;
            for (double step = 1.0; step >= plan.finest_step; step *= 0.5) {
                const bool exact = std::string_view(integrator) == "exact";
                settings.push_back({integrator, exact ? 1.0 : step,
                                    exact ? static_cast<uint32_t>(std::lround(1.0 / step)) : 0});
                steps.push_back(step);
            }
            PALPATE_TRY(const auto drawn,
                        bench.draw(subject, settings, {plan.convergence_px, 1}, 0));
            for (const Bench::Drawn& one : drawn)
                errors.push_back(std::max(one.errors.rmse, 1e-12));
            all.push_back(convergence_json(subject.title, integrator, steps, errors));
        }
    }
    return all;
}

// One tenth of VTK's error at VTK's step-0.5 time, on the narrow peak.
Json narrow_peak_aim(const Json& panel) {
    Json aims = Json::array();
    for (const Json& peer : panel["points"]) {
        if (peer["renderer"] == "palpate" || std::abs(peer["step_samples"].number - 0.5) > 0.01)
            continue;
        const double budget = peer["time"]["wall_ms"]["median"].number;
        double best = std::numeric_limits<double>::infinity();
        for (const Json& point : panel["points"])
            if (point["renderer"] == "palpate" &&
                point["time"]["wall_ms"]["median"].number <= budget)
                best = std::min(best, point["error"]["rmse"].number);
        const double ratio = std::isfinite(best) ? best / peer["error"]["rmse"].number : -1.0;
        add_aim(aims,
                fmt::format("{}: RMSE beside that of {}, in no more time", panel["title"].string,
                            peer["name"].string),
                "at most 0.1", ratio >= 0 ? Json(ratio) : Json(), ratio >= 0 && ratio <= 0.1);
    }
    return aims;
}

struct Samples {
    std::vector<Sample> all;
    std::vector<std::string> notes;
};

Samples samples_of(const Options& options, const Plan& plan) {
    Samples samples;
    if (!options.tiny) {
        Result<Sample> ct = head_ct(options.head_ct);
        if (ct)
            samples.all.push_back(std::move(*ct));
        else
            samples.notes.push_back("The head CT was left out: " + ct.error().message);
    }
    samples.all.push_back(phantom(plan.phantom_side));
    return samples;
}

} // namespace

Result<Report> run_quality(Bench& bench) {
    const Options& options = bench.options();
    const Plan plan = plan_of(options);
    const Samples samples = samples_of(options, plan);
    std::vector<Subject> subjects;
    for (const Sample& sample : samples.all) {
        subjects.push_back(alpha_subject(sample, *preset("ct-peer"), ""));
        subjects.push_back(mip_subject(sample, -200, 2000));
        subjects.push_back(iso_subject(sample, 300));
    }
    // A peak 2 % of the range wide, in bone.
    const ValueRange range = samples.all[0].volume.range();
    subjects.push_back(alpha_subject(
        samples.all[0], peak(500.0, 0.02 * (double{range.max} - double{range.min}), 0.9, 1.0),
        "2 % peak"));
    subjects.back().judged = false; // it is there to defeat point sampling
    for (Subject& subject : subjects)
        subject.judged = subject.judged && !options.tiny; // whose times say nothing

    Report report;
    Json& json = report.json;
    json["notes"] = samples.notes;
    PALPATE_TRY(Peers peers, Peers::start(bench, subjects, {1.0, 0.5, 0.25}, plan.sampling));
    json["panels"] = Json::array();
    json["maps"] = Json::array();
    json["first_frames"] = Json::array();
    for (const Subject& subject : subjects) {
        log::info("{}", subject.name);
        PALPATE_TRY(peers.open(subject));
        PALPATE_TRY(
            const auto drawn,
            bench.draw(subject, settings_of(subject.layer.mode, options.full), plan.sampling,
                       plan.rounds, [&] { peers.time_frames(3, plan.peer_budget_s); }));
        json["panels"].push_back(
            panel_json(subject, drawn, peers.points(), plan.sampling, report.failures));
        PALPATE_TRY(const double first,
                    bench.first_frame_ms(subject, default_setting(), plan.sampling.size_px));
        json["first_frames"].push_back(
            {{"subject", subject.name}, {"renderer", "palpate"}, {"ms", first}});
        // Maps: our default, and each mapper at the same step, on one scale.
        PALPATE_TRY(const Image truth, bench.truth(subject, plan.sampling));
        const auto mine = std::find_if(drawn.begin(), drawn.end(), [](const auto& d) {
            return d.setting.name() == default_setting().name();
        });
        const double scale = std::max(mine->errors.p999, 1e-9);
        PALPATE_TRY(Json map, map_json(bench, subject.title + ", palpate, " + mine->setting.name(),
                                       mine->picture, truth, subject, scale));
        json["maps"].push_back(map);
        for (const PeerPoint& peer : peers.points()) {
            if (peer.subject != subject.name)
                continue;
            if (std::abs(peer.step_samples - 1.0) > 0.01)
                continue;
            json["first_frames"].push_back({{"subject", subject.name},
                                            {"renderer", peer.name()},
                                            {"ms", peer.first_frame_ms}});
            if (!peer.errors)
                continue;
            PALPATE_TRY(map, map_json(bench, subject.title + ", " + peer.name(), peer.picture,
                                      truth, subject, scale));
            json["maps"].push_back(map);
        }
    }
    json["peers"] = {{"vtk", peers.version()}, {"absent_because", peers.absent_because()}};
    json["aims"] = narrow_peak_aim(json["panels"].items.back());
    PALPATE_TRY(json["convergence"], convergence(bench, plan));
    PALPATE_TRY(json["factors"], factors_json(bench, plan.hypercube));
    return report;
}

} // namespace palpate::bench
