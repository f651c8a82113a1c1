// Level sets as rows of the table of methods.

#include <algorithm>
#include <functional>

#include "engine/segment/level_set.h"
#include "engine/segment/level_set_speed.h"
#include "engine/segment/map_values.h"
#include "engine/segment/march_cost.h"
#include "engine/segment/method_parts.h"
#include "engine/segment/method_runs.h"
#include "engine/segment/signed_distance.h"
#include "engine/segment/vector_flow.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

// The last steps of a surface of the usual curvature: the share of it, and for how long, in
// the smallest spacing. The surface goes no farther than that.
constexpr double kLastCurvature = 0.05, kLastWay = 4.0;
// The last steps to an edge end when the surface has come to a twentieth of its distance, exp(-3),
// on an edge of up to 4 sigma, whose profile is sqrt(4.4) sigma wide (edge_place_speed).
constexpr double kLastFalls = 3.0, kWidestEdge = 4.4;

// Findings from the data, for people and as values of parameters.
struct Found {
    std::string note;
    ParameterValues values{};
};
struct Forces {
    std::optional<Volume> speed, edge;
    std::optional<VectorField> flow;
    // The speed of the last steps of a surface that has come to rest with this signed distance, in
    // the place of all other forces; none: these go on.
    std::function<Result<Volume>(const Volume& distance, const Task& task)> last_speed{};
    // How long they take at most, in mm, and how far the surface is moved outward after them.
    double last_time = 0.0;
    std::function<Result<Volume>(const Volume& distance, const Task& task)> last_shift{};
};

// Gradient vector flow of the volume's edges, as packed floats. The edges are computed once an
// axis, so that none are held while the flow is.
Result<VectorField> flow_of(const Volume& volume, double sigma_mm, const Task& task) {
    std::vector<Volume> parts;
    for (int axis = 0; axis < 3; ++axis) {
        const Task part = task.part(axis / 3.0, (axis + 1) / 3.0);
        PALPATE_TRY(Volume slopes, gradient_magnitude(volume, {sigma_mm}, {part.stop, {}}));
        PALPATE_TRY(Volume flow, vector_flow(std::move(slopes), axis, {.packed = true}, part));
        parts.push_back(std::move(flow));
    }
    return VectorField{parts[0], parts[1], parts[2]};
}

// A signed distance of a surface that is moved outward by so much; what is the farthest stays.
Result<Volume> moved_outward(const Volume& distance, const Volume& shift_mm, const Task& task) {
    const float most = std::max(-distance.range().min, distance.range().max);
    return map_values<float>(std::array{&distance, &shift_mm}, task, [=](auto v) {
        const float d = float(v[0]);
        return std::abs(d) < most ? std::clamp(float(v[0] - v[1]), -most, most) : d;
    });
}

// The distance to the seeds of a label less a radius whose curvature is half as strong as a speed
// of 1: a start that can grow, also from a point.
Result<Volume> start_about(const Volume& seeds, uint16_t label, const LevelSetOptions& options) {
    const glm::dvec3 h = spacing_mm(seeds.grid());
    const double radius = std::max(4.0 * options.curvature_mm, std::min({h.x, h.y, h.z}));
    PALPATE_TRY(const Volume distance,
                signed_distance(seeds, {.of = DistanceOf::label, .label = label}, {}));
    return map_values<float>(std::array{&distance}, {},
                             [&](auto v) { return float(std::max(double{v[0]}, 0.0) - radius); });
}

