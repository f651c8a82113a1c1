#include "engine/volume/bspline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "engine/volume/builder.h"
#include "engine/volume/sample.h"
#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr float kNoData = std::numeric_limits<float>::quiet_NaN();

double noise_at(glm::uvec3 i) {
    return 1000.0 * synthetic::noise(i, 3);
}

// The definition, term by term: sum of B(p - i) g(i - j) v(j) over i and j, j clamped; v(j) that
// lack data are left out of the average over j.
double by_definition(const Volume& volume, glm::dvec3 p) {
    const auto b = [](double t) {
        t = std::abs(t);
        return t >= 2.0   ? 0.0
               : t >= 1.0 ? (2.0 - t) * (2.0 - t) * (2.0 - t) / 6.0
                          : (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0;
    };
    const glm::ivec3 low(glm::floor(p)), last = glm::ivec3(volume.size()) - 1;
    double sum = 0.0;
    for (int i = 0; i < 64; ++i) {
        const glm::ivec3 at = low - 1 + glm::ivec3(i & 3, i >> 2 & 3, i >> 4);
        const double weight = b(p.x - at.x) * b(p.y - at.y) * b(p.z - at.z);
        double blurred = 0.0, total = 0.0;
        for (int j = 0; j < 343; ++j) {
            const glm::ivec3 tap = glm::ivec3(j % 7, j / 7 % 7, j / 49) - 3;
            const double g = std::exp(-0.5 * glm::dot(glm::dvec3(tap), glm::dvec3(tap)));
            const float v = volume.value(glm::uvec3(glm::clamp(at + tap, glm::ivec3(0), last)));
            blurred += v == v ? g * v : 0.0;
            total += v == v ? g : 0.0;
        }
        sum += total > 0.0 ? weight * blurred / total : 0.0;
    }
    return sum;
}

const Grid kGrid = make_grid({37, 35, 21}, {1.0, 1.0, 1.0});

std::vector<glm::dvec3> random_points(glm::uvec3 size, int count) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < count; ++i)
        points.push_back(glm::dvec3(uniform(random), uniform(random), uniform(random)) *
                         (glm::dvec3(size) - 1.0));
    return points;
}

// Values reach 6000 and about 700 terms are summed: an error of 700 * 1.1e-16 * 6000 = 5e-10 is
// the most that another order of summation makes.
TEST(SmoothCursor, EqualsItsDefinition) {
    const Volume volume = make_volume(kGrid, ScalarType::i16, noise_at);
    SmoothCursor cursor(volume);
    std::vector<glm::dvec3> points = random_points(kGrid.size, 300);
    points.insert(points.end(), {{0, 0, 0}, {36, 34, 20}, {0, 17, 20}, {36, 0.5, 3}, {31, 32, 8}});
    for (const glm::dvec3 p : points)
        ASSERT_NEAR(cursor.sample(p).value, by_definition(volume, p), 5e-10);
}

TEST(SmoothCursor, LeavesOutSamplesWithoutData) {
    const Volume volume = make_volume(kGrid, ScalarType::f32, [](glm::uvec3 i) {
        return synthetic::noise(i, 5) > 1.5 ? double{kNoData} : noise_at(i);
    });
    ASSERT_GT(volume.no_data_count(), 1000u);
    SmoothCursor cursor(volume);
    int with_data = 0, without = 0;
    for (const glm::dvec3 p : random_points(kGrid.size, 300)) {
        const SmoothSample sample = cursor.sample(p);
        if (std::isnan(trilinear(volume, p))) {
            EXPECT_TRUE(std::isnan(sample.value) && std::isnan(sample.gradient.x));
            ++without;
        } else {
            ASSERT_NEAR(sample.value, by_definition(volume, p), 5e-10);
            ++with_data;
        }
    }
    EXPECT_GT(with_data, 50);
    EXPECT_GT(without, 50);
}

// A central difference of step 1e-4 errs by 1e-8 / 6 times the third derivative, which is at most
// 8 * 6000 for a cubic B-spline of coefficients up to 6000, and by 1e-16 * 6000 / 1e-4 of rounding.
TEST(SmoothCursor, GradientIsTheDerivativeOfTheValue) {
    SmoothCursor cursor(make_volume(kGrid, ScalarType::i16, noise_at));
    for (glm::dvec3 p : random_points(kGrid.size - 1u, 500)) {
        p += 1e-3;
        const glm::dvec3 gradient = cursor.sample(p).gradient;
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 step(0.0);
            step[axis] = 1e-4;
            const double difference =
                (cursor.sample(p + step).value - cursor.sample(p - step).value) / 2e-4;
            ASSERT_NEAR(gradient[axis], difference, 1e-4);
        }
    }
}

