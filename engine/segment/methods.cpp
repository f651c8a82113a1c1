#include "engine/segment/methods.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/segment/arrival_threshold.h"
#include "engine/segment/edges.h"
#include "engine/segment/fast_marching.h"
#include "engine/segment/flood.h"
#include "engine/segment/fuzzy_connectedness.h"
#include "engine/segment/map_values.h"
#include "engine/segment/march_cost.h"
#include "engine/segment/threshold.h"
#include "engine/volume/builder.h"

namespace palpate {

namespace {

constexpr double kAny = std::numeric_limits<double>::max();
constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();

bool is_set(const ParameterValues& values, std::string_view name) {
    return !std::isnan(values.find(name)->second);
}
double value_of(const ParameterValues& values, std::string_view name) {
    return values.find(name)->second;
}

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

// Which label a field belongs to, sample by sample: of several fields the one with the least value.
class Winner {
 public:
    // A later field wins only where it is less. No data never wins.
    Result<void> add(uint16_t label, const Volume& field, const Task& task) {
        if (!best_) {
            best_ = field;
            PALPATE_TRY(owner_, map_values<uint16_t>(std::array{&field}, task, [=](auto v) {
                            return std::isnan(v[0]) ? uint16_t{0} : label;
                        }));
            return {};
        }
        const auto wins = [](float later, float best) {
            return later < best || (std::isnan(best) && !std::isnan(later));
        };
        PALPATE_TRY(Volume owner,
                    map_values<uint16_t>(std::array{&best(), &field, &owner()}, task, [&](auto v) {
                        return wins(v[1], v[0]) ? label : uint16_t(v[2]);
                    }));
        PALPATE_TRY(best_, map_values<float>(std::array{&best(), &field}, task, [&](auto v) {
                        return wins(v[1], v[0]) ? v[1] : v[0];
                    }));
        owner_ = std::move(owner);
        return {};
    }
    const Volume& best() const { return *best_; }
    const Volume& owner() const { return *owner_; }

 private:
    std::optional<Volume> best_, owner_;
};

// The labels of a winner where its field passes, in the type of the seeds.
template <class Passes>
Result<Volume> labels_of(const Winner& winner, const SegmentInput& input, const Task& task,
                         const Passes& passes) {
    const auto label = [&](std::array<float, 2> v) {
        return v[1] != float(input.background) && passes(v[0], uint16_t(v[1])) ? v[1] : 0.0f;
    };
    const std::array<const Volume*, 2> fields{&winner.best(), &winner.owner()};
    if (input.seeds->type() == ScalarType::u8)
        return map_values<uint8_t>(fields, task, [&](auto v) { return uint8_t(label(v)); });
    return map_values<uint16_t>(fields, task, [&](auto v) { return uint16_t(label(v)); });
}

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
    for (const SeedValues& seeds : seed_values(input.volume, *input.seeds)) {
        const double reach = value_of(values, "deviations") * spread_of(seeds, input.volume);
        const ValueInterval interval{
            is_set(values, "low") ? value_of(values, "low") : seeds.mean - reach,
            is_set(values, "high") ? value_of(values, "high") : seeds.mean + reach};
        intervals.push_back({seeds.label, interval});
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
    return Segmented{std::move(labels), {}, {}, {}};
}

Result<Segmented> run_connectedness(const SegmentInput& input, const ParameterValues& values,
                                    const Task& task) {
    Winner winner; // of 1 - connectedness
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds);
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
        PALPATE_TRY(const Volume weakness, map_values<float>(std::array{&strength}, {task.stop, {}},
                                                             [](auto v) { return -v[0]; }));
        PALPATE_TRY(winner.add(all[i].label, weakness, {task.stop, {}}));
        made.notes.push_back(fmt::format("label {}: values {:g} +- {:g}, homogeneity {:g}",
                                         all[i].label, all[i].mean, affinity.sd, homogeneity));
    }
    const double threshold = value_of(values, "threshold");
    PALPATE_TRY(made.labels, labels_of(winner, input, {task.stop, {}},
                                       [&](float v, uint16_t) { return -v >= threshold; }));
    PALPATE_TRY(made.strength, map_values<float>(std::array{&winner.best()}, {task.stop, {}},
                                                 [](auto v) { return -v[0]; }));
    return made;
}

