#include "engine/volume/synthetic.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace palpate::synthetic {
namespace {

struct Case {
    std::string name;
    Field field;
    double span;          // difference between the highest and the lowest value
    double length_mm;     // the field is smooth on this scale: |derivative n| <= 60 span / length^n
    double box_mm;        // random points lie in a cube of this half side about the origin
    glm::dvec3 pole{1e9}; // where the field has a point or line without a gradient
};

std::vector<Case> cases() {
    const glm::dvec3 c(1.5, -2.0, 0.5);
    const double pi = 3.14159265358979;
    return {
        {"ramp", ramp({1.0, -2.0, 0.5}, 3.0), 50.0, 20.0, 20.0},
        {"slab", slab(c, {1.0, 2.0, 3.0}, 4.0, 0.5, 700.0, -100.0), 800.0, 0.5, 5.0},
        {"sphere_distance", sphere_distance(c, 10.0), 20.0, 2.0, 20.0, c},
        {"sphere", sphere(c, 10.0, 0.5, 300.0, -900.0), 1200.0, 0.5, 12.0, c},
        {"torus", torus(c, 12.0, 4.0), 20.0, 2.0, 20.0, c},
        {"gyroid", gyroid(8.0), 3.0, 8.0 / (2.0 * pi), 20.0},
        {"gaussian", gaussian(c, 3.0, 500.0), 500.0, 3.0, 9.0},
        // The wave of the signal has at most 2 pi f_M pi / 2 = 59.2 radians per unit.
        {"marschner_lobb", marschner_lobb(20.0), 1.0, 20.0 / 59.2, 20.0},
        {"shells", shells(c, 5.0), 1.0, 5.0 / (2.0 * pi), 20.0, c},
        {"thin_sheet", thin_sheet(c, {-1.0, 0.3, 0.7}, 0.3), 1000.0, 0.3, 1.0},
        {"checkerboard", checkerboard(3.0, 4), 3.0, 3.0, 20.0},
        {"ct_phantom", ct_phantom(), 2100.0, 1.5, 100.0},
    };
}

class Synthetic : public testing::TestWithParam<size_t> {};

// A central difference of step h errs by h^2 / 6 times the third derivative. With h = 1e-4 lengths
// and a third derivative of at most 60 spans per cubed length (that of the polynomial edge; the
// others stay below 5) this is 1e-7 spans per length. Rounding adds, for values v and coordinates
// up to 100 mm, (v + 100 |gradient|) 2e-16 / h, below 1e-9 spans per length.
TEST_P(Synthetic, GradientIsTheDerivativeOfTheValue) {
    const Case test = cases()[GetParam()];
    const double h = 1e-4 * test.length_mm;
    const double tolerance = 1.1e-7 * test.span / test.length_mm;
    std::mt19937_64 random(GetParam());
    std::uniform_real_distribution<double> uniform(-test.box_mm, test.box_mm);
    double largest = 0.0;
    int compared = 0;
    for (int i = 0; i < 20000; ++i) {
        const glm::dvec3 p(uniform(random), uniform(random), uniform(random));
        if (glm::length(p - test.pole) < test.length_mm)
            continue;
        if (test.name == "torus") { // nor on the axis and the centre line
            const double radial = glm::length(glm::dvec2(p - test.pole));
            if (radial < 2.0 || glm::length(glm::dvec2(radial - 12.0, p.z - test.pole.z)) < 2.0)
                continue;
        }
        if (test.name == "checkerboard") { // nor at the jumps
            const glm::dvec3 f = glm::abs(glm::fract(p / 3.0) - 0.5);
            if (std::max({f.x, f.y, f.z}) > 0.5 - 1e-3)
                continue;
        }
        const glm::dvec3 exact = test.field.gradient(p);
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 step(0.0);
            step[axis] = h;
            const double difference =
                (test.field.value(p + step) - test.field.value(p - step)) / (2.0 * h);
            ASSERT_NEAR(exact[axis], difference, tolerance)
                << test.name << " axis " << axis << " at " << p.x << " " << p.y << " " << p.z;
        }
        largest = std::max(largest, glm::length(exact));
        ++compared;
    }
    EXPECT_GT(compared, 10000);
    if (test.name != "checkerboard") { // the points did meet the edges
        EXPECT_GT(largest, 0.01 * test.span / test.length_mm);
    }
}