// The window moves along with the points; no answer may depend on where it stood.
TEST(SmoothCursor, GivesTheSameBitsInAnyOrder) {
    const Volume volume = make_volume(kGrid, ScalarType::i16, noise_at);
    SmoothCursor cursor(volume);
    for (const glm::dvec3 p : random_points(kGrid.size, 300)) {
        for (const double shift : {0.0, 0.7, 2.1}) {
            const glm::dvec3 q = glm::min(p + shift, glm::dvec3(kGrid.size) - 1.0);
            const SmoothSample moved = cursor.sample(q), fresh = SmoothCursor(volume).sample(q);
            ASSERT_EQ(moved.value, fresh.value);
            ASSERT_EQ(moved.gradient, fresh.gradient);
        }
    }
}

// Blur and B-spline are symmetric with unit sums, so a linear field passes through unchanged where
// the border is five samples away. Rounding: 700 terms of at most 150, 1e-11.
TEST(SmoothCursor, ReproducesALinearFieldAwayFromTheBorder) {
    SmoothCursor cursor(make_volume(kGrid, ScalarType::f32, [](glm::uvec3 i) {
        return 2.0 * i.x - 3.0 * i.y + 0.5 * i.z + 1.0;
    }));
    for (const glm::dvec3 q : random_points(kGrid.size - 10u, 100)) {
        const glm::dvec3 p = q + 5.0;
        const SmoothSample sample = cursor.sample(p);
        EXPECT_NEAR(sample.value, 2.0 * p.x - 3.0 * p.y + 0.5 * p.z + 1.0, 2e-11);
        EXPECT_LT(glm::length(sample.gradient - glm::dvec3(2.0, -3.0, 0.5)), 2e-11);
    }
}

TEST(SmoothCursor, IsFlatAcrossAnAxisOfOneSampleAndNaNOutside) {
    SmoothCursor cursor(make_volume(make_grid({5, 1, 9}, {1, 1, 1}), ScalarType::u8,
                                    [](glm::uvec3 i) { return 10.0 * i.x + i.z; }));
    EXPECT_EQ(cursor.sample({2.5, 0.0, 4.5}).gradient.y, 0.0);
    EXPECT_GT(cursor.sample({2.5, 0.0, 4.5}).gradient.x, 0.0);
    for (const glm::dvec3 outside : {glm::dvec3(2, 0.1, 4), glm::dvec3(-0.1, 0, 4),
                                     glm::dvec3(2, 0, 8.1), glm::dvec3(NAN, 0, 0)}) {
        EXPECT_TRUE(std::isnan(cursor.sample(outside).value));
        EXPECT_TRUE(std::isnan(cursor.sample(outside).gradient.y));
    }
}

// --- normals of a plane tilted by 31 degrees, the scene of a hand sliding over a smooth wall

const glm::dvec3 kNormal(std::sin(31.0 * kPi / 180.0), 0.0, std::cos(31.0 * kPi / 180.0));
constexpr double kSide = 96.0, kStep = 1000.0;

struct Errors {
    double smooth_p99, smooth_max, smooth_rms, central_p99; // degrees
};

Errors plane_errors(double blur, double noise_share) {
    // A wall so thick that the grid sees one face of it, through the centre.
    const glm::dvec3 center(0.5 * (kSide - 1.0) + 0.3);
    const synthetic::Field wall =
        synthetic::slab(center - 500.0 * kNormal, kNormal, 1000.0, blur, kStep, 0.0);
    const Grid grid = make_grid(glm::uvec3(static_cast<uint32_t>(kSide)), {1.0, 1.0, 1.0});
    const Volume volume = synthetic::sample(wall, grid, ScalarType::f32, noise_share * kStep, 1);
    SmoothCursor smooth(volume);
    SampleCursor linear(volume);
    const auto degrees = [](glm::dvec3 g) {
        const glm::dvec3 c = glm::cross(g, -kNormal);
        return std::atan2(glm::length(c), glm::dot(g, -kNormal)) * 180.0 / kPi;
    };
    const auto root = [&](glm::dvec3 p, const auto& value) { // along the normal, within 2 samples
        double low = -2.0, high = 2.0;
        for (int i = 0; i < 40; ++i) {
            const double middle = 0.5 * (low + high);
            (value(p + middle * kNormal) > 0.5 * kStep ? low : high) = middle;
        }
        return p + low * kNormal;
    };
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-0.4 * kSide, 0.4 * kSide);
    std::vector<double> smooth_errors, central_errors;
    Errors errors{};
    for (int i = 0; i < 3000; ++i) {
        const glm::dvec3 p = center + uniform(random) * glm::dvec3(kNormal.z, 0.0, -kNormal.x) +
                             glm::dvec3(0.0, uniform(random), 0.0);
        const glm::dvec3 a = root(p, [&](glm::dvec3 q) { return smooth.sample(q).value; });
        smooth_errors.push_back(degrees(smooth.sample(a).gradient));
        errors.smooth_rms += smooth_errors.back() * smooth_errors.back() / 3000.0;
        const glm::dvec3 b = root(p, [&](glm::dvec3 q) { return linear.value(q); });
        central_errors.push_back(degrees(linear.gradient(b)));
    }
    std::sort(smooth_errors.begin(), smooth_errors.end());
    std::sort(central_errors.begin(), central_errors.end());
    errors.smooth_rms = std::sqrt(errors.smooth_rms);
    errors.smooth_p99 = smooth_errors[2970];
    errors.smooth_max = smooth_errors.back();
    errors.central_p99 = central_errors[2970];
    return errors;
}

