#include "engine/segment/method_runs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/segment/arrival_threshold.h"
#include "engine/segment/edges.h"
#include "engine/segment/fast_marching.h"
#include "engine/segment/flood.h"
#include "engine/segment/fuzzy_connectedness.h"
#include "engine/segment/label_samples.h"
#include "engine/segment/live_wire_surface.h"
#include "engine/segment/map_values.h"
#include "engine/segment/march_cost.h"
#include "engine/segment/mesh_fit.h"
#include "engine/segment/method_parts.h"
#include "engine/segment/random_walker.h"
#include "engine/segment/threshold.h"
#include "engine/segment/wire_curves.h"
#include "engine/volume/builder.h"

namespace palpate {

namespace {

constexpr double kAny = std::numeric_limits<double>::max();

Result<Volume> without_background(const Volume& labels, uint16_t background, const Task& task) {
    if (background == 0)
        return labels;
    const auto map = [&](std::array<float, 1> label) {
        return label[0] == float(background) ? 0.0f : label[0];
    };
    if (labels.type() == ScalarType::u8)
        return map_values<uint8_t>(std::array{&labels}, task,
                                   [&](auto v) { return uint8_t(map(v)); });
    return map_values<uint16_t>(std::array{&labels}, task,
                                [&](auto v) { return uint16_t(map(v)); });
}

// The winner's field times `sign`; no data where the background has won, so that every threshold of
// it is a segmentation.
Result<Volume> strength_of(const Winner& winner, const SegmentInput& input, float sign,
                           const Task& task) {
    const bool has_background = input.background != 0;
    return map_values<float>(std::array{&winner.best(), &winner.owner()}, task,
                             [=, &input](auto v) {
                                 return has_background && v[1] == float(input.background)
                                            ? std::numeric_limits<float>::quiet_NaN()
                                            : sign * v[0];
                             });
}

} // namespace

Result<Segmented> run_threshold(const SegmentInput& input, const ParameterValues& values,
                                const Task& task) {
    const ValueInterval interval{is_set(values, "low") ? value_of(values, "low") : -kAny,
                                 is_set(values, "high") ? value_of(values, "high") : kAny};
    if (!is_set(values, "low") && !is_set(values, "high"))
        return fail("threshold: expected low, high or both");
    PALPATE_TRY(Volume labels, threshold_labels(input.volume, interval, task));
    return Segmented{std::move(labels), {}, {}, {}};
}

Result<Segmented> run_growing(const SegmentInput& input, const ParameterValues& values,
                              const Task& task) {
    Segmented made{*input.seeds, {}, {}, {}};
    std::vector<LabelInterval> intervals;
    for (const SeedValues& own : seed_values(input.volume, *input.seeds, input.balls)) {
        const double deviations = value_of(values, "deviations");
        PALPATE_TRY(const ObjectValues object,
                    object_values(input.volume, *input.seeds, own.label, input.balls, deviations,
                                  {task.stop, {}}));
        const SeedValues& seeds = object.values;
        // At least half-way to what lies around: there is the object's edge.
        const double reach = std::max(deviations * seeds.sd, 0.5 * object.contrast);
        const ValueInterval interval{
            is_set(values, "low") ? value_of(values, "low") : seeds.mean - reach,
            is_set(values, "high") ? value_of(values, "high") : seeds.mean + reach};
        intervals.push_back({seeds.label, interval});
        if (seeds.label != input.background) {
            made.found.try_emplace("low", interval.low);
            made.found.try_emplace("high", interval.high);
        }
        made.notes.push_back(
            fmt::format("label {}: values {:g} .. {:g}", seeds.label, interval.low, interval.high));
    }
    const auto neighbors = neighbors_of(int(value_of(values, "neighbors")));
    if (!neighbors)
        return fail("neighbors: expected 6, 18 or 26, found {:g}", value_of(values, "neighbors"));
    PALPATE_TRY(const Volume grown,
                region_growing(input.volume, *input.seeds, intervals, *neighbors, task));
    PALPATE_TRY(made.labels, without_background(grown, input.background, {task.stop, {}}));
    return made;
}

Result<Segmented> run_watershed(const SegmentInput& input, const ParameterValues& values,
                                const Task& task) {
    const auto neighbors = neighbors_of(int(value_of(values, "neighbors")));
    if (!neighbors)
        return fail("neighbors: expected 6, 18 or 26, found {:g}", value_of(values, "neighbors"));
    PALPATE_TRY(const Volume edges, edge_strength(input.volume, task.part(0.0, 0.2)));
    PALPATE_TRY(const Volume flooded,
                watershed(edges, *input.seeds, *neighbors, task.part(0.2, 1.0)));
    PALPATE_TRY(Volume labels, without_background(flooded, input.background, {task.stop, {}}));
    Segmented made{std::move(labels), {}, {}, {}};
    if (label_counts(*input.seeds).size() == 1)
        made.notes.push_back(
            "seeds of one label take the whole volume: add seeds outside under another label, and "
            "name it as the background");
    return made;
}

namespace {

Result<Volume> negated(const Volume& volume, const Task& task) {
    return map_values<float>(std::array{&volume}, task, [](auto v) { return -v[0]; });
}

} // namespace

Result<Segmented> run_connectedness(const SegmentInput& input, const ParameterValues& values,
                                    const Task& task) {
    Winner winner; // of 1 - connectedness
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds, input.balls);
    Segmented made{*input.seeds, {}, {}, {}};
    for (size_t i = 0; i < all.size(); ++i) {
        const double sd = spread_of(all[i], input.volume);
        const double homogeneity =
            is_set(values, "homogeneity") ? value_of(values, "homogeneity") : std::sqrt(2.0) * sd;
        const Affinity affinity{all[i].mean, value_of(values, "deviations") * sd, homogeneity,
                                value_of(values, "weight")};
        const Task part =
            task.part(double(i) / double(all.size()), double(i + 1) / double(all.size()));
        PALPATE_TRY(const Volume strength,
                    fuzzy_connectedness(input.volume, *input.seeds, all[i].label, affinity, part));
        PALPATE_TRY(const Volume weakness, negated(strength, {task.stop, {}}));
        PALPATE_TRY(winner.add(all[i].label, weakness, {task.stop, {}}));
        if (all[i].label != input.background)
            made.found.try_emplace("homogeneity", homogeneity);
        made.notes.push_back(fmt::format("label {}: values {:g} +- {:g}, homogeneity {:g}",
                                         all[i].label, all[i].mean, affinity.sd, homogeneity));
    }
    const double threshold = value_of(values, "threshold");
    PALPATE_TRY(made.labels, labels_of(winner, input, {task.stop, {}},
                                       [&](float v, uint16_t) { return -v >= threshold; }));
    PALPATE_TRY(made.strength, strength_of(winner, input, -1.0f, {task.stop, {}}));
    made.owner = winner.owner();
    return made;
}

