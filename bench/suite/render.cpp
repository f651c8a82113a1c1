// Modes, integrators and sizes on the head CT: time beside error, and the aims beside VTK.

#include <algorithm>
#include <optional>

#include "bench/suite/relative.h"
#include "bench/suite/suites.h"
#include "engine/base/log.h"
#include "engine/scene/presets.h"

namespace palpate::bench {

namespace {

struct Plan {
    std::vector<uint32_t> sizes_px, fine_sizes_px; // of the CT, and of the finer one
    uint32_t rays_px;                              // scored, on each side
    int rounds;
    double peer_budget_s;
    int pairs, named_pairs; // of frames, for `relative`; where that is asked for by name
};

Plan plan_of(const Options& options) {
    if (options.tiny)
        return {{24, 32}, {}, 16, 1, 0.1, 1, 1};
    if (options.full)
        return {{512, 1024}, {512, 1024}, 256, 10, 6.0, 30, 30};
    return {{512}, {1024}, 64, 3, 4.0, 9, 21};
}

std::vector<Setting> settings(RayMode mode, bool with_exact) {
    std::vector<Setting> all{{"fast", 1.0, 0}};
    if (mode == RayMode::alpha)
        all.push_back({"preintegrated", 1.0, 0});
    if (with_exact)
        all.push_back({"exact", 1.0, mode == RayMode::alpha ? 8u : 0u});
    return all;
}

std::vector<Subject> subjects_of(const Sample& sample) {
    return {alpha_subject(sample, *preset("ct-peer"), ""),
            shaded_subject(sample, *preset("ct-peer")), mip_subject(sample, -200, 2000),
            iso_subject(sample, 300)};
}

// How many times faster than a mapper each mode should be.
struct Aim {
    const char* mode; // as peers call it
    const char* mapper;
    double times_faster;
};
constexpr Aim kAims[] = {{"alpha_shaded", "fixed", 1.9}, {"alpha", "fixed", 1.9},
                         {"mip", "fixed", 1.5},          {"iso", "fixed", 4.5},
                         {"alpha_shaded", "gpu", 10.0},  {"iso", "gpu", 50.0}};

// The default held against a mapper at step 1: speed, and error where both are scored.
void add_aims(const Subject& subject, uint32_t size_px, const Bench::Drawn& mine,
              const std::vector<PeerPoint>& peers, Json& aims) {
    for (const Aim& aim : kAims)
        for (const PeerPoint& peer : peers) {
            if (subject.peers != aim.mode || peer.subject != subject.name ||
                peer.mapper != aim.mapper)
                continue;
            const double ratio = spread(peer.wall_ms).median / spread(mine.frames.wall_ms).median;
            const bool exact_enough = !peer.errors || mine.errors.rmse <= peer.errors->rmse;
            std::string what =
                fmt::format("{}, {} px: times faster than {}", subject.title, size_px, peer.name());
            if (peer.errors)
                what += fmt::format(", RMSE {:.3g} beside {:.3g} {}", mine.errors.rmse,
                                    peer.errors->rmse, mine.errors.unit);
            add_aim(aims, what,
                    fmt::format("at least {:g}{}", aim.times_faster,
                                peer.errors ? ", with no more error" : ""),
                    ratio, ratio >= aim.times_faster && exact_enough);
        }
}

void add_first_frame_aims(const Subject& subject, double first_ms,
                          const std::vector<PeerPoint>& peers, Json& aims) {
    for (const PeerPoint& peer : peers)
        if (peer.subject == subject.name) {
            const double share = first_ms / peer.first_frame_ms;
            const double most = peer.mapper == "gpu" ? 0.5 : 1.0;
            add_aim(aims,
                    fmt::format("{}: first frame ({:.0f} ms) beside that of {} ({:.0f} ms)",
                                subject.title, first_ms, peer.name(), peer.first_frame_ms),
                    fmt::format("at most {:g}", most), share, share <= most);
        }
}

// The parts that --only names. Asked for by name, the moving hand is looked at from all round, too.
struct Parts {
    bool frames = true, relative = true;
    int pairs = 0;
    std::vector<double> turned_degrees{0.0}; // of the first sample
};

Result<Parts> parts_of(const Options& options) {
    Parts parts;
    parts.pairs = plan_of(options).pairs;
    if (options.only.empty())
        return parts;
    parts.frames = parts.relative = false;
    parts.turned_degrees = {0.0, 90.0, 180.0, 270.0};
    parts.pairs = plan_of(options).named_pairs;
    for (const std::string& name : options.only)
        if (name == "frames")
            parts.frames = true;
        else if (name == "relative")
            parts.relative = true;
        else
            return fail("--only: expected parts of render (frames, relative), found '{}'", name);
    return parts;
}

std::vector<Sample> samples_of(const Options& options, Json& notes) {
    std::vector<Sample> samples;
    if (options.tiny) {
        samples.push_back(ball(32));
        return samples;
    }
    Result<Sample> ct = head_ct(options.head_ct);
    if (ct) {
        samples.push_back(std::move(*ct));
        samples.push_back(resampled(samples[0], {512, 512, 174}, "head_ct_fine"));
    } else {
        notes.push_back("The head CT was left out, the phantom stands in: " + ct.error().message);
        samples.push_back(phantom(256));
    }
    return samples;
}

// Times and errors of every setting, VTK drawing between the rounds.
Result<void> measure_frames(Bench& bench, Peers& peers, const Subject& subject,
                            const std::vector<Setting>& settings, Sampling sampling,
                            bool with_first_frame, Report& report) {
    const Plan plan = plan_of(bench.options());
    Json& json = report.json;
    PALPATE_TRY(peers.open(subject));
    PALPATE_TRY(const auto drawn, bench.draw(subject, settings, sampling, plan.rounds,
                                             [&] { peers.time_frames(3, plan.peer_budget_s); }));
    Json panel = panel_json(subject, drawn, peers.points(), sampling, report.failures);
    panel["title"] = fmt::format("{}, {} px", subject.title, sampling.size_px);
    json["panels"].push_back(std::move(panel));
    add_aims(subject, sampling.size_px, drawn.front(), peers.points(), json["aims"]);
    if (!with_first_frame)
        return {};
    PALPATE_TRY(const double first,
                bench.first_frame_ms(subject, default_setting(), sampling.size_px));
    json["first_frames"].push_back(
        {{"subject", subject.name}, {"renderer", "palpate"}, {"ms", first}});
    for (const PeerPoint& peer : peers.points())
        if (peer.subject == subject.name)
            json["first_frames"].push_back({{"subject", subject.name},
                                            {"renderer", peer.name()},
                                            {"ms", peer.first_frame_ms}});
    add_first_frame_aims(subject, first, peers.points(), json["aims"]);
    return {};
}

} // namespace

Result<Report> run_render(Bench& bench) {
    const Options& options = bench.options();
    const Plan plan = plan_of(options);
    PALPATE_TRY(const Parts parts, parts_of(options));
    Report report;
    Json& json = report.json;
    for (const char* key : {"notes", "panels", "aims", "first_frames", "relative"})
        json[key] = Json::array();
    json["peers"] = Json::object();
    const std::vector<Sample> samples = samples_of(options, json["notes"]);
    for (const Sample& sample : samples) {
        std::vector<Subject> subjects = subjects_of(sample);
        for (Subject& subject : subjects)
            subject.judged = subject.judged && !options.tiny; // whose times say nothing
        const bool is_first = &sample == &samples.front();
        const std::vector<uint32_t>& sizes_px = is_first ? plan.sizes_px : plan.fine_sizes_px;
        // The exact integrator takes seconds a frame at 1024 pixels; no target is set for it there.
        const bool with_exact = options.full || options.tiny || is_first;
        for (const uint32_t size_px : sizes_px) {
            const Sampling sampling{size_px, std::max(1u, size_px / plan.rays_px)};
            const bool is_least = size_px == sizes_px.front();
            std::optional<Peers> peers;
            if (parts.frames) {
                PALPATE_TRY(Peers started, Peers::start(bench, subjects, {1.0}, sampling));
                peers.emplace(std::move(started));
            }
            for (const Subject& subject : subjects) {
                log::info("{}, {} px", subject.name, size_px);
                if (parts.frames)
                    PALPATE_TRY(measure_frames(bench, *peers, subject,
                                               settings(subject.layer.mode, with_exact), sampling,
                                               is_least, report));
                if (!parts.relative || !is_least)
                    continue;
                const std::span<const double> turns(parts.turned_degrees);
                PALPATE_TRY(Json relative,
                            measure_relative(bench, subject, size_px, parts.pairs,
                                             is_first ? turns : turns.first(1), json["aims"]));
                json["relative"].push_back(std::move(relative));
            }
            if (peers)
                json["peers"] = {{"vtk", peers->version()},
                                 {"absent_because", peers->absent_because()}};
        }
    }
    return report;
}

} // namespace palpate::bench