// Without noise what tilts the gradient are the copies of the spectrum that sampling makes at 2 pi
// m. The profile's spectrum lies on the line w * normal; its derivative there is a Gaussian of
// variance s^2 = blur^2 + 1 (edge and blur; the blur of samples is periodic and damps the copies as
// it damps the original), and the B-spline weights the copy by sinc^4 per axis, sinc(t) =
// sin(t/2)/(t/2). The part of each copy's gradient across the normal, summed without regard to
// phase and divided by the gradient itself, bounds the tangent of the error.
double aliasing_bound_degrees(double blur) {
    const double s2 = blur * blur + 1.0;
    const auto sinc4 = [](double t) {
        const double s = std::abs(t) < 1e-9 ? 1.0 : std::sin(0.5 * t) / (0.5 * t);
        return s * s * s * s;
    };
    double across = 0.0, along = 0.0;
    const double dw = 0.01;
    for (double w = -15.0 + 0.5 * dw; w < 15.0; w += dw) {
        const double derivative = std::exp(-0.5 * s2 * w * w);
        const glm::dvec3 base = w * kNormal;
        along += derivative * sinc4(base.x) * sinc4(base.z);
        for (int mx = -4; mx <= 4; ++mx)
            for (int mz = -4; mz <= 4; ++mz) {
                if (mx == 0 && mz == 0)
                    continue;
                const glm::dvec3 shifted = base + 2.0 * kPi * glm::dvec3(mx, 0, mz);
                across += derivative / std::abs(w) * sinc4(shifted.x) * sinc4(shifted.z) *
                          glm::length(glm::cross(shifted, kNormal));
            }
    }
    return std::atan(across / along) * 180.0 / kPi;
}

// White noise of variance n^2 passes through blur and spline, together nearly a Gaussian of
// variance k^2 = 1 + 1/3, so each component of the gradient gets the variance
// n^2 / (2 k^2 (2 sqrt(pi) k)^3). The gradient itself is step / sqrt(2 pi (blur^2 + k^2)). Two
// components lie across the normal: the error has a Rayleigh distribution of this scale.
double noise_scale_degrees(double blur, double noise_share) {
    const double k2 = 4.0 / 3.0;
    const double deviation =
        noise_share / std::sqrt(2.0 * k2 * std::pow(2.0 * std::sqrt(kPi * k2), 3.0));
    return deviation * std::sqrt(2.0 * kPi * (blur * blur + k2)) * 180.0 / kPi;
}

TEST(SmoothCursor, NormalsOfATiltedPlane) {
    struct Row {
        double blur, noise;
    };
    std::printf("edge blur, noise: p99 (largest), degrees; central differences p99\n");
    for (const Row row : {Row{0.5, 0.0}, Row{0.5, 0.05}, Row{0.5, 0.10}, Row{1.0, 0.10}}) {
        const Errors errors = plane_errors(row.blur, row.noise);
        std::printf("%.1f, %2.0f %%: %.2f (%.2f); %.2f\n", row.blur, 100.0 * row.noise,
                    errors.smooth_p99, errors.smooth_max, errors.central_p99);
        if (row.noise == 0.0) {
            EXPECT_LT(errors.smooth_max, aliasing_bound_degrees(row.blur));
            EXPECT_LT(errors.smooth_p99, errors.central_p99 / 20.0);
            continue;
        }
        // 77 x 77 samples of the plane hold about 77^2 / (4 pi k^2) = 350 independent errors. The
        // 99th percentile of 350 Rayleigh numbers has a deviation of 6 %, their mean square one of
        // 1 / sqrt(350) = 5 %, so their root mean square 2.7 %: three of each.
        const double scale = noise_scale_degrees(row.blur, row.noise);
        EXPECT_NEAR(errors.smooth_p99 / (scale * std::sqrt(2.0 * std::log(100.0))), 1.0, 0.18);
        EXPECT_NEAR(errors.smooth_rms / (scale * std::sqrt(2.0)), 1.0, 0.08);
        EXPECT_LT(errors.smooth_p99, errors.central_p99 / 3.0);
    }
}

} // namespace
} // namespace palpate