Result<Segmented> run_walker(const SegmentInput& input, const ParameterValues& values,
                             const Task& task) {
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds, input.balls);
    RandomWalkerOptions options{.sd = value_of(values, "homogeneity"),
                                .tolerance = value_of(values, "tolerance")};
    if (!is_set(values, "homogeneity")) {
        options.sd = 0.0;
        for (const SeedValues& seeds : all)
            if (seeds.label != input.background)
                options.sd = std::max(options.sd, std::sqrt(2.0) * spread_of(seeds, input.volume));
    }
    Winner winner; // of 1 - probability
    Segmented made{*input.seeds, {}, {}, {fmt::format("homogeneity {:g}", options.sd)}};
    made.found["homogeneity"] = options.sd;
    for (size_t i = 0; i < all.size(); ++i) {
        const Task part =
            task.part(double(i) / double(all.size()), double(i + 1) / double(all.size()));
        PALPATE_TRY(const Volume probability,
                    random_walker(input.volume, *input.seeds, all[i].label, options, part));
        PALPATE_TRY(const Volume field, negated(probability, {task.stop, {}}));
        PALPATE_TRY(winner.add(all[i].label, field, {task.stop, {}}));
    }
    PALPATE_TRY(made.labels, labels_of(winner, input, {task.stop, {}},
                                       [](float v, uint16_t) { return v < 0.0f; }));
    PALPATE_TRY(made.strength, strength_of(winner, input, -1.0f, {task.stop, {}}));
    made.owner = winner.owner();
    return made;
}

