#include "bench/segment/cases.h"

#include <cmath>

#include "bench/segment/exact.h"
#include "engine/segment/bilateral.h"
#include "engine/segment/components.h"
#include "engine/segment/fast_marching.h"
#include "engine/segment/fuzzy_connectedness.h"
#include "engine/segment/gaussian.h"
#include "engine/segment/level_set.h"
#include "engine/segment/level_set_speed.h"
#include "engine/segment/march_cost.h"
#include "engine/segment/median.h"
#include "engine/segment/morphology.h"
#include "engine/segment/pointwise.h"
#include "engine/segment/resample.h"
#include "engine/segment/signed_distance.h"
#include "engine/segment/vector_flow.h"
#include "engine/volume/builder.h"

namespace palpate::bench {

namespace {

Result<Volume> flow(const SegmentInput& in, double residual, const Task& task) {
    PALPATE_TRY(const VectorField field,
                vector_flow(in.edges, {.mu = kFlowMu, .residual = residual}, task));
    return field[0];
}

Result<Volume> turned(const SegmentInput& in, ResampledBy how, const Task& task) {
    return resample(in.grey, {turned_grid(in.grey.grid()), how, 0}, task);
}

Result<Volume> march_alone(const SegmentInput& in, int order, const Task& task) {
    const Volume seeds = middle_seed(in.grey);
    return fast_marching(in.one, {.seeds = &seeds}, {.order = order}, task);
}

Result<Volume> march(const SegmentInput& in, int order, const Task& task) {
    PALPATE_TRY(const Volume cost, soft_tissue_cost(in.grey, task.part(0.0, 0.1)));
    const Volume seeds = middle_seed(in.grey);
    return fast_marching(cost, {.seeds = &seeds}, {.order = order}, task.part(0.1, 1.0));
}

// Distances about the skin, from all that is above -300 HU.
Result<Volume> skin(const SegmentInput& in, const Task& task) {
    PALPATE_TRY(const Volume speed, threshold_speed(in.grey, {-300.0, 300.0}, {task.stop, {}}));
    PALPATE_TRY(const LevelSetResult found, level_set({.labels = &in.tissues}, {.speed = &speed},
                                                      {.curvature_mm = kSkinCurvature_mm,
                                                       .most_iterations = kSkinSteps,
                                                       .with_distance = true},
                                                      task));
    return *found.distance;
}

// The mean way between two surfaces: the volume between them over their area, that is half of the
// volume within a spacing of ours by that spacing.
double surfaces_apart(const SegmentInput& in, const Samples& ours, const Samples& theirs) {
    const glm::dvec3 h = spacing_mm(in.grey.grid());
    const double least = std::min({h.x, h.y, h.z});
    size_t between = 0, near = 0;
    for (size_t i = 0; i < ours.size(); ++i) {
        between += (ours[i] < 0.0f) != (theirs[i] < 0.0f);
        near += std::abs(double(ours[i])) < least;
    }
    return near > 0 ? 2.0 * least * double(between) / double(near) : 0.0;
}

// The table. Names of peers are those of itk_filters.cpp.
const std::vector<SegmentCase>& table() {
    static const std::vector<SegmentCase> all{
        {"gaussian", "1.5 mm", "recursive-gaussian", 3, 15,
         [](const SegmentInput& in, const Task& task) { return gaussian(in.grey, {1.5}, task); },
         exact_gaussian},
        {"gradient magnitude", "1.5 mm", "gradient-magnitude", 0, 15,
         [](const SegmentInput& in, const Task& task) {
             return gradient_magnitude(in.grey, {1.5}, task);
         },
         exact_slope},
        {"median", "3 x 3 x 3", "median", 3, 7,
         [](const SegmentInput& in, const Task& task) { return median(in.grey, {}, task); },
         exact_median},
        {"bilateral", "2 mm, 50 HU, exact", "bilateral", 30, 1,
         [](const SegmentInput& in, const Task& task) {
             return bilateral(in.grey, {2.0, 50.0, false}, task);
         },
         exact_bilateral},
        {"bilateral separable", "2 mm, 50 HU", "", 0, 7,
         [](const SegmentInput& in, const Task& task) {
             return bilateral(in.grey, {2.0, 50.0, true}, task);
         },
         exact_bilateral},
        {"gradient vector flow", "to ITK's residual after 10 iterations", "vector-flow", 30, 3,
         [](const SegmentInput& in, const Task& task) {
             return flow(in, std::min(in.flow_residual, 1.0), task);
         },
         nullptr, flow_residual},
        {"gradient vector flow", "to a residual of 1e-4", "vector-flow", 0, 3,
         [](const SegmentInput& in, const Task& task) { return flow(in, 1e-4, task); }, nullptr,
         flow_residual},
        {"signed distance", "of bone, mm", "maurer", 5, 15,
         [](const SegmentInput& in, const Task& task) {
             return signed_distance(in.bone, {}, task);
         },
         exact_distance_outside},
        {"signed distance of labels", "air, soft tissue and bone, mm", "", 0, 15,
         [](const SegmentInput& in, const Task& task) {
             return signed_distance(in.tissues, {.of = DistanceOf::labels}, task);
         },
         exact_distance_of_labels},
        {"erosion", "of bone, 6 neighbours", "erode-cross", 10, 15,
         [](const SegmentInput& in, const Task& task) { return morphology(in.bone, {}, task); },
         exact_erosion},
        {"erosion by a ball", "of bone, 3 mm", "erode-ball", 10, 15,
         [](const SegmentInput& in, const Task& task) {
             return morphology(in.bone, {.radius_mm = kBall_mm}, task);
         },
         exact_erosion_by_ball},
        {"components", "of bone, 6 neighbours", "components", 0, 15,
         [](const SegmentInput& in, const Task& task) -> Result<Volume> {
             PALPATE_TRY(Components made, connected_components(in.bone, {.as_mask = true}, task));
             return std::move(made.numbers);
         },
         nullptr},
        {"resample linear", "onto a turned grid of the same size", "resample-linear", 0, 7,
         [](const SegmentInput& in, const Task& task) {
             return turned(in, ResampledBy::linear, task);
         },
         exact_linear},
        {"resample cubic", "onto a turned grid of the same size", "resample-cubic", 0, 3,
         [](const SegmentInput& in, const Task& task) {
             return turned(in, ResampledBy::cubic, task);
         },
         exact_cubic},
        {"distance by marching", "order 1, cost 1, from the middle", "fast-marching-alone", 10, 3,
         [](const SegmentInput& in, const Task& task) { return march_alone(in, 1, task); },
         exact_distance_to_middle},
        {"distance by marching", "order 2, cost 1, from the middle", "fast-marching-alone", 10, 3,
         [](const SegmentInput& in, const Task& task) { return march_alone(in, 2, task); },
         exact_distance_to_middle},
        {"fast marching", "order 1, from the middle", "fast-marching", 10, 3,
         [](const SegmentInput& in, const Task& task) { return march(in, 1, task); }, nullptr},
        {"fast marching", "order 2, from the middle", "fast-marching", 10, 3,
         [](const SegmentInput& in, const Task& task) { return march(in, 2, task); }, nullptr},
        {"level set", "the skin, curvature 0.5 mm, 50 steps", "level-set", 2, 3, skin, nullptr,
         nullptr, surfaces_apart},
        {"fuzzy connectedness", "40 +- 40 HU, from the middle", "", 0, 3,
         [](const SegmentInput& in, const Task& task) {
             return fuzzy_connectedness(in.grey, middle_seed(in.grey), 1, {40.0, 40.0, 50.0, 0.5},
                                        task);
         },
         nullptr},
    };
    return all;
}

} // namespace

Result<Volume> soft_tissue_cost(const Volume& grey, const Task& task) {
    return statistics_cost(grey, {1, 1, 40.0, 40.0}, {2.5, 0.05, 0}, task);
}

Result<SegmentInput> segment_input(const Volume& grey) {
    const auto of_values = [&](ScalarType type, const auto& value) {
        return make_volume(grey.grid(), type,
                           [&](glm::uvec3 i) { return double(value(grey.value(i))); });
    };
    PALPATE_TRY(const Volume edges, gradient_magnitude(grey, {1.5}, {}));
    PALPATE_TRY(const BrickMaker scaled,
                rescale_bricks(edges, edges.range().min, edges.range().max, 0.0, 1.0));
    PALPATE_TRY(const Volume made, make_bricks(scaled, {}));
    return SegmentInput{
        grey, of_values(ScalarType::u8, [](float v) { return v >= 300.0f; }),
        of_values(ScalarType::u8, [](float v) { return v >= 300.0f ? 2 : v >= -300.0f; }),
        with_grid(made, make_grid(grey.size(), {1, 1, 1})),
        of_values(ScalarType::f32, [](float) { return 1.0; })};
}

Grid turned_grid(const Grid& grid) {
    const double c = std::cos(0.3), s = std::sin(0.3);
    const glm::dmat3 turn =
        glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1) * glm::dmat3(1, 0, 0, 0, c, s, 0, -s, c);
    Grid made = grid;
    for (int a = 0; a < 3; ++a)
        made.world_from_index[a] = glm::dvec4(turn * glm::dvec3(grid.world_from_index[a]), 0.0);
    made.world_from_index[3] += glm::dvec4(center_mm(grid) - center_mm(made), 0.0);
    return made;
}

Volume middle_seed(const Volume& grey) {
    const SeedBall point[] = {{1, world_point(grey.grid(), glm::dvec3(grey.size() / 2u)), 0.0}};
    return seed_map(grey, point).value();
}

std::span<const SegmentCase> segment_cases() {
    return table();
}

} // namespace palpate::bench
