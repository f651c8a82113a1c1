#include "engine/segment/gaussian.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>

#include "engine/segment/kernel.h"
#include "engine/volume/synthetic.h"
#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

using twin::indices;

// The normalised convolution and its derivatives by the index in double, sample by sample.
class Twin {
 public:
    Twin(const Volume& volume, double sigma_mm) : volume_(volume) {
        for (int a = 0; a < 3; ++a)
            for (int order = 0; order < 3; ++order)
                kernels_[size_t(a)][size_t(order)] =
                    gaussian_kernel(sigma_mm / spacing_mm(volume.grid())[a], order);
    }

    double of(glm::ivec3 i, glm::ivec3 order) const {
        if (std::isnan(twin::at(volume_, i)))
            return NAN;
        // N_a = sum over b <= a of C(a, b) f_b D_(a - b), solved for f_a.
        double f = sum(i, order, false);
        for (const glm::ivec3 below : indices(order + 1))
            if (below != order) {
                double times = 1;
                for (int a = 0; a < 3; ++a)
                    times *= order[a] == 2 && below[a] == 1 ? 2 : 1;
                f -= times * of(i, below) * sum(i, order - below, true);
            }
        return f / sum(i, glm::ivec3(0), true);
    }

 private:
    static double weight(const Kernel& kernel, int k) {
        if (k != 0)
            return (kernel.order == 1 && k < 0 ? -1.0 : 1.0) *
                   double{kernel.weights[size_t(std::abs(k))]};
        double rest = kernel.order == 0 ? 1.0 : 0.0;
        for (int n = 1; n <= kernel.radius() && kernel.order != 1; ++n)
            rest -= 2.0 * double{kernel.weights[size_t(n)]};
        return rest;
    }
    double sum(glm::ivec3 i, glm::ivec3 order, bool of_weights) const {
        std::array<const Kernel*, 3> kernels;
        glm::ivec3 radius;
        for (int a = 0; a < 3; ++a) {
            kernels[size_t(a)] = &kernels_[size_t(a)][size_t(order[a])];
            radius[a] = kernels[size_t(a)]->radius();
        }
        double total = 0;
        for (const glm::ivec3 k : indices(2 * radius + 1)) {
            const glm::ivec3 d = k - radius;
            const double v = twin::at(volume_, i + d);
            if (!std::isnan(v))
                total += (of_weights ? 1.0 : v) * weight(*kernels[0], d.x) *
                         weight(*kernels[1], d.y) * weight(*kernels[2], d.z);
        }
        return total;
    }
    Volume volume_;
    std::array<std::array<Kernel, 3>, 3> kernels_; // by axis and order
};

// Rounding of a float pass: each of at most 2 * 9 additions of terms below 4 * 1500 errs by 2^-24
// of a partial sum; three passes; the quotient divides by at least the centre's weight, 0.08 here,
// and derivatives carry at most four products of that size.
constexpr double kRounding = 3 * 18 * 6000.0 / (1 << 24);

TEST(Gaussian, EqualsTheTwinOnAllTypesAndWithoutData) {
    for (const ScalarType type : {ScalarType::u8, ScalarType::i16, ScalarType::f32})
        for (const uint32_t missing : {0u, 5u}) {
            if (missing > 0 && type != ScalarType::f32)
                continue;
            const Volume volume =
                twin::noise(make_grid({37, 9, 6}, {0.5, 0.5, 3.0}), type, missing);
            const Result<Volume> made = gaussian(volume, {0.9}, {});
            ASSERT_TRUE(made);
            EXPECT_EQ(made->type(), ScalarType::f32);
            const Twin twin(volume, 0.9);
            for (const glm::ivec3 i : indices(glm::ivec3(volume.size()))) {
                if (i.x % 6 != 1)
                    continue;
                const double expected = twin.of(i, {});
                const float found = made->value(glm::uvec3(i));
                ASSERT_EQ(std::isnan(expected), std::isnan(found)) << i.x << "," << i.y;
                if (!std::isnan(expected)) {
                    ASSERT_NEAR(found, expected, kRounding) << i.x << "," << i.y << "," << i.z;
                }
            }
        }
}