namespace {

Result<Volume> march_cost(const SegmentInput& input, const SeedValues& seeds,
                          const ParameterValues& values, bool from_edges, Segmented& made,
                          const Task& task) {
    if (!from_edges) {
        const double deviations = value_of(values, "deviations");
        PALPATE_TRY(const ObjectValues found,
                    object_values(input.volume, *input.seeds, seeds.label, input.balls, deviations,
                                  {task.stop, {}}));
        const SeedValues& object = found.values;
        made.notes.push_back(fmt::format("label {}: values {:g} +- {:g} under {} seeds",
                                         object.label, object.mean, object.sd, object.count));
        return statistics_cost(
            input.volume, object,
            {deviations, value_of(values, "floor"), int(value_of(values, "passes"))}, task);
    }
    double edge = value_of(values, "edge");
    if (!is_set(values, "edge")) {
        PALPATE_TRY(edge, edge_under_seeds(input.volume, *input.seeds, seeds.label, task));
        if (seeds.label != input.background)
            made.found.try_emplace("edge", edge);
        made.notes.push_back(
            fmt::format("label {}: edges of {:g} units per mm under its seeds", seeds.label, edge));
    }
    return edge_cost(input.volume, edge, task);
}

// When a front stops; else how it grows, for a person who chooses a threshold.
struct Stop {
    std::optional<double> time;
    std::string grows{};
};
Result<Stop> time_to_stop(const Volume& arrival, const Volume& cost, const Volume& volume,
                          const ParameterValues& values, const Task& task) {
    Stop stop;
    if (value_of(values, "rule") == 0.0) {
        PALPATE_TRY(stop.time, band_cost_time(arrival, cost, value_of(values, "rise"), task));
    } else {
        PALPATE_TRY(stop.time, boundary_time(arrival, cost, volume, task));
    }
    if (stop.time)
        return stop;
    PALPATE_TRY(const ArrivalGrowth growth, arrival_growth(arrival, task));
    const double all = double(sample_count(arrival.grid()));
    for (const double share : {0.001, 0.01, 0.1, 0.5}) {
        const auto there = std::ranges::lower_bound(growth.counts, share * all);
        if (there == growth.counts.begin() || there == growth.counts.end())
            continue; // by the seeds, or never
        stop.grows += fmt::format("{}{:g} %{} by {:.3g}", stop.grows.empty() ? "" : ", ",
                                  100.0 * share, stop.grows.empty() ? " of the volume" : "",
                                  growth.times[size_t(there - growth.counts.begin())]);
    }
    return stop;
}

Result<Segmented> run_march(const SegmentInput& input, const ParameterValues& values,
                            bool from_edges, const Task& task) {
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds, input.balls);
    Segmented made{*input.seeds, {}, {}, {}};
    std::vector<double> last(65536, value_of(values, "threshold"));
    Winner winner;
    for (size_t i = 0; i < all.size(); ++i) {
        const double from = double(i) / double(all.size()), share = 1.0 / double(all.size());
        PALPATE_TRY(const Volume cost, march_cost(input, all[i], values, from_edges, made,
                                                  task.part(from, from + 0.2 * share)));
        std::vector<SeedBall> balls;
        for (const SeedBall& ball : input.balls)
            if (ball.label == all[i].label)
                balls.push_back(ball);
        MarchStart start{.seeds = &*input.seeds, .label = all[i].label, .balls = {}};
        if (!input.balls.empty())
            start = {.balls = balls};
        const FastMarchingOptions options{.order = int(value_of(values, "order"))};
        const bool is_object = all[i].label != input.background;
        Task marching = task.part(from + 0.2 * share, from + 0.9 * share);
        if (!is_object)
            marching.look = {};
        PALPATE_TRY(const Volume arrival, fast_marching(cost, start, options, marching));
        if (is_object && !is_set(values, "threshold")) {
            PALPATE_TRY(const Stop stop,
                        time_to_stop(arrival, cost, input.volume, values, {task.stop, {}}));
            last[all[i].label] = stop.time.value_or(-1.0); // before the seeds: no sample
            if (stop.time) {
                made.notes.push_back(
                    fmt::format("label {}: stopped at {:g}", all[i].label, *stop.time));
                made.found.try_emplace("threshold", *stop.time);
            } else {
                made.unbounded.push_back(
                    {all[i].label,
                     fmt::format("label {}: the front met no boundary that tells it to stop: "
                                 "choose a threshold of its arrival times{}{}",
                                 all[i].label, stop.grows.empty() ? "" : "; it covers ",
                                 stop.grows)});
            }
        }
        if (is_object && !made.cost)
            made.cost = cost;
        PALPATE_TRY(winner.add(all[i].label, arrival, {task.stop, {}}));
    }
    PALPATE_TRY(made.labels,
                labels_of(winner, input, {task.stop, {}},
                          [&](float time, uint16_t label) { return double(time) <= last[label]; }));
    PALPATE_TRY(made.strength, strength_of(winner, input, 1.0f, {task.stop, {}}));
    made.owner = winner.owner();
    return made;
}

} // namespace

