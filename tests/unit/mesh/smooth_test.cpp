#include "engine/mesh/smooth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <numeric>
#include <random>

#include "engine/mesh/topology.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

// Every vertex of a periodic grid has the six neighbours (+-1, 0), (0, +-1), +-(1, 1). Waves on it
// are eigenvectors of the mean, whatever the positions: a filter multiplies them by f(k).
struct Wave {
    Mesh mesh = meshes::torus(kM, kN, 10.0, 3.0);
    double k = 0.0;

    static constexpr uint32_t kM = 20, kN = 12;
    Wave(int a, int b) {
        const double turn = 2.0 * std::numbers::pi;
        const double x = turn * a / kM, y = turn * b / kN;
        for (uint32_t j = 0; j < kN; ++j)
            for (uint32_t i = 0; i < kM; ++i)
                mesh.positions[i + kM * j] =
                    glm::vec3(std::cos(x * i + y * j), std::sin(x * i + y * j), 5.0);
        k = 1.0 - (std::cos(x) + std::cos(y) + std::cos(x + y)) / 3.0;
    }
};

template <class Filter>
void expect_factor(const Filter& filter, double (*f)(double k)) {
    for (const auto& [a, b] : {std::pair(0, 0), {1, 0}, {0, 1}, {3, 2}, {7, 5}, {10, 6}, {10, 0}}) {
        Wave wave(a, b);
        const Mesh before = wave.mesh;
        filter(wave.mesh);
        const double factor = f(wave.k);
        for (size_t v = 0; v < before.positions.size(); ++v) {
            const glm::dvec3 old(before.positions[v]);
            const glm::dvec3 expected(factor * old.x, factor * old.y, 5.0);
            // Positions are floats near 1 (and 5): rounded when made, and once more when written.
            ASSERT_LT(glm::length(glm::dvec3(wave.mesh.positions[v]) - expected), 4e-7 * 2)
                << a << " " << b << " k " << wave.k;
        }
    }
}

TEST(MeanFilter, MultipliesWavesByItsFactor) {
    expect_factor([](Mesh& m) { mean_filter(m, 3); },
                  [](double k) { return std::pow(1.0 - k, 3); });
    expect_factor([](Mesh& m) { mean_filter(m, 2, 0.25); },
                  [](double k) { return std::pow(1.0 - 0.25 * k, 2); });
}

TEST(TaubinFilter, MultipliesWavesByItsFactor) {
    expect_factor([](Mesh& m) { taubin_filter(m, 4); },
                  [](double k) { return std::pow((1.0 - 0.5 * k) * (1.0 + k / 1.9), 4); });
}

TEST(WindowedSincFilter, MultipliesWavesByItsFactor) {
    for (const uint32_t terms : {1u, 2u, 20u}) {
        const std::vector<double> c = windowed_sinc_coefficients(terms, 0.3);
        EXPECT_NEAR(std::accumulate(c.begin(), c.end(), 0.0), 1.0, 1e-15); // f(0)
    }
    expect_factor(
        [](Mesh& m) { windowed_sinc_filter(m, 20, 0.3); },
        [](double k) {
            // The step down written out: window, sinc, cosine.
            double sum = 0.0, at_zero = 0.0;
            const double pi = std::numbers::pi, band = std::acos(1.0 - 0.15) + 2.0 * pi / 21.0;
            for (int i = 0; i <= 20; ++i) {
                const double sinc = i == 0 ? band / pi : 2.0 * std::sin(i * band) / (i * pi);
                const double term = (0.54 + 0.46 * std::cos(pi * i / 21.0)) * sinc;
                sum += term * std::cos(i * std::acos(1.0 - 0.5 * k));
                at_zero += term;
            }
            return sum / at_zero;
        });
}

TEST(WindowedSincFilter, PassesBelowTheBandAndStopsAbove) {
    const std::vector<double> c = windowed_sinc_coefficients(40, 0.5);
    for (double k = 0.0; k <= 2.0; k += 0.01) {
        double f = 0.0;
        for (size_t i = 0; i < c.size(); ++i)
            f += c[i] * std::cos(double(i) * std::acos(1.0 - 0.5 * k));
        // Beside the step's blur, of 2 pi / 41 to each side, a Hamming window leaves ripples of
        // 0.2 %, and f(0) = 1 moves all by one of them.
        const double angle = std::acos(1.0 - 0.5 * k) - std::acos(1.0 - 0.25);
        if (angle <= 0.0 || angle >= 4.0 * std::numbers::pi / 41) {
            EXPECT_NEAR(f, angle <= 0.0 ? 1.0 : 0.0, 0.005) << k;
        }
    }
}

Mesh noisy_ball(double noise_mm) {
    Mesh ball = meshes::ball(10.0, 4);
    std::mt19937 random(4);
    std::normal_distribution<float> normal(0.0f, static_cast<float>(noise_mm));
    for (glm::vec3& p : ball.positions)
        p *= 1.0f + normal(random) / 10.0f;
    return ball;
}

double roughness(const Mesh& ball) { // of radii about their mean, RMS
    double sum = 0.0, square = 0.0;
    for (const glm::vec3 p : ball.positions) {
        sum += glm::length(glm::dvec3(p));
        square += glm::dot(glm::dvec3(p), glm::dvec3(p));
    }
    const auto n = static_cast<double>(ball.positions.size());
    return std::sqrt(square / n - sum / n * sum / n);
}