Result<Volume> march_cost(const SegmentInput& input, const SeedValues& seeds,
                          const ParameterValues& values, bool from_edges, Segmented& made,
                          const Task& task) {
    if (!from_edges) {
        made.notes.push_back(fmt::format("label {}: values {:g} +- {:g} under {} seeds",
                                         seeds.label, seeds.mean, seeds.sd, seeds.count));
        return statistics_cost(input.volume, seeds,
                               {value_of(values, "deviations"), value_of(values, "floor"),
                                int(value_of(values, "passes"))},
                               task);
    }
    double edge = value_of(values, "edge");
    if (!is_set(values, "edge")) {
        PALPATE_TRY(edge, edge_under_seeds(input.volume, *input.seeds, seeds.label, task));
        made.notes.push_back(
            fmt::format("label {}: edges of {:g} units per mm under its seeds", seeds.label, edge));
    }
    return edge_cost(input.volume, edge, task);
}

Result<double> time_to_stop(const Volume& arrival, const Volume& cost,
                            const ParameterValues& values, const Task& task) {
    std::optional<double> time;
    if (value_of(values, "rule") == 0.0) {
        PALPATE_TRY(time, band_cost_time(arrival, cost, value_of(values, "rise"), task));
    } else {
        PALPATE_TRY(const ArrivalGrowth growth, arrival_growth(arrival, task));
        time = boundary_time(growth);
    }
    if (!time)
        return fail("the front met no boundary that tells it to stop: choose a threshold");
    return *time;
}

Result<Segmented> run_march(const SegmentInput& input, const ParameterValues& values,
                            bool from_edges, const Task& task) {
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds);
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
        PALPATE_TRY(
            const Volume arrival,
            fast_marching(cost, start, options, task.part(from + 0.2 * share, from + 0.9 * share)));
        const bool is_object = all[i].label != input.background;
        if (is_object && !is_set(values, "threshold")) {
            PALPATE_TRY(last[all[i].label], time_to_stop(arrival, cost, values, {task.stop, {}}));
            made.notes.push_back(
                fmt::format("label {}: stopped at {:g}", all[i].label, last[all[i].label]));
        }
        if (is_object && !made.cost)
            made.cost = cost;
        PALPATE_TRY(winner.add(all[i].label, arrival, {task.stop, {}}));
    }
    PALPATE_TRY(made.labels,
                labels_of(winner, input, {task.stop, {}},
                          [&](float time, uint16_t label) { return double(time) <= last[label]; }));
    made.strength = winner.best();
    return made;
}

Result<Segmented> run_march_edges(const SegmentInput& input, const ParameterValues& values,
                                  const Task& task) {
    return run_march(input, values, true, task);
}
Result<Segmented> run_march_statistics(const SegmentInput& input, const ParameterValues& values,
                                       const Task& task) {
    return run_march(input, values, false, task);
}

const MethodParameter kLow{"low",
                           "value",
                           -kAny,
                           kAny,
                           kUnset,
                           "from the method",
                           "Least value that belongs to the object"};
const MethodParameter kHigh{"high",
                            "value",
                            -kAny,
                            kAny,
                            kUnset,
                            "from the method",
                            "Greatest value that belongs to the object"};
const MethodParameter kNeighbors{"neighbors",
                                 "",
                                 6,
                                 26,
                                 6,
                                 nullptr,
                                 "Neighbours of a sample: 6 by faces, 18 by edges too, 26 by "
                                 "corners too"};
const MethodParameter kDeviations{"deviations",
                                  "",
                                  1e-3,
                                  1e3,
                                  2.0,
                                  nullptr,
                                  "Standard deviations of the values under the seeds that count as "
                                  "the object's spread"};
const MethodParameter kTime{"threshold",
                            "time or strength",
                            0.0,
                            kAny,
                            kUnset,
                            "from the front",
                            "Samples that the front reaches by this time (mm times cost), or that "
                            "are connected at least this strongly (0 .. 1), are the object"};