Result<Segmented> run_march_edges(const SegmentInput& input, const ParameterValues& values,
                                  const Task& task) {
    return run_march(input, values, true, task);
}

Result<Segmented> run_march_statistics(const SegmentInput& input, const ParameterValues& values,
                                       const Task& task) {
    return run_march(input, values, false, task);
}

namespace {

// Whether a label's samples are one sample thick along an axis on which the volume has more.
bool lies_in_a_plane(const Volume& labels, uint16_t label) {
    glm::ivec3 low(std::numeric_limits<int>::max()), high(-1);
    for_each_of_label(labels, label, [&](glm::ivec3 at) {
        low = glm::min(low, at);
        high = glm::max(high, at);
    });
    bool any = false;
    for (int k = 0; k < 3; ++k)
        any = any || (low[k] == high[k] && labels.size()[k] > 1);
    return any;
}

} // namespace

Result<Segmented> run_mesh(const SegmentInput& input, const ParameterValues& values,
                           const Task& task) {
    const std::vector<LabelCount> all = label_counts(*input.seeds);
    Segmented made{*input.seeds, {}, {}, {}};
    std::optional<Volume> labels;
    for (size_t i = 0; i < all.size(); ++i) {
        if (all[i].label == input.background)
            continue;
        const bool stays = value_of(values, "edges") == 0.0;
        if (stays && (!input.balls.empty() || lies_in_a_plane(*input.seeds, all[i].label)))
            return fail(
                "simplex-mesh: label {}: expected a body for the mesh to lie about, such as "
                "another "
                "method's result (--start), found seeds; or let the mesh look for edges (--edges)",
                all[i].label);
        const Task part =
            task.part(double(i) / double(all.size()), double(i + 1) / double(all.size()));
        MeshFitOptions options{.label = all[i].label,
                               .subdivisions = uint32_t(value_of(values, "subdivisions")),
                               .steps = uint32_t(value_of(values, "steps")),
                               .edges_mm = value_of(values, "edges")};
        options.simplex.rigidity = uint32_t(value_of(values, "rigidity"));
        PALPATE_TRY(const MeshFit fit, fit_mesh(input.volume, *input.seeds, options, part));
        made.notes.push_back(fmt::format("label {}: a mesh of {} vertices, {} steps", all[i].label,
                                         fit.mesh.positions.size(), fit.steps));
        if (fit.self_intersections > 0)
            made.notes.push_back(fmt::format("label {}: the mesh cuts itself in {} places",
                                             all[i].label, fit.self_intersections));
        if (!labels) {
            labels = fit.labels;
            continue;
        }
        PALPATE_TRY(labels, map_values<uint16_t>(
                                std::array{&std::as_const(*labels), &std::as_const(fit.labels)},
                                {task.stop, {}},
                                [](auto v) { return uint16_t(v[0] > 0.0f ? v[0] : v[1]); }));
    }
    if (!labels)
        return fail("simplex-mesh: all seeds are those of the background");
    made.labels = *labels;
    return made;
}

Result<Segmented> run_wires(const SegmentInput& input, const ParameterValues& values,
                            const Task& task) {
    std::vector<WireCurve> curves = input.curves;
    if (value_of(values, "follow") != 0.0) {
        // Curves that are wrong are refused before work begins.
        PALPATE_TRY(wire_bodies(input.volume.grid(), curves));
        const double share = 0.5 / double(curves.size());
        for (size_t i = 0; i < curves.size(); ++i) {
            PALPATE_TRY(curves[i],
                        along_edges(input.volume, curves[i], {},
                                    task.part(double(i) * share, double(i + 1) * share)));
        }
    }
    PALPATE_TRY(LiveWireSurface made,
                live_wire_surface(input.volume.grid(), curves, task.part(0.5, 1.0)));
    return Segmented{std::move(made.labels), {}, {}, {}, {}, std::move(curves)};
}

} // namespace palpate