// All objects, one after the other; where they overlap, the one whose surface is farther has the
// sample. make() fills in forces, and options beside those that all methods have.
Result<Segmented> run_level(
    const SegmentInput& input, const ParameterValues& values, const Task& task,
    const std::function<Result<Forces>(const SeedValues& seeds, LevelSetOptions& options,
                                       Found& found, const Task& task)>& make) {
    const glm::dvec3 h = spacing_mm(input.volume.grid());
    const double least = std::min({h.x, h.y, h.z});
    LevelSetOptions options{.most_iterations = int(value_of(values, "iterations")),
                            .with_distance = true};
    const double usual = 0.5 * least;
    options.curvature_mm = is_set(values, "curvature") ? value_of(values, "curvature") : usual;
    options.tolerance_mm = is_set(values, "change") ? value_of(values, "change") : least / 500.0;
    Winner winner;
    bool any = false;
    Segmented made{*input.seeds, {}, {}, {}};
    made.found = {{"curvature", options.curvature_mm}, {"change", options.tolerance_mm}};
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds, input.balls);
    for (size_t i = 0; i < all.size(); ++i) {
        if (all[i].label == input.background)
            continue;
        const double from = double(i) / double(all.size()), share = 1.0 / double(all.size());
        Found found;
        PALPATE_TRY(const Forces forces,
                    make(all[i], options, found, task.part(from, from + 0.2 * share)));
        const LevelSetForces given{forces.speed ? &*forces.speed : nullptr,
                                   forces.edge ? &*forces.edge : nullptr,
                                   forces.flow ? &*forces.flow : nullptr};
        const Task part = task.part(from + 0.2 * share, from + share);
        PALPATE_TRY(
            LevelSetResult moved,
            level_set({.labels = &*input.seeds, .label = all[i].label}, given, options, part));
        using End = LevelSetReport::End;
        if (moved.report.end == End::vanished) {
            // Curvature takes away what is thin: once more, from as much about the seeds as it
            // leaves. Not on a sheared grid, which has no such distance.
            if (const Result<Volume> start = start_about(*input.seeds, all[i].label, options)) {
                // A volume that is all object has no distance, and stays as it is.
                if (Result<LevelSetResult> again =
                        level_set({.distance = &*start}, given, options, part))
                    moved = std::move(*again);
                else if (task.stop.stop_requested())
                    return pass_on(again);
            }
            if (moved.report.end == End::vanished)
                found.note += "; add seeds, or choose another range of values or less curvature";
        }
        // Steps that end at an edge lead a surface that has not come to rest nowhere else.
        const LevelSetReport before = moved.report;
        const bool goes_on =
            before.end == End::settled || (forces.last_speed && before.end != End::vanished);
        if (options.curvature_mm == usual && goes_on) {
            // It has kept the surface even as it grew, and now holds it off where the speed is 0.
            LevelSetOptions last = options;
            last.curvature_mm *= kLastCurvature;
            last.last_time = kLastWay * least;
            if (before.end == End::settled)
                last.most_iterations -= before.iterations;
            LevelSetForces last_given = given;
            std::optional<Volume> last_speed;
            if (forces.last_speed) {
                PALPATE_TRY(last_speed, forces.last_speed(*moved.distance, {task.stop, {}}));
                last_given = {.speed = &*last_speed};
                last.propagation = 1.0;
                last.advection_mm = 0.0;
                last.last_time = std::max(last.last_time, forces.last_time);
            }
            // A volume that is all object has no surface to go on with.
            if (Result<LevelSetResult> moved_on =
                    level_set({.distance = &*moved.distance}, last_given, last, part)) {
                moved.distance = std::move(moved_on->distance);
                moved.report = before;
                if (before.end == End::settled)
                    moved.report.iterations += moved_on->report.iterations;
                last_speed.reset();
                if (forces.last_shift) {
                    PALPATE_TRY(const Volume shift,
                                forces.last_shift(*moved.distance, {task.stop, {}}));
                    PALPATE_TRY(moved.distance,
                                moved_outward(*moved.distance, shift, {task.stop, {}}));
                }
            } else if (task.stop.stop_requested()) {
                return pass_on(moved_on);
            }
        }
        PALPATE_TRY(winner.add(all[i].label, *moved.distance, {task.stop, {}}));
        made.notes.push_back(
            fmt::format("label {}: {}; {}", all[i].label, found.note, text_of(moved.report)));
        made.found.merge(found.values);
        any = true;
    }
    if (!any)
        return fail("level set: all seeds are those of the background");
    PALPATE_TRY(made.labels, labels_of(winner, input, {task.stop, {}},
                                       [](float v, uint16_t) { return v < 0.0f; }));
    made.distance = winner.best();
    return made;
}

} // namespace

Result<Segmented> run_level_threshold(const SegmentInput& input, const ParameterValues& values,
                                      const Task& task) {
    return run_level(
        input, values, task,
        [&](const SeedValues& seeds, LevelSetOptions&, Found& found,
            const Task& part) -> Result<Forces> {
            const double deviations = value_of(values, "deviations");
            ValueInterval interval{value_of(values, "low"), value_of(values, "high")};
            if (!is_set(values, "low") || !is_set(values, "high")) {
                PALPATE_TRY(const ObjectValues object,
                            object_values(input.volume, *input.seeds, seeds.label, input.balls,
                                          deviations, part));
                // At least half-way to what lies around: there is the object's edge.
                const double reach = std::max(deviations * object.values.sd, 0.5 * object.contrast);
                if (!is_set(values, "low"))
                    interval.low = object.values.mean - reach;
                if (!is_set(values, "high"))
                    interval.high = object.values.mean + reach;
            }
            found = {fmt::format("values {:g} .. {:g}", interval.low, interval.high),
                     {{"low", interval.low}, {"high", interval.high}}};
            PALPATE_TRY(const Volume speed, threshold_speed(input.volume, interval, part));
            return Forces{speed, {}, {}};
        });
}