const MethodParameter kOrder{"order", "", 1, 2, 2, nullptr, "Order of the differences, 1 or 2"};
const MethodParameter kRule{"rule",
                            "",
                            0,
                            1,
                            1,
                            nullptr,
                            "How a threshold is found: 0 as printed, by the mean cost of the "
                            "front's band; 1 by the growth of the volume"};
const MethodParameter kRise{"rise",
                            "",
                            1.001,
                            1e6,
                            3.0,
                            nullptr,
                            "Rule 0: the mean cost of the band, as a multiple of its first, that "
                            "stops the front"};

} // namespace

std::span<const SegmentMethod> segment_methods() {
    static const std::vector<SegmentMethod> methods = [] {
        MethodParameter strength = kTime;
        strength.most = 1.0, strength.fallback = 0.5, strength.fallback_text = nullptr;
        return std::vector<SegmentMethod>{
            {"threshold",
             "All samples with values from low to high",
             false,
             nullptr,
             {kLow, kHigh},
             run_threshold},
            {"region-growing",
             "Samples with values like the seeds', joined to a seed",
             true,
             nullptr,
             {kLow, kHigh, kDeviations, kNeighbors},
             run_growing},
            {"watershed",
             "Every sample to the seeds that reach it over the lowest edge",
             true,
             nullptr,
             {kNeighbors},
             run_watershed},
            {"fast-marching",
             "A front that is fast where values are like the seeds'",
             true,
             "arrival time, mm times cost",
             {kTime,
              {"deviations", "", 1e-3, 1e3, 2.5, nullptr,
               "Standard deviations of the values under the seeds at which a front has cost 1"},
              {"floor", "", 1e-6, 1e3, 0.01, nullptr, "Cost where values are the seeds' mean"},
              {"passes", "", 0, 10, 1, nullptr,
               "Times that values are smoothed by (1 2 1) / 4 before their cost is taken"},
              kOrder,
              kRule,
              kRise},
             run_march_statistics},
            {"fast-marching-edges",
             "A front that is fast where the gradient is small",
             true,
             "arrival time, mm times cost",
             {kTime,
              {"edge", "value/mm", 1e-9, kAny, kUnset, "the seeds' mean",
               "Gradient at which the front is slower by a factor of e"},
              kOrder,
              kRule,
              kRise},
             run_march_edges},
            {"fuzzy-connectedness",
             "The strongest path of like neighbours to a seed",
             true,
             "connectedness, 0 .. 1",
             {strength,
              kDeviations,
              {"homogeneity", "value", 1e-9, kAny, kUnset, "1.41 sd of the seeds",
               "Standard deviation of differences of neighbours within the object"},
              {"weight", "", 0.0, 1.0, 0.5, nullptr,
               "Share of the neighbours' likeness in their affinity; the rest is the likeness to "
               "the seeds"}},
             run_connectedness},
        };
    }();
    return methods;
}

const SegmentMethod* find_segment_method(std::string_view name) {
    for (const SegmentMethod& method : segment_methods())
        if (name == method.name)
            return &method;
    return nullptr;
}

Result<Segmented> segment(const SegmentMethod& method, const SegmentInput& input,
                          const ParameterValues& given, const Task& task) {
    ParameterValues values;
    for (const MethodParameter& parameter : method.parameters)
        values[parameter.name] = parameter.fallback;
    for (const auto& [name, value] : given) {
        const auto known = std::ranges::find_if(
            method.parameters, [&, &n = name](const auto& p) { return n == p.name; });
        if (known == method.parameters.end())
            return fail("{}: has no parameter {}", method.name, name);
        if (!(value >= known->least && value <= known->most))
            return fail("{}: {}: expected {:g} .. {:g}, found {:g}", method.name, name,
                        known->least, known->most, value);
        values[name] = value;
    }
    if (!method.takes_seeds)
        return method.run(input, values, task);
    if (!input.seeds)
        return fail("{}: expected seeds", method.name);
    PALPATE_TRY(const Volume seeds, checked_seeds(input.volume, *input.seeds, "seeds"));
    SegmentInput checked{input.volume, seeds, input.balls, input.background};
    return method.run(checked, values, task);
}

} // namespace palpate
