#include "engine/segment/vector_flow.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "engine/segment/multigrid.h"
#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

BrickArray<float> array_of(glm::uvec3 size, const std::function<double(glm::dvec3)>& value) {
    BrickArray<float> array(size);
    for (const glm::ivec3 i : twin::indices(glm::ivec3(size)))
        array.set(glm::uvec3(i), float(value(glm::dvec3(i))));
    return array;
}

// u = cos(pi x) cos(2 pi y) cos(pi z) on the unit cube has no flow through its sides, and
// u - mu laplace(u) = (1 + 6 pi^2 mu) u. Samples are the middles of cells of unequal sides.
double error_of(uint32_t n, int* cycles) {
    const glm::uvec3 size(n, n, n / 2);
    const glm::dvec3 h = 1.0 / glm::dvec3(size);
    const double mu = 0.3;
    const auto u = [&](glm::dvec3 i) {
        const glm::dvec3 x = (i + 0.5) * h * M_PI;
        return std::cos(x.x) * std::cos(2 * x.y) * std::cos(x.z);
    };
    Multigrid grids(h, mu, array_of(size, [](glm::dvec3) { return 0; }),
                    array_of(size, [](glm::dvec3) { return 1; }), array_of(size, [&](glm::dvec3 i) {
                        return (1 + 6 * M_PI * M_PI * mu) * u(i);
                    }));
    const double first = grids.residual();
    *cycles = 0;
    // Floats of u, off by 2^-25 each, are seen times 12 mu / h^2: 1e-4 of the right side at 66.
    while (grids.residual() > 3e-4 * first && *cycles < 30) {
        grids.cycle();
        ++*cycles;
    }
    const BrickArray<float> found = grids.take();
    double worst = 0;
    for (const glm::ivec3 i : twin::indices(glm::ivec3(size)))
        worst = std::max(worst, std::abs(double{found.value(glm::uvec3(i))} - u(glm::dvec3(i))));
    return worst;
}

TEST(Multigrid, IsOfSecondOrderAndConverges) {
    int few = 0, many = 0, most = 0;
    const double coarse = error_of(16, &few), middle = error_of(32, &many),
                 fine = error_of(66, &most); // bricks of two samples at the end
    EXPECT_NEAR(std::log2(coarse / middle), 2.0, 0.15);
    EXPECT_NEAR(std::log2(middle / fine) / std::log2(66.0 / 32), 2.0, 0.2);
    EXPECT_LE(std::max(few, many), 9);
    EXPECT_LE(most, 25); // sizes that are odd on some level: see multigrid.h
}

// Residual of the printed equation in double, with g by central differences, over that of v = 0.
double twin_residual(const Volume& edges, const Volume& v, int axis, double mu) {
    const glm::dvec3 h = spacing_mm(edges.grid());
    const double scale = 1.0 / (double{edges.range().max} - double{edges.range().min});
    double squares = 0, whole = 0;
    for (const glm::ivec3 i : twin::indices(glm::ivec3(edges.size()))) {
        glm::dvec3 g;
        double flow = 0;
        for (int a = 0; a < 3; ++a) {
            glm::ivec3 d(0);
            d[a] = 1;
            g[a] = scale * (twin::at(edges, i + d) - twin::at(edges, i - d)) / (2 * h[a]);
            flow += (twin::at(v, i + d) - 2 * twin::at(v, i) + twin::at(v, i - d)) / (h[a] * h[a]);
        }
        const double b = glm::dot(g, g);
        squares += std::pow(mu * flow - b * (twin::at(v, i) - g[axis]), 2);
        whole += std::pow(b * g[axis], 2);
    }
    return std::sqrt(squares / whole);
}

TEST(VectorFlow, SolvesThePrintedEquationToTheStatedResidual) {
    for (const glm::uvec3 size : {glm::uvec3(37, 20, 9), {40, 33, 1}, {5, 1, 34}}) {
        const Grid grid = make_grid(size, {0.8, 1.0, 2.5});
        const Volume edges = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            const glm::dvec3 d = glm::dvec3(i) - 0.5 * glm::dvec3(size);
            return 100 * std::exp(-0.1 * std::pow(glm::length(d) - 5, 2));
        });
        for (const int axis : {0, 2}) {
            VectorFlowReport report;
            const Volume v =
                vector_flow(edges, axis, {.mu = 0.2, .residual = 1e-4}, {}, &report).value();
            if (size[axis] == 1) {
                EXPECT_EQ(v.range(), (ValueRange{0, 0}));
                continue;
            }
            EXPECT_LE(report.residual, 1e-4);
            EXPECT_LE(report.cycles, 15);
            // Floats of v of up to 1 / mm: each is off by 2^-25, seen by mu / h^2 * 12.
            EXPECT_NEAR(twin_residual(edges, v, axis, 0.2), report.residual, 5e-5);
        }
    }
}