TEST(Gaussian, DerivativesInTheWorldEqualTheTwin) {
    for (const bool sheared : {false, true})
        for (const uint32_t missing : {0u, 7u}) {
            const Grid grid = twin::turned({34, 5, 4}, {0.8, 1.0, 1.6}, sheared);
            const Volume volume = twin::noise(grid, ScalarType::f32, missing);
            const double sigma = 0.8;
            const Twin twin(volume, sigma);
            const glm::dmat3 m = glm::transpose(glm::inverse(glm::dmat3(grid.world_from_index)));
            const Volume length = gradient_magnitude(volume, {sigma}, {}).value();
            const VectorField field = gradient(volume, {sigma}, {}).value();
            const Volume cross = derivative(volume, {sigma, 0, 2}, {}).value();
            for (const glm::ivec3 i : indices({34, 5, 4})) {
                if (i.x % 8 != 1)
                    continue;
                glm::dvec3 g;
                glm::dmat3 h;
                for (int p = 0; p < 3; ++p) {
                    glm::ivec3 order(0);
                    order[p] = 1;
                    g[p] = twin.of(i, order);
                    for (int q = 0; q < 3; ++q) {
                        glm::ivec3 both = order;
                        ++both[q];
                        h[p][q] = twin.of(i, both);
                    }
                }
                const glm::dvec3 world = m * g;
                const double across = (m * h * glm::transpose(m))[0][2];
                const auto near = [&](float found, double expected, const char* name) {
                    ASSERT_EQ(std::isnan(found), std::isnan(expected)) << name;
                    if (!std::isnan(expected)) {
                        ASSERT_NEAR(found, expected, 40 * kRounding) << name;
                    }
                };
                near(length.value(glm::uvec3(i)), glm::length(world), "length");
                for (int a = 0; a < 3; ++a)
                    near(field[size_t(a)].value(glm::uvec3(i)), world[a], "gradient");
                near(cross.value(glm::uvec3(i)), across, "second");
            }
        }
}

// exp(-r^2 / 2 s^2) blurred by sigma: (s^2 / (s^2 + sigma^2))^(3/2) exp(-r^2 / 2 (s^2 + sigma^2)).
TEST(Gaussian, OfAGaussianIsAWiderOne) {
    const double s = 6.0, sigma = 2.5, wide = s * s + sigma * sigma, peak = 1000;
    const Grid grid = make_grid({48, 40, 24}, {1.0, 1.2, 2.0}, {-24, -24, -24});
    const Volume volume =
        synthetic::sample(synthetic::gaussian({0, 0, 0}, s, peak), grid, ScalarType::f32);
    const Volume smooth = gaussian(volume, {sigma}, {}).value();
    const Volume along = derivative(volume, {sigma, 1, {}}, {}).value();
    const Volume second = derivative(volume, {sigma, 1, 1}, {}).value();
    for (const glm::ivec3 i : indices({48, 40, 24})) {
        const glm::dvec3 mm = world_point(grid, glm::dvec3(i));
        if (glm::length(mm) > 10.0) // the border repeats samples
            continue;
        const double exact =
            peak * std::pow(s * s / wide, 1.5) * std::exp(-0.5 * glm::dot(mm, mm) / wide);
        // Beyond 5 moments the kernels differ from the Gaussian by what is cut off: 6.3e-5.
        EXPECT_NEAR(smooth.value(glm::uvec3(i)), exact, 1e-4 * peak);
        EXPECT_NEAR(along.value(glm::uvec3(i)), -mm.y / wide * exact, 1e-3 * peak / s);
        EXPECT_NEAR(second.value(glm::uvec3(i)), (mm.y * mm.y / wide - 1) / wide * exact,
                    5e-3 * peak / (s * s));
    }
}

