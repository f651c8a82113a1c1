#include "engine/segment/vesselness.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>

#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

// Jacobi's iteration, in double, until nothing is left beside the diagonal.
glm::dvec3 twin_eigenvalues(glm::dmat3 m) {
    for (int sweep = 0; sweep < 30; ++sweep)
        for (const auto& [p, q] : {std::pair(0, 1), {0, 2}, {1, 2}}) {
            if (m[p][q] == 0.0)
                continue;
            const double theta = 0.5 * std::atan2(2.0 * m[p][q], m[q][q] - m[p][p]);
            glm::dmat3 turn(1.0);
            turn[p][p] = turn[q][q] = std::cos(theta);
            turn[p][q] = -std::sin(theta);
            turn[q][p] = std::sin(theta);
            m = glm::transpose(turn) * m * turn;
        }
    std::array<double, 3> e{m[0][0], m[1][1], m[2][2]};
    std::sort(e.begin(), e.end());
    return {e[0], e[1], e[2]};
}

TEST(Vesselness, EigenvaluesEqualThoseOfJacobi) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-100, 100);
    for (int i = 0; i < 3000; ++i) {
        double a[6];
        for (double& v : a)
            v = any(random);
        if (i % 3 == 1) // two nearly equal ones
            a[1] = a[0] + 1e-9 * a[1], a[3] = a[4] = a[5] = 0;
        if (i % 3 == 2)
            a[3] = a[4] = a[5] = 1e-7 * a[3];
        const glm::dvec3 found = eigenvalues(a[0], a[1], a[2], a[3], a[4], a[5]);
        const glm::dvec3 expected =
            twin_eigenvalues(glm::dmat3(a[0], a[3], a[4], a[3], a[1], a[5], a[4], a[5], a[2]));
        for (int k = 0; k < 3; ++k)
            EXPECT_NEAR(found[k], expected[k], 1e-7 * 100);
    }
    EXPECT_EQ(eigenvalues(3, 3, 3, 0, 0, 0), glm::dvec3(3));
}

// A Gaussian tube of deviation t about z, smoothed by s: on its axis the Hessian is
// -peak t^2 / (t^2 + s^2)^2 across and 0 along, so a = 0, b = c, and the measure is
// (1 - exp(-1 / 2 alpha^2)) (1 - exp(-2 (s^2 h)^2 / 2 structure^2)), greatest at s = t.
TEST(Vesselness, OfATubeIsTheClosedForm) {
    const double t = 3.0, peak = 1000.0, structure = 100.0;
    for (const bool turn : {false, true}) {
        Grid grid = make_grid({40, 36, 24}, {1.0, 1.1, 2.0});
        if (turn)
            grid = twin::turned({40, 36, 24}, {1.0, 1.1, 2.0});
        const glm::dvec3 middle = world_point(grid, {20, 18, 12});
        const glm::dvec3 along = glm::normalize(glm::dvec3(grid.world_from_index[2]));
        const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            const glm::dvec3 d = world_point(grid, glm::dvec3(i)) - middle;
            const double off = glm::dot(d, d) - std::pow(glm::dot(d, along), 2);
            return peak * std::exp(-0.5 * off / (t * t));
        });
        double at_t = 0;
        for (const double s : {2.0, 3.0, 4.5}) {
            const Volume made =
                vesselness(volume, {.from_mm = s, .to_mm = s, .structure = structure}, {}).value();
            const double h = s * s * peak * t * t / std::pow(t * t + s * s, 2);
            const double exact =
                (1 - std::exp(-2.0)) * (1 - std::exp(-0.5 * 2 * h * h / (structure * structure)));
            // Beside the moments the kernels differ by what is cut off beyond 4 sigma: 1 % of the
            // second derivative at most (gaussian_test), and 2 % of the exponent.
            EXPECT_NEAR(made.value({20, 18, 12}), exact, 0.01) << s;
            EXPECT_EQ(made.value({20, 4, 12}) < 0.1f, true);
            if (s == t)
                at_t = h;
            else
                EXPECT_LT(h, 250.0);
        }
        EXPECT_DOUBLE_EQ(at_t, 0.25 * peak);
        const Volume dark =
            vesselness(volume, {.from_mm = t, .to_mm = t, .structure = structure, .dark = true}, {})
                .value();
        EXPECT_EQ(dark.value({20, 18, 12}), 0.0f);
        const Volume scales =
            vesselness(volume, {.from_mm = 2, .to_mm = 4.5, .steps = 3}, {}).value();
        // Structure is half the largest norm, which is here: both factors are 1 - exp(-2).
        EXPECT_NEAR(scales.value({20, 18, 12}), std::pow(1 - std::exp(-2.0), 2), 0.01);
    }
}

TEST(Vesselness, PlatesAndFlatVolumesAreNoTubes) {
    const Grid grid = make_grid({40, 36, 9}, {1, 1, 2});
    const Volume plate = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        return 1000.0 * std::exp(-0.5 * std::pow((int(i.x) - 20) / 2.0, 2));
    });
    EXPECT_LT(vesselness(plate, {.from_mm = 2, .to_mm = 2}, {}).value().range().max, 0.05f);
    const Volume flat = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 40.0; });
    EXPECT_EQ(vesselness(flat, {}, {}).value().range(), (ValueRange{0, 0}));
    EXPECT_EQ(vesselness(flat, {.from_mm = 2, .to_mm = 1}, {}).error().message,
              "scales: expected 0 < from <= to, found 2 .. 1 mm");
    EXPECT_EQ(vesselness(flat, {.steps = 99}, {}).error().message,
              "steps: expected 1 .. 32, found 99");
}

} // namespace
} // namespace palpate