// The outline of a U, open to the top, in one slice: within its cavity the gradient of the edges is
// 0 midway between the walls, and the flow leads down to the bottom (Xu and Prince, figure 3).
TEST(VectorFlow, LeadsIntoACavity) {
    const Grid grid = make_grid({64, 64, 1}, {1, 1, 1});
    const Volume edges = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        const auto off = [&](double x0, double y0, double x1, double y1) { // of a straight line
            const glm::dvec2 a(x0, y0), b(x1, y1), p(i.x, i.y);
            const double t = std::clamp(glm::dot(p - a, b - a) / glm::dot(b - a, b - a), 0.0, 1.0);
            return glm::distance(p, a + t * (b - a));
        };
        const double d = std::min({off(24, 12, 24, 48), off(40, 12, 40, 48), off(24, 48, 40, 48)});
        return std::exp(-0.5 * d * d);
    });
    const Volume x = vector_flow(edges, 0, {}, {}).value(),
                 y = vector_flow(edges, 1, {}, {}).value();
    const Volume plain = derivative(edges, {0.0, 1, {}}, {}).value();
    for (uint32_t at = 30; at <= 42; ++at) {
        EXPECT_GT(y.value({32, at, 0}), 10 * std::abs(x.value({32, at, 0}))) << at;
        EXPECT_GT(y.value({32, at, 0}), 0.0f);
        EXPECT_GT(x.value({36, at, 0}), 0.0f); // beside the middle, to the nearer wall
        EXPECT_LT(x.value({28, at, 0}), 0.0f);
    }
    EXPECT_LT(std::abs(plain.value({32, 36, 0})), 1e-9f);
}

TEST(VectorFlow, FlipsWithItsInputAndThreadsChangeNoBit) {
    const glm::uvec3 size(40, 24, 12);
    const Volume edges = twin::noise(make_grid(size, {1, 1, 2}), ScalarType::i16);
    const Volume flipped = make_volume(edges.grid(), ScalarType::i16, [&](glm::uvec3 i) {
        return edges.value({size.x - 1 - i.x, i.y, i.z});
    });
    const VectorFlowOptions options{.mu = 0.2, .residual = 1e-6};
    const Volume v = vector_flow(edges, 0, options, {}).value();
    const Volume w = vector_flow(flipped, 0, options, {}).value();
    // Each is off by its residual, times the inverse of the operator: of noise the weights are of
    // the size of the right sides', so by some 1e-6 of the field.
    const float most = v.range().max;
    for (const glm::ivec3 i : twin::indices(glm::ivec3(size)))
        ASSERT_NEAR(w.value({size.x - 1 - uint32_t(i.x), i.y, i.z}), -v.value(glm::uvec3(i)),
                    1e-4f * most);
    for (const size_t threads : {1, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_TRUE(twin::same_bits(vector_flow(edges, 0, options, {}).value(), v));
    }
}

TEST(VectorFlow, FlatEdgesNoDataAndBadParameters) {
    const Grid grid = make_grid({12, 9, 5}, {1, 1, 2});
    const Volume flat = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 7.0; });
    EXPECT_EQ(vector_flow(flat, 0, {}, {}).value().range(), (ValueRange{0, 0}));
    const Volume holes = twin::noise(grid, ScalarType::f32, 9);
    const Volume v = vector_flow(holes, 1, {}, {}).value();
    EXPECT_EQ(v.no_data_count(), holes.no_data_count());
    const auto message = [&](const Volume& edges, VectorFlowOptions o) {
        const Result<Volume> made = vector_flow(edges, 0, o, {});
        return made ? std::string("made") : made.error().message;
    };
    EXPECT_EQ(message(flat, {.mu = 0}), "mu: expected a number above 0, found 0");
    EXPECT_EQ(message(flat, {.residual = 0}), "residual: expected 1e-06 .. 1, found 0");
    EXPECT_THAT(message(twin::noise(twin::turned({9, 9, 9}, {1, 1, 1}, true), ScalarType::i16), {}),
                ::testing::HasSubstr("the edge map"));
}

} // namespace
} // namespace palpate