TEST(Gaussian, ConstantsStayAndTheMeanIsKept) {
    const Grid grid = make_grid({70, 33, 9}, {0.5, 0.7, 3});
    const Volume constant = make_volume(
        grid, ScalarType::f32, [](glm::uvec3 i) { return i.x == 40 && i.y == 20 ? NAN : 0.1; });
    const Volume smooth = gaussian(constant, {2.0}, {}).value();
    const Volume slope = gradient_magnitude(constant, {2.0}, {}).value();
    for (const glm::ivec3 i : indices(glm::ivec3(grid.size))) {
        const bool none = i.x == 40 && i.y == 20;
        ASSERT_EQ(std::isnan(smooth.value(glm::uvec3(i))), none);
        if (!none) {
            ASSERT_NEAR(smooth.value(glm::uvec3(i)), 0.1f, 2e-7f); // N / D, both rounded
            ASSERT_NEAR(slope.value(glm::uvec3(i)), 0.0f, 1e-6f);
        }
    }
    // Whole bricks are not touched.
    const Volume flat = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return -7.0; });
    const Volume still = gaussian(flat, {2.0}, {}).value();
    EXPECT_EQ(still.range(), (ValueRange{-7, -7}));
    EXPECT_EQ(gradient_magnitude(flat, {2.0}, {}).value().range(), (ValueRange{0, 0}));
    // One bright sample far from the border: the sum stays.
    const Volume dot = make_volume(grid, ScalarType::i16, [](glm::uvec3 i) {
        return i == glm::uvec3(35, 16, 4) ? 1000.0 : 0.0;
    });
    const Volume blurred = gaussian(dot, {1.0}, {}).value();
    double sum = 0;
    for (const glm::ivec3 i : indices(glm::ivec3(grid.size)))
        sum += double{blurred.value(glm::uvec3(i))};
    EXPECT_NEAR(sum, 1000.0, 1e-3);
}

TEST(Gaussian, ShiftsAndFlipsWithItsInputToTheBit) {
    const glm::uvec3 size(80, 40, 34);
    const Volume volume = twin::noise(make_grid(size, {1, 1, 2}), ScalarType::i16);
    const Volume moved = make_volume(volume.grid(), ScalarType::i16, [&](glm::uvec3 i) {
        return volume.value(glm::min(i + glm::uvec3(5, 3, 2), size - 1u));
    });
    const Volume flipped = make_volume(volume.grid(), ScalarType::i16, [&](glm::uvec3 i) {
        return volume.value({size.x - 1 - i.x, i.y, i.z});
    });
    const Volume a = gradient_magnitude(volume, {1.5}, {}).value();
    const Volume b = gradient_magnitude(moved, {1.5}, {}).value();
    const Volume c = gradient_magnitude(flipped, {1.5}, {}).value();
    for (const glm::uvec3 i : {glm::uvec3(20, 12, 9), {29, 29, 20}, {50, 20, 16}, {31, 10, 12}}) {
        EXPECT_EQ(b.value(i), a.value(i + glm::uvec3(5, 3, 2)));
        EXPECT_EQ(c.value(i), a.value({size.x - 1 - i.x, i.y, i.z}));
    }
}

