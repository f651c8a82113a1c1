// Level sets as rows of the table of methods.

#include <functional>

#include "engine/segment/level_set.h"
#include "engine/segment/level_set_speed.h"
#include "engine/segment/method_parts.h"
#include "engine/segment/method_runs.h"
#include "engine/segment/vector_flow.h"

namespace palpate {

namespace {

// What was found from the data, for people and as values of parameters.
struct Found {
    std::string note;
    ParameterValues values{};
};
struct Forces {
    std::optional<Volume> speed, edge;
    std::optional<VectorField> flow;
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
    options.curvature_mm =
        is_set(values, "curvature") ? value_of(values, "curvature") : 0.5 * least;
    options.tolerance_mm = is_set(values, "change") ? value_of(values, "change") : least / 500.0;
    Winner winner;
    bool any = false;
    Segmented made{*input.seeds, {}, {}, {}};
    made.found = {{"curvature", options.curvature_mm}, {"change", options.tolerance_mm}};
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds);
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
        PALPATE_TRY(const LevelSetResult moved,
                    level_set({.labels = &*input.seeds, .label = all[i].label}, given, options,
                              task.part(from + 0.2 * share, from + share)));
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
            const double reach = value_of(values, "deviations") * spread_of(seeds, input.volume);
            const ValueInterval interval{
                is_set(values, "low") ? value_of(values, "low") : seeds.mean - reach,
                is_set(values, "high") ? value_of(values, "high") : seeds.mean + reach};
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
        EdgeSpeedOptions edges{value_of(values, "edge"), value_of(values, "exponent"),
                               value_of(values, "sigma")};
        options.propagation = value_of(values, "propagation");
        options.advection_mm = value_of(values, "advection");
        options.flow = value_of(values, "flow");
        if (!is_set(values, "edge")) {
            PALPATE_TRY(const Volume slopes,
                        gradient_magnitude(input.volume, {edges.sigma_mm}, {part.stop, {}}));
            edges.edge = 1.0; // where values are even
            for (const SeedValues& under : seed_values(slopes, *input.seeds))
                if (under.label == seeds.label && under.mean > 0.0)
                    edges.edge = 3.0 * under.mean;
        }
        found = {fmt::format("edges of {:g} units per mm", edges.edge), {{"edge", edges.edge}}};
        Forces forces;
        if (options.flow > 0.0) { // before all else, as it takes the most memory
            PALPATE_TRY(forces.flow, flow_of(input.volume, edges.sigma_mm, part));
        }
        PALPATE_TRY(forces.edge, edge_speed(input.volume, edges, {part.stop, {}}));
        forces.speed = forces.edge;
        return forces;
    };
    return run_level(input, values, task, make);
}

Result<Segmented> run_level_regions(const SegmentInput& input, const ParameterValues& values,
                                    const Task& task) {
    const std::vector<SeedValues> all = seed_values(input.volume, *input.seeds);
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
