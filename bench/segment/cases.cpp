#include "bench/segment/cases.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/segment/bilateral.h"
#include "engine/segment/fast_marching.h"
#include "engine/segment/fuzzy_connectedness.h"
#include "engine/segment/gaussian.h"
#include "engine/segment/march_cost.h"
#include "engine/segment/median.h"
#include "engine/segment/signed_distance.h"
#include "engine/segment/vector_flow.h"

namespace palpate::bench {

namespace {

double sample_at(const Volume& volume, glm::ivec3 i) {
    return volume.value(glm::uvec3(glm::clamp(i, glm::ivec3(0), glm::ivec3(volume.size()) - 1)));
}

// The sampled Gaussian or its first derivative, by the index, cut at 8 sigma.
std::vector<double> weights(double sigma, bool derivative) {
    const int radius = int(std::ceil(8.0 * sigma));
    std::vector<double> w;
    double sum = 0;
    for (int n = -radius; n <= radius; ++n) {
        const double g = std::exp(-0.5 * n * n / (sigma * sigma));
        sum += g;
        w.push_back(derivative ? n / (sigma * sigma) * g : g);
    }
    for (double& one : w)
        one /= sum;
    return w;
}

double convolved(const Volume& volume, glm::ivec3 at, double sigma_mm, int derivative_axis) {
    std::array<std::vector<double>, 3> w;
    glm::ivec3 radius;
    for (int a = 0; a < 3; ++a) {
        w[size_t(a)] = weights(sigma_mm / spacing_mm(volume.grid())[a], a == derivative_axis);
        radius[a] = int(w[size_t(a)].size() / 2);
    }
    double sum = 0;
    for (int z = -radius.z; z <= radius.z; ++z)
        for (int y = -radius.y; y <= radius.y; ++y)
            for (int x = -radius.x; x <= radius.x; ++x)
                sum += w[0][size_t(x + radius.x)] * w[1][size_t(y + radius.y)] *
                       w[2][size_t(z + radius.z)] * sample_at(volume, at + glm::ivec3(x, y, z));
    return sum;
}

double exact_gaussian(const SegmentInput& in, glm::ivec3 at) {
    return convolved(in.grey, at, 1.5, -1);
}
double exact_slope(const SegmentInput& in, glm::ivec3 at) {
    glm::dvec3 g;
    for (int a = 0; a < 3; ++a)
        g[a] = convolved(in.grey, at, 1.5, a);
    return glm::length(world_gradient(in.grey.grid(), g));
}

double exact_median(const SegmentInput& in, glm::ivec3 at) {
    std::vector<double> all;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                all.push_back(sample_at(in.grey, at + glm::ivec3(x, y, z)));
    std::nth_element(all.begin(), all.begin() + 13, all.end());
    return all[13];
}

// Of 2 mm and 50 HU, to 8 sigma in space.
double exact_bilateral(const SegmentInput& in, glm::ivec3 at) {
    const glm::dvec3 spacing = spacing_mm(in.grey.grid());
    const glm::ivec3 reach(16.0 / spacing);
    const double centre = sample_at(in.grey, at);
    double sum = 0, total = 0;
    for (int z = -reach.z; z <= reach.z; ++z)
        for (int y = -reach.y; y <= reach.y; ++y)
            for (int x = -reach.x; x <= reach.x; ++x) {
                const glm::dvec3 d = spacing * glm::dvec3(x, y, z) / 2.0;
                const double off = sample_at(in.grey, at + glm::ivec3(x, y, z)) - centre;
                const double w = std::exp(-0.5 * (glm::dot(d, d) + off * off / 2500.0));
                sum += w * off;
                total += w;
            }
    return centre + sum / total;
}

Result<Volume> march(const SegmentInput& in, int order, const Task& task) {
    PALPATE_TRY(const Volume cost, soft_tissue_cost(in.grey, task.part(0.0, 0.1)));
    const Volume seeds = middle_seed(in.grey);
    return fast_marching(cost, {.seeds = &seeds}, {.order = order}, task.part(0.1, 1.0));
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
        {"gradient vector flow", "one component, residual 1e-4, of gradient magnitude 1.5 mm", "",
         0, 7,
         [](const SegmentInput& in, const Task& task) -> Result<Volume> {
             PALPATE_TRY(const Volume edges, gradient_magnitude(in.grey, {1.5}, task));
             return vector_flow(edges, 0, {}, task);
         },
         nullptr},
        {"signed distance", "of bone, mm", "maurer", 5, 15,
         [](const SegmentInput& in, const Task& task) {
             return signed_distance(in.bone, {}, task);
         },
         nullptr},
        {"fast marching", "order 1, from the middle", "fast-marching", 10, 3,
         [](const SegmentInput& in, const Task& task) { return march(in, 1, task); }, nullptr},
        {"fast marching", "order 2, from the middle", "fast-marching", 10, 3,
         [](const SegmentInput& in, const Task& task) { return march(in, 2, task); }, nullptr},
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

Volume middle_seed(const Volume& grey) {
    const SeedBall point[] = {{1, world_point(grey.grid(), glm::dvec3(grey.size() / 2u)), 0.0}};
    return seed_map(grey, point).value();
}

std::span<const SegmentCase> segment_cases() {
    return table();
}

} // namespace palpate::bench