TEST(Filters, SmoothNoiseAndReportTheVolume) {
    const double smooth_volume = topology(meshes::ball(10.0, 4)).volume_mm3;
    const auto check = [&](auto filter, double most_change) {
        Mesh ball = noisy_ball(0.2);
        ball.normals = vertex_normals(ball);
        const double before = roughness(ball);
        const SmoothReport report = filter(ball);
        EXPECT_LT(roughness(ball), 0.5 * before);
        EXPECT_DOUBLE_EQ(report.volume_after_mm3, topology(ball).volume_mm3);
        EXPECT_GT(report.largest_shift_mm, 0.1);
        EXPECT_LT(report.largest_shift_mm, 1.5); // noise of 5 sigma, and shrinking
        EXPECT_LT(report.area_after_mm2, report.area_before_mm2);
        EXPECT_LT(std::abs(report.volume_after_mm3 / smooth_volume - 1.0), most_change);
        EXPECT_EQ(ball.normals, vertex_normals(ball));
        const MeshTopology found = topology(ball);
        EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
    };
    // Neighbours e away lie e^2 / 2R below a vertex of a ball: here e <= 1.25 * R pi/2 / 16, so
    // k <= 0.0075. Five passes take 5 k of the radius, three times that of the volume. Noise adds
    // 3 sigma^2 / R^2 = 0.12 %.
    check([](Mesh& m) { return mean_filter(m, 5); }, 15 * 0.0075 + 0.0012);
    // f(k) = 1 + 0.0263 k - ..., ten times.
    check([](Mesh& m) { return taubin_filter(m, 10); }, 30 * 0.0263 * 0.0075 + 0.0012);
    // f is within 0.5 % of 1 below the pass band.
    check([](Mesh& m) { return windowed_sinc_filter(m, 20, 0.1); }, 3 * 0.005 + 0.0012);
}

// A vertex of a ball is off the mean of its neighbours by k times its radius; so a filter makes the
// volume f(k)^3 times as large, for some k between the smallest and the largest of them.
TEST(Filters, ChangeTheVolumeOfASphereByTheirFactor) {
    Mesh ball = meshes::ball(10.0, 5);
    const Neighbors neighbors = neighbors_of(ball);
    double least = 1.0, most = 0.0;
    for (size_t v = 0; v < ball.positions.size(); ++v) {
        glm::dvec3 sum(0.0);
        for (uint32_t i = neighbors.first[v]; i < neighbors.first[v + 1]; ++i)
            sum += glm::dvec3(ball.positions[neighbors.vertices[i]]);
        sum /= neighbors.first[v + 1] - neighbors.first[v];
        const double k = 1.0 - glm::length(sum) / 10.0;
        least = std::min(least, k);
        most = std::max(most, k);
    }
    EXPECT_LT(most, 0.003);
    const auto expect_between = [&](const Mesh& smoothed, auto f) {
        const double ratio = topology(smoothed).volume_mm3 / topology(ball).volume_mm3;
        const double a = std::pow(f(least), 3), b = std::pow(f(most), 3);
        EXPECT_GE(ratio, std::min(a, b) - 1e-5); // floats near 10, many of them
        EXPECT_LE(ratio, std::max(a, b) + 1e-5);
    };
    Mesh mean = ball, taubin = ball, sinc = ball;
    mean_filter(mean, 4);
    expect_between(mean, [](double k) { return std::pow(1.0 - k, 4); });
    const SmoothReport report = taubin_filter(taubin, 6);
    expect_between(taubin, [](double k) { return std::pow((1.0 - 0.5 * k) * (1.0 + k / 1.9), 6); });
    // The bar of the field: a sphere keeps its volume to 0.1 %.
    EXPECT_NEAR(report.volume_after_mm3 / report.volume_before_mm3, 1.0, 1e-3);
    windowed_sinc_filter(sinc, 20, 0.1);
    expect_between(sinc, [](double k) {
        const std::vector<double> c = windowed_sinc_coefficients(20, 0.1);
        double f = 0.0;
        for (size_t i = 0; i < c.size(); ++i)
            f += c[i] * std::cos(double(i) * std::acos(1.0 - 0.5 * k));
        return f;
    });
}

TEST(Filters, LeaveRimsWhereTheyAre) {
    Mesh mesh = noisy_ball(0.3);
    std::erase_if(mesh.triangles, [&](glm::uvec3 t) { return mesh.positions[t.x].z > 0.0f; });
    const Neighbors neighbors = neighbors_of(mesh);
    const std::vector<glm::vec3> before = mesh.positions;
    windowed_sinc_filter(mesh, 10);
    taubin_filter(mesh, 3);
    size_t rim = 0, moved = 0;
    for (size_t v = 0; v < before.size(); ++v) {
        rim += neighbors.open[v];
        moved += before[v] != mesh.positions[v];
        // sum c_i = 1 to the rounding of double, which floats do not show.
        ASSERT_TRUE(!neighbors.open[v] || glm::length(before[v] - mesh.positions[v]) < 2e-6f);
    }
    EXPECT_GT(rim, 30u);
    EXPECT_GT(moved, 300u);
}

TEST(Filters, DoNotDependOnTheOrderOfVerticesAndTriangles) {
    Mesh mesh = noisy_ball(0.3), other = mesh;
    std::vector<uint32_t> to(mesh.positions.size());
    std::iota(to.begin(), to.end(), 0u);
    std::mt19937 random(5);
    std::shuffle(to.begin(), to.end(), random);
    for (size_t v = 0; v < to.size(); ++v)
        other.positions[to[v]] = mesh.positions[v];
    for (glm::uvec3& t : other.triangles)
        t = {to[t.y], to[t.z], to[t.x]};
    std::shuffle(other.triangles.begin(), other.triangles.end(), random);
    mean_filter(mesh, 10);
    mean_filter(other, 10);
    for (size_t v = 0; v < to.size(); ++v) // sums of six doubles near 10, then one float
        ASSERT_LT(glm::length(mesh.positions[v] - other.positions[to[v]]), 2e-6f);
}

} // namespace
} // namespace palpate
