// Level sets beside a dense scheme in double: every sample of a grid, without a band, bricks or
// distances made anew.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "engine/segment/level_set.h"
#include "engine/volume/builder.h"
#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

// P, Z, w and the start, smooth functions of the place; the coefficients of all terms.
double speed_at(glm::dvec3 p) {
    return 0.8 + 0.3 * std::sin(0.4 * p.x) * std::cos(0.3 * p.y);
}
double edge_at(glm::dvec3 p) {
    return 1.0 + 0.3 * std::sin(0.25 * (p.x + p.y - p.z));
}
glm::dvec3 flow_at(glm::dvec3 p) {
    return {0.3 + 0.02 * p.y, -0.02 * p.x, 0.1};
}
constexpr double kCurvature = 0.7, kAdvection = 0.8, kFlow = 1.5;
constexpr double kRadius = 4.0;
double start_at(const Grid& grid, glm::dvec3 p) {
    return glm::distance(p, center_mm(grid)) - kRadius;
}

// phi at a time by small steps of Euler's.
class Dense {
 public:
    explicit Dense(const Grid& grid) : grid_(grid), size_(grid.size) {
        const glm::dmat3 inverse = glm::inverse(glm::dmat3(grid.world_from_index));
        metric_ = inverse * glm::transpose(inverse);
        index_from_world_ = inverse;
        for (const glm::ivec3 i : twin::indices(size_))
            phi_.push_back(start_at(grid, world_point(grid, glm::dvec3(i))));
    }
    double at(glm::ivec3 i) const {
        i = glm::clamp(i, glm::ivec3(0), size_ - 1);
        return phi_[size_t(i.x) + size_t(size_.x) * (size_t(i.y) + size_t(size_.y) * size_t(i.z))];
    }
    void run(double time, int steps) {
        for (int step = 0; step < steps; ++step) {
            std::vector<double> next;
            for (const glm::ivec3 i : twin::indices(size_))
                next.push_back(at(i) + time / steps * rate(i));
            phi_ = std::move(next);
        }
    }

 private:
    // Third order from one side: the second differences there and one on, the smoother favoured.
    double one_sided(glm::ivec3 i, int axis, int side) const {
        glm::ivec3 e(0);
        e[axis] = side;
        const double own = at(i + e) - 2 * at(i) + at(i - e);
        const double on = at(i + 2 * e) - 2 * at(i + e) + at(i);
        const double h = spacing_mm(grid_)[axis], smooth = 0.04 * h * h;
        const double a = 1 / (own * own + smooth) * 2 / 3, b = 1 / (on * on + smooth) / 3;
        return side * (at(i + e) - at(i) - (a * own + b * on) / (a + b) / 2);
    }
    double rate(glm::ivec3 i) const {
        const glm::dvec3 p = world_point(grid_, glm::dvec3(i));
        glm::dvec3 low, high, mid, steepest;
        glm::dmat3 second;
        for (int a = 0; a < 3; ++a) {
            low[a] = one_sided(i, a, -1), high[a] = one_sided(i, a, 1);
            glm::ivec3 e(0), f(0);
            e[a] = 1;
            mid[a] = (at(i + e) - at(i - e)) / 2;
            steepest[a] = std::max({low[a], -high[a], 0.0}); // the speed is above 0
            steepest[a] *= low[a] > -high[a] ? 1 : -1;
            second[a][a] = at(i + e) - 2 * at(i) + at(i - e);
            const int b = (a + 1) % 3;
            f[b] = 1;
            second[a][b] = second[b][a] =
                (at(i + e + f) - at(i + e - f) - at(i - e + f) + at(i - e - f)) / 4;
        }
        // k |grad phi| = laplace(phi) - n . H n.
        const glm::dvec3 m = metric_ * mid;
        double laplace = 0, along = 0;
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b)
                laplace += metric_[a][b] * second[a][b], along += m[a] * m[b] * second[a][b];
        double rate =
            -speed_at(p) * std::sqrt(glm::dot(steepest, metric_ * steepest)) +
            kCurvature * edge_at(p) * (laplace - along / std::max(glm::dot(mid, m), 1e-12));
        glm::dvec3 rise;
        for (int a = 0; a < 3; ++a) {
            glm::dvec3 e(0);
            e[a] = 1;
            const auto edge = [&](glm::dvec3 d) {
                return edge_at(world_point(grid_, glm::dvec3(i) + d));
            };
            rise[a] = (edge(e) - edge(-e)) / 2;
        }
        const glm::dvec3 wind =
            kFlow * (index_from_world_ * flow_at(p)) - kAdvection * (metric_ * rise);
        for (int a = 0; a < 3; ++a)
            rate -= wind[a] * (wind[a] > 0 ? low[a] : high[a]);
        return rate;
    }

    Grid grid_;
    glm::ivec3 size_;
    glm::dmat3 metric_, index_from_world_;
    std::vector<double> phi_;
};