INSTANTIATE_TEST_SUITE_P(Fields, Synthetic, testing::Range(size_t{0}, cases().size()),
                         [](const auto& test) { return cases()[test.param].name; });

// Far from edges erf is 1 to the last bit; on a face half the profile lies on either side.
TEST(SyntheticValue, SlabAndSphereHaveTheirValuesInsideOutsideAndOnTheFace) {
    const Field wall = slab({}, {0.0, 0.0, 2.0}, 10.0, 0.5, 700.0, -100.0);
    EXPECT_EQ(wall.value({3.0, 4.0, 0.0}), 700.0);
    EXPECT_EQ(wall.value({3.0, 4.0, 11.0}), -100.0);
    EXPECT_NEAR(wall.value({0.0, 0.0, 5.0}), 300.0, 1e-9);
    const Field ball = sphere({1.0, 0.0, 0.0}, 10.0, 0.5, 700.0, -100.0);
    EXPECT_EQ(ball.value({1.0, 0.0, 0.0}), 700.0);
    EXPECT_NEAR(ball.value({11.0, 0.0, 0.0}), 300.0, 1e-9);
    EXPECT_EQ(ball.value({21.0, 0.0, 0.0}), -100.0);
    EXPECT_EQ(ball.gradient({1.0, 0.0, 0.0}), glm::dvec3(0.0));
}

TEST(SyntheticValue, DistancesAreDistances) {
    const Field ball = sphere_distance({1.0, 2.0, 3.0}, 5.0);
    EXPECT_EQ(ball.value({1.0, 2.0, 3.0}), 5.0);
    EXPECT_EQ(ball.value({1.0, 2.0, 10.0}), -2.0);
    const Field ring = torus({}, 10.0, 3.0);
    EXPECT_EQ(ring.value({10.0, 0.0, 0.0}), 3.0);
    EXPECT_EQ(ring.value({0.0, 13.0, 4.0}), -2.0);
    EXPECT_EQ(ring.value({}), -7.0);
    EXPECT_EQ(ring.gradient({0.0, 12.0, 0.0}), glm::dvec3(0.0, -1.0, 0.0));
}

TEST(SyntheticValue, MarschnerLobbHasItsPublishedRange) {
    // (1 - sin(pi z / 2) + alpha (1 + cos)) / (2 (1 + alpha)): 1 at z = -1 where the wave is 1, and
    // 0 at z = 1 where it is -1. On the axis the wave is cos(2 pi 6) = 1.
    const Field signal = marschner_lobb(10.0);
    EXPECT_NEAR(signal.value({0.0, 0.0, -10.0}), 1.0, 1e-15);
    EXPECT_NEAR(signal.value({0.0, 0.0, 10.0}), 0.5 / 2.5, 1e-15);
    EXPECT_NEAR(signal.value({0.0, 0.0, 0.0}), 1.5 / 2.5, 1e-15);
}

TEST(SyntheticValue, CheckerboardLabelsDifferBetweenNeighbours) {
    const Field board = checkerboard(2.0, 3);
    for (int x = -5; x < 5; ++x)
        for (int y = -5; y < 5; ++y) {
            const double here = board.value({2.0 * x + 1.0, 2.0 * y + 1.0, -3.0});
            EXPECT_TRUE(here == 0.0 || here == 1.0 || here == 2.0);
            EXPECT_NE(here, board.value({2.0 * x + 3.0, 2.0 * y + 1.0, -3.0}));
            EXPECT_NE(here, board.value({2.0 * x + 1.0, 2.0 * y + 3.0, -3.0}));
            EXPECT_NE(here, board.value({2.0 * x + 1.0, 2.0 * y + 1.0, -1.0}));
        }
}