Result<Segmented> run_level_edges(const SegmentInput& input, const ParameterValues& values,
                                  const Task& task) {
    const auto make = [&](const SeedValues& seeds, LevelSetOptions& options, Found& found,
                          const Task& part) -> Result<Forces> {
        EdgeSpeedOptions edges{is_set(values, "edge") ? value_of(values, "edge") : 0.0,
                               value_of(values, "exponent"), value_of(values, "sigma")};
        options.propagation = value_of(values, "propagation");
        options.advection_mm = value_of(values, "advection");
        options.flow = value_of(values, "flow");
        if (!is_set(values, "edge")) {
            {
                PALPATE_TRY(const Volume slopes,
                            gradient_magnitude(input.volume, {edges.sigma_mm}, {part.stop, {}}));
                for (const SeedValues& under : seed_values(slopes, *input.seeds))
                    if (under.label == seeds.label)
                        edges.edge = 3.0 * under.mean;
            } // the slopes are gone before more is held
            // Where values are even under the seeds: well below the edge of the object's contrast,
            // which smoothing spreads over sigma and a sample to each side.
            PALPATE_TRY(const ObjectValues object,
                        object_values(input.volume, *input.seeds, seeds.label, input.balls, 2.0,
                                      {part.stop, {}}));
            const glm::dvec3 h = spacing_mm(input.volume.grid());
            const double wide = edges.sigma_mm + std::min({h.x, h.y, h.z});
            edges.edge = std::max(edges.edge, 0.1 * object.contrast / wide);
            if (!(edges.edge > 0.0))
                edges.edge = 1.0; // one value everywhere
        }
        found = {fmt::format("edges of {:g} units per mm", edges.edge), {{"edge", edges.edge}}};
        Forces forces;
        if (options.flow > 0.0) { // before all else, as it takes the most memory
            PALPATE_TRY(forces.flow, flow_of(input.volume, edges.sigma_mm, part));
        }
        PALPATE_TRY(forces.edge, edge_speed(input.volume, edges, {part.stop, {}}));
        forces.speed = forces.edge;
        forces.last_speed = [&input, edges](const Volume& distance, const Task& last) {
            return edge_place_speed(input.volume, distance, edges, last);
        };
        forces.last_time = kLastFalls * kWidestEdge * edges.sigma_mm * edges.sigma_mm /
                           (2.0 * smallest_spacing_mm(input.volume.grid()));
        forces.last_shift = [&input, edges](const Volume& distance, const Task& last) {
            return edge_shift_mm(input.volume, distance, edges, last);
        };
        return forces;
    };
    return run_level(input, values, task, make);
}

Result<Segmented> run_level_regions(const SegmentInput& input, const ParameterValues& values,
                                    const Task& task) {
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds, input.balls);
    const auto make = [&](const SeedValues& seeds, LevelSetOptions&, Found& found,
                          const Task& part) -> Result<Forces> {
        // All seeds of other labels as one.
        SeedValues outside;
        double sum = 0.0, squares = 0.0;
        for (const SeedValues& other : all)
            if (other.label != seeds.label) {
                const auto count = double(other.count);
                outside.count += other.count;
                sum += count * other.mean;
                squares += count * (other.sd * other.sd + other.mean * other.mean);
            }
        if (outside.count == 0)
            return fail(
                "level-set-regions: expected seeds outside the object, of another label, beside "
                "those of label {}",
                seeds.label);
        outside.mean = sum / double(outside.count);
        outside.sd =
            std::sqrt(std::max(0.0, squares / double(outside.count) - outside.mean * outside.mean));
        found.note = fmt::format("values {:g} +- {:g} against {:g} +- {:g}", seeds.mean, seeds.sd,
                                 outside.mean, outside.sd);
        PALPATE_TRY(const Volume speed, region_speed(input.volume, seeds, outside, part));
        return Forces{speed, {}, {}};
    };
    return run_level(input, values, task, make);
}

} // namespace palpate
