#include "engine/segment/methods.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/segment/map_values.h"
#include "engine/segment/method_runs.h"

namespace palpate {

namespace {

constexpr double kAnyValue = std::numeric_limits<double>::max();
constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();

const MethodParameter kLow{"low",
                           "value",
                           -kAnyValue,
                           kAnyValue,
                           kUnset,
                           "from the method",
                           "Least value that belongs to the object"};
const MethodParameter kHigh{"high",
                            "value",
                            -kAnyValue,
                            kAnyValue,
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
                            kAnyValue,
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
                            "front's band; 1 by the clearest boundary that the front lies on"};
const MethodParameter kRise{"rise",
                            "",
                            1.001,
                            1e6,
                            3.0,
                            nullptr,
                            "Rule 0: the mean cost of the band, as a multiple of its first, that "
                            "stops the front"};

const MethodParameter kCurvature{"curvature",
                                 "mm",
                                 0.0,
                                 kAnyValue,
                                 kUnset,
                                 "half the smallest spacing",
                                 "Weight of the curvature: at full speed, bumps of less than twice "
                                 "this radius go away"};
const MethodParameter kIterations{
    "iterations", "", 0, 1e6, 500, nullptr, "Largest number of steps that the surface moves"};
const MethodParameter kChange{"change",
                              "mm",
                              0.0,
                              kAnyValue,
                              kUnset,
                              "1/500 of the smallest spacing",
                              "Ends once a step changes distances at the surface by no more, root "
                              "mean square"};

} // namespace

std::span<const SegmentMethod> segment_methods() {
    static const std::vector<SegmentMethod> methods = [] {
        MethodParameter strength = kTime;
        strength.most = 1.0, strength.fallback = 0.5, strength.fallback_text = nullptr;
        return std::vector<SegmentMethod>{
            {"threshold",
             "All samples with values from low to high",
             false,
             {},
             {kLow, kHigh},
             run_threshold},
            {"otsu",
             "Classes of values by the thresholds that separate them best (Otsu); the lowest is no "
             "label",
             false,
             {},
             {{"classes", "", 2, 6, 2, nullptr, "How many classes, with the lowest"}},
             run_otsu},
            {"region-growing",
             "Samples with values like the seeds', joined to a seed",
             true,
             {},
             {kLow, kHigh, kDeviations, kNeighbors},
             run_growing},
            {"grow-from-seeds",
             "Every sample to the seeds that reach it first while water rises over the edges; "
             "takes "
             "seeds of all objects and of what lies around them",
             true,
             {},
             {{"height", "mm", 1e-3, 1e7, kUnset, "5 diagonals of the volume",
               "Way that the steepest edge counts as: more follows edges, less takes the nearest "
               "seed"}},
             run_grow,
             false,
             false,
             true},
            {"watershed",
             "Every sample to the seeds that reach it over the lowest edge",
             true,
             {},
             {kNeighbors},
             run_watershed},
            {"fast-marching",
             "A front that is fast where values are like the seeds'",
             true,
             {{"arrival time, mm times cost", true}},
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
             {{"arrival time, mm times cost", true}},
             {kTime,
              {"edge", "value/mm", 1e-9, kAnyValue, kUnset, "the seeds' mean",
               "Gradient at which the front is slower by a factor of e"},
              kOrder,
              kRule,
              kRise},
             run_march_edges},
            {"fuzzy-connectedness",
             "The strongest path of like neighbours to a seed",
             true,
             {{"connectedness, 0 .. 1"}},
             {strength,
              kDeviations,
              {"homogeneity", "value", 1e-9, kAnyValue, kUnset, "1.41 sd of the seeds",
               "Standard deviation of differences of neighbours within the object"},
              {"weight", "", 0.0, 1.0, 0.5, nullptr,
               "Share of the neighbours' likeness in their affinity; the rest is the likeness to "
               "the seeds"}},
             run_connectedness},
            {"random-walker",
             "The label that a random walker meets first; takes seeds inside and outside",
             true,
             {{"probability of the label, 0 .. 1"}},
             {{"homogeneity", "value", 1e-9, kAnyValue, kUnset, "1.41 sd of the seeds",
               "Standard deviation of differences of neighbours within the object"},
              {"tolerance", "", 1e-7, 0.1, 1e-4, nullptr,
               "Largest change of a probability in the last sweep"}},
             run_walker},
            {"simplex-mesh",
             "A deformable mesh about the seeds, such as another method's result (--start): evens "
             "its surface, closes holes, does not follow thin leaks",
             true,
             {},
             {{"rigidity", "", 0, 64, 1, nullptr,
               "Passes that even out the mesh's curvature; more is more rigid"},
              {"steps", "", 1, 100000, 1200, nullptr, "Largest number of steps"},
              {"subdivisions", "", 0, 7, 4, nullptr, "The mesh has 20 * 4^n vertices"},
              {"edges", "mm", 0.0, 1000.0, 0.0, nullptr,
               "Range along the normal in which the mesh then looks for the strongest edge of the "
               "values; 0: it stays at the seeds' surface"}},
             run_mesh},
            {"level-set",
             "A surface from the seeds that grows over values from low to high, and stays even",
             true,
             {},
             {kLow, kHigh, kDeviations, kCurvature, kIterations, kChange},
             run_level_threshold,
             false,
             true},
            {"level-set-edges",
             "A surface from the seeds that grows until edges hold it (geodesic active contour)",
             true,
             {},
             {{"edge", "value/mm", 1e-9, kAnyValue, kUnset, "3 times the seeds' mean",
               "Gradient at which the surface has half its speed"},
              {"exponent", "", 0.1, 20.0, 2.0, nullptr, "How sharply speed falls at that gradient"},
              {"sigma", "mm", 0.0, 1000.0, 1.0, nullptr,
               "Standard deviation that values are smoothed by for their gradient"},
              {"propagation", "", -1e3, 1e3, 1.0, nullptr,
               "Speed where there is no edge; below 0 the surface shrinks"},
              {"advection", "mm", 0.0, kAnyValue, 2.0, nullptr,
               "Weight of the pull to edges that are near"},
              {"flow", "mm", 0.0, kAnyValue, 0.0, nullptr,
               "Weight of the pull to edges that are far: gradient vector flow"},
              kCurvature,
              kIterations,
              kChange},
             run_level_edges,
             false,
             true},
            {"level-set-regions",
             "A surface between two kinds of seeds, inside and outside, whose values compete "
             "(region competition)",
             true,
             {},
             {kCurvature, kIterations, kChange},
             run_level_regions,
             false,
             true},
            {"live-wire-surface",
             "The closed surface through closed curves that cross each other, and what is within",
             false,
             {},
             {{"follow", "", 0, 1, 1, nullptr,
               "1: from each point of a curve to the next along edges of the values; 0: straight"}},
             run_wires,
             true},
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

bool is_object_below(const SegmentMethod& method) {
    return method.strength && method.strength->is_object_below;
}

Result<Volume> bounded_labels(const Volume& strength, const Volume& owner, bool below, double bound,
                              const Task& task) {
    if (strength.grid() != owner.grid())
        return fail("expected a strength and its owners on one grid, found two");
    return map_values<uint16_t>(std::array{&strength, &owner}, task, [=](auto v) {
        const bool is_in = below ? double{v[0]} <= bound : double{v[0]} >= bound; // not of NaN
        return is_in ? uint16_t(v[1]) : uint16_t{0};
    });
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
    if (input.kept && !method.keeps_runs)
        input.kept->reset();
    if (method.takes_curves && input.curves.empty())
        return fail("{}: expected closed curves", method.name);
    if (!method.takes_seeds)
        return method.run(input, values, task);
    if (!input.seeds)
        return fail("{}: expected seeds", method.name);
    PALPATE_TRY(const Volume seeds, checked_seeds(input.volume, *input.seeds, "seeds"));
    SegmentInput checked{input.volume, seeds, input.balls, input.background};
    checked.kept = input.kept;
    PALPATE_TRY(Segmented made, method.run(checked, values, task));
    if (made.unbounded.empty() || input.keeps_unbounded)
        return made;
    std::string why;
    for (const Unbounded& one : made.unbounded)
        why += (why.empty() ? "" : "; ") + one.why;
    return fail("{}", why);
}

} // namespace palpate