// The grid with samples of half the spacing, of which every other one is the grid's own.
Grid finer(Grid grid) {
    grid.size = 2u * grid.size - 1u;
    for (int a = 0; a < 3; ++a)
        grid.world_from_index[a] *= 0.5;
    return grid;
}

struct Errors {
    double ours = 0.0, dense = 0.0; // root mean square at samples beside the surface, mm
    double ours_most = 0.0, dense_most = 0.0;
};

// Both beside the dense scheme at half the spacing, or at the same.
Errors errors_at(const Grid& grid, double time, bool fine) {
    const auto field = [&](auto value) {
        return make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            return double(value(world_point(grid, glm::dvec3(i))));
        });
    };
    const Volume start = field([&](glm::dvec3 p) { return start_at(grid, p); });
    const Volume speed = field(speed_at), edge = field(edge_at);
    const VectorField flow{field([](glm::dvec3 p) { return flow_at(p).x; }),
                           field([](glm::dvec3 p) { return flow_at(p).y; }),
                           field([](glm::dvec3 p) { return flow_at(p).z; })};
    const Result<LevelSetResult> found = level_set({.distance = &start}, {&speed, &edge, &flow},
                                                   {.curvature_mm = kCurvature,
                                                    .advection_mm = kAdvection,
                                                    .flow = kFlow,
                                                    .last_time = time,
                                                    .with_distance = true},
                                                   {});
    EXPECT_TRUE(found) << found.error().message;
    EXPECT_NEAR(found->report.time, time, 1e-9);
    Dense dense(grid), half(fine ? finer(grid) : grid);
    dense.run(time, fine ? 20 : 1); // stable up to a time of 0.6
    half.run(time, fine ? 40 : 1);
    Errors errors;
    size_t count = 0;
    for (const glm::ivec3 i : twin::indices(glm::ivec3(grid.size))) {
        const double here = half.at((fine ? 2 : 1) * i);
        // Within 0.2 mm of the surface.
        if (!(std::abs(here) < 0.2))
            continue;
        // The dense one is no distance: its slope in the world.
        const auto distance = [&](const Dense& of, glm::ivec3 at) {
            glm::dvec3 g;
            for (int a = 0; a < 3; ++a) {
                glm::ivec3 e(0);
                e[a] = 1;
                g[a] = (of.at(at + e) - of.at(at - e)) / 2;
            }
            const glm::dmat3 inverse = glm::inverse(glm::dmat3(grid.world_from_index)) *
                                       (&of == &half && fine ? 2.0 : 1.0);
            return of.at(at) / glm::length(glm::transpose(inverse) * g);
        };
        const double expected = distance(half, (fine ? 2 : 1) * i);
        const double a = found->distance->value(glm::uvec3(i)) - expected;
        const double b = distance(dense, i) - expected;
        errors.ours += a * a, errors.dense += b * b;
        errors.ours_most = std::max(errors.ours_most, std::abs(a));
        errors.dense_most = std::max(errors.dense_most, std::abs(b));
        ++count;
    }
    EXPECT_GT(count, 50u);
    errors.ours = std::sqrt(errors.ours / double(count));
    errors.dense = std::sqrt(errors.dense / double(count));
    return errors;
}

std::array<Grid, 2> grids() {
    return {make_grid({18, 17, 12}, {0.8, 0.9, 1.4}),
            twin::turned({18, 18, 14}, {0.8, 0.9, 1.2}, true)};
}

TEST(LevelSetTwin, AStepIsThatOfADenseScheme) {
    // The band has distances made anew from the samples at the surface, off by h^2 / 2 r at most
    // (those of first order). So differences to one side are off by h / 2 r, second ones by
    // 4 (h^2 / 2 r) / h^2 on each axis, and P, w and v are below 2 together.
    const double time = 0.02, h = 1.4;
    const double most = time * (2.0 * h / (2 * kRadius) + kCurvature * 1.3 * 3 * 2 / kRadius);
    for (const Grid& grid : grids()) {
        const Errors off = errors_at(grid, time, false);
        std::printf("one step: off by %.5f mm RMS, at most %.5f\n", off.ours, off.ours_most);
        EXPECT_LE(off.ours_most, most);
    }
}

TEST(LevelSetTwin, AShortWayIsAsGoodAsThatOfADenseScheme) {
    // The same differences: no worse than the dense scheme at twice the spacing, whose errors of
    // second order are four times as large; and phi over its slope is a distance to within
    // d^2 / 2 r, d the farthest of these samples.
    const double linear = 0.2 * 0.2 / (2 * kRadius);
    for (const Grid& grid : grids()) {
        const Errors off = errors_at(grid, 0.5, true);
        std::printf("time 0.5: off by %.4f mm RMS, at most %.4f; dense scheme %.4f, at most %.4f\n",
                    off.ours, off.ours_most, off.dense, off.dense_most);
        EXPECT_LE(off.ours, 4 * off.dense + linear);
        EXPECT_LE(off.ours_most, 4 * off.dense_most + linear);
    }
}

} // namespace
} // namespace palpate