TEST(SyntheticValue, PhantomHasEachMaterialWhereTheHeaderSays) {
    const Field head = ct_phantom();
    EXPECT_EQ(head.value({100.0, 0.0, 0.0}), -1000.0);
    EXPECT_EQ(head.value({0.0, 0.97 * 95.0, 0.0}), 40.0);
    EXPECT_EQ(head.value({0.91 * 75.0, 0.0, 0.0}), 1100.0);
    EXPECT_EQ(head.value({30.0, 50.0, 0.0}), 35.0);
    EXPECT_EQ(head.value({}), 35.0);
    EXPECT_EQ(head.value({10.0, 20.0, 0.0}), 320.0);
    EXPECT_EQ(head.value({18.0, -10.0, -15.0}), 320.0);
}

TEST(SyntheticSample, TakesTheFieldAtTheCentresOfAnObliqueGrid) {
    Grid grid = make_grid({9, 5, 7}, {0.5, 0.5, 3.0}, {10.0, -20.0, 30.0});
    grid.world_from_index[0] = {0.3, -0.4, 0.0, 0.0};
    const Field field = ramp({1.0, 2.0, -3.0}, 4.0);
    const Volume volume = sample(field, grid, ScalarType::f32);
    for (const glm::uvec3 i : {glm::uvec3(0), glm::uvec3(8, 4, 6), glm::uvec3(3, 2, 1)})
        EXPECT_EQ(volume.value(i),
                  static_cast<float>(field.value(world_point(grid, glm::dvec3(i)))));
    EXPECT_EQ(volume.grid(), grid);
}

// The mean of n = 64^3 samples of variance 1 has a standard deviation of 1 / 512, their variance
// one of about sqrt(2) / 512: four of them are 0.0078 and 0.011. Neighbours and seeds are held to
// the same four deviations of a correlation of independent samples.
TEST(SyntheticSample, NoiseHasMeanZeroVarianceOneAndNoCorrelation) {
    double sum = 0.0, squares = 0.0, largest = 0.0;
    glm::dvec4 products(0.0);
    for (uint32_t z = 0; z < 64; ++z)
        for (uint32_t y = 0; y < 64; ++y)
            for (uint32_t x = 0; x < 64; ++x) {
                const double n = noise({x, y, z}, 7);
                sum += n;
                squares += n * n;
                largest = std::max(largest, std::abs(n));
                products += n * glm::dvec4(noise({x + 1, y, z}, 7), noise({x, y + 1, z}, 7),
                                           noise({x, y, z + 1}, 7), noise({x, y, z}, 8));
            }
    const double count = 64.0 * 64.0 * 64.0;
    EXPECT_NEAR(sum / count, 0.0, 4.0 / 512.0);
    EXPECT_NEAR(squares / count, 1.0, 4.0 * 1.4143 / 512.0);
    EXPECT_GT(largest, 3.5);
    for (int i = 0; i < 4; ++i)
        EXPECT_NEAR(products[i] / count, 0.0, 4.0 / 512.0) << i;
}

// FNV-1a over the samples: the phantom is the same bytes on every machine and compiler.
TEST(SyntheticSample, PhantomIsTheSameBytesEverywhere) {
    const Grid grid = make_grid({48, 56, 40}, {3.4, 3.6, 4.6}, {-80.0, -100.0, -90.0});
    const auto hash = [&](uint64_t seed) {
        const Volume volume = sample_ct_phantom(grid, seed);
        uint64_t h = 0xcbf29ce484222325u;
        for (uint32_t z = 0; z < 40; ++z)
            for (uint32_t y = 0; y < 56; ++y)
                for (uint32_t x = 0; x < 48; ++x) {
                    const auto v =
                        static_cast<uint16_t>(static_cast<int16_t>(volume.value({x, y, z})));
                    h = (h ^ (v & 0xff)) * 0x100000001b3u;
                    h = (h ^ (v >> 8)) * 0x100000001b3u;
                }
        return h;
    };
    EXPECT_EQ(hash(1), 17764209325626388307u);
    EXPECT_NE(hash(2), hash(1));
}

} // namespace
} // namespace palpate::synthetic