TEST(Gaussian, ThreadsChangeNoBit) {
    const Volume volume = twin::noise(make_grid({70, 65, 40}, {1, 1, 2}), ScalarType::f32, 50);
    const Volume one = [&] {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        return gradient_magnitude(volume, {1.2}, {}).value();
    }();
    for (const size_t threads : {2, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_TRUE(twin::same_bits(gradient_magnitude(volume, {1.2}, {}).value(), one));
    }
}

TEST(Gaussian, ThinVolumesAndOneSample) {
    for (const glm::uvec3 size : {glm::uvec3(1), {40, 1, 1}, {1, 40, 1}, {1, 1, 40}, {40, 33, 1}}) {
        const Volume volume = make_volume(make_grid(size, {1, 1, 5}), ScalarType::u8,
                                          [](glm::uvec3 i) { return 10.0 + i.x + i.y + i.z; });
        const Volume smooth = gaussian(volume, {0.6}, {}).value();
        EXPECT_NEAR(smooth.value(size / 2u), volume.value(size / 2u), 1e-5) << size.x;
        const Volume slope = gradient_magnitude(volume, {0.6}, {}).value();
        const double expected = std::sqrt((size.x > 1) + (size.y > 1) + (size.z > 1) / 25.0);
        EXPECT_NEAR(slope.value(size / 2u), expected, 1e-5) << size.x;
    }
}

// Values of 1e6 with differences of some units, in which a float's last place is 0.0625:
// derivatives are right to 1e-5 of the largest difference, also where data lack.
TEST(Gaussian, AnOffsetCostsADerivativeNothing) {
    for (const uint32_t missing : {0u, 9u}) {
        const Grid grid = twin::turned({33, 9, 8}, {0.8, 1.0, 1.6});
        const Volume small = twin::noise(grid, ScalarType::f32, missing);
        const Volume large = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            return 1e6 + std::round(double{small.value(i)} / 100.0);
        });
        const Volume length = *gradient_magnitude(large, {0.8}, {});
        const Volume cross = *derivative(large, {0.8, 0, 2}, {});
        const Twin twin(large, 0.8);
        const glm::dmat3 m = glm::transpose(glm::inverse(glm::dmat3(grid.world_from_index)));
        for (const glm::ivec3 i : indices({33, 9, 8})) {
            if (i.x % 8 != 1 || std::isnan(large.value(glm::uvec3(i))))
                continue;
            glm::dvec3 g;
            glm::dmat3 h;
            for (int p = 0; p < 3; ++p) {
                glm::ivec3 order(0);
                order[p] = 1;
                g[p] = twin.of(i, order);
                for (int q = 0; q < 3; ++q) {
                    glm::ivec3 both = order;
                    ++both[q];
                    h[p][q] = twin.of(i, both);
                }
            }
            // Values differ by up to 20.
            EXPECT_NEAR(length.value(glm::uvec3(i)), glm::length(m * g), 20e-5);
            EXPECT_NEAR(cross.value(glm::uvec3(i)), (m * h * glm::transpose(m))[0][2], 20e-5);
        }
    }
}

// Sums of the largest floats are no floats; squares of 1e25 are none either.
TEST(Gaussian, LargeValuesAreRightOrRefused) {
    const auto ramp = [](double factor) {
        return make_volume(make_grid({9, 5, 4}, {1, 1, 1}), ScalarType::f32,
                           [=](glm::uvec3 i) { return factor * (double(i.x) - 4.0); });
    };
    EXPECT_THAT(
        gaussian(ramp(7e37), {1.0}, {}).error().message,
        testing::HasSubstr("expected values from -1e+30 to 1e+30, found -2.8e+38 to 2.8e+38"));
    EXPECT_FALSE(gradient_magnitude(ramp(7e37), {0.0}, {}));
    const Volume slope = *gradient_magnitude(ramp(1e25), {0.0}, {});
    EXPECT_NEAR(double{slope.value({4, 2, 2})} / 1e25, 1.0, 1e-6);
}

TEST(Gaussian, RefusesWhatItCannotDo) {
    const Volume volume = twin::noise(make_grid({8, 8, 8}, {0.5, 1, 1}), ScalarType::i16);
    const auto message = [](const Result<Volume>& made) {
        return made ? std::string("made") : made.error().message;
    };
    EXPECT_EQ(message(gaussian(volume, {-1}, {})),
              "sigma: expected 0 .. 16 mm, which is 32 samples of the finest axis, found -1");
    EXPECT_EQ(message(gaussian(volume, {NAN}, {})),
              "sigma: expected 0 .. 16 mm, which is 32 samples of the finest axis, found nan");
    EXPECT_EQ(message(derivative(volume, {1, 3, {}}, {})),
              "derivative: expected axes 0 .. 2, found 3 and 0");
    std::stop_source source;
    source.request_stop();
    EXPECT_EQ(message(gaussian(volume, {1}, {source.get_token(), {}})),
              "stopped before it was done");
}

} // namespace
} // namespace palpate
