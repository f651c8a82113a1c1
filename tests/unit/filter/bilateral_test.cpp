#include "engine/segment/bilateral.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

double twin_bilateral(const Volume& volume, glm::ivec3 i, double sigma_mm, double range) {
    const double centre = twin::at(volume, i);
    if (std::isnan(centre))
        return NAN;
    const glm::dmat3 axes(volume.grid().world_from_index);
    const int reach = 14;
    double sum = 0, total = 0;
    for (const glm::ivec3 d : twin::indices(glm::ivec3(2 * reach + 1))) {
        const double mm = glm::length(axes * glm::dvec3(d - reach));
        const double v = twin::at(volume, i + d - reach) - centre;
        if (mm > kBilateralReach * sigma_mm + 1e-9 || std::isnan(v))
            continue;
        const double w =
            std::exp(-0.5 * (mm * mm / (sigma_mm * sigma_mm) + v * v / (range * range)));
        sum += w * v;
        total += w;
    }
    return centre + sum / total;
}

// Values span 2000; weights are right to 5e-6 in both sums, and rounding of up to 400 additions
// adds 400 / 2^24 of the largest weighted difference, which is below range / sqrt(e) * taps /
// total.
TEST(Bilateral, EqualsTheTwinOnEveryGrid) {
    for (const bool sheared : {false, true})
        for (const uint32_t missing : {0u, 6u}) {
            const glm::uvec3 size(36, 7, 5);
            const Volume volume = twin::noise(sheared ? twin::turned(size, {0.8, 1.0, 2.0}, true)
                                                      : make_grid(size, {0.8, 1.0, 2.0}),
                                              ScalarType::f32, missing);
            const Volume made = bilateral(volume, {1.3, 300.0, false}, {}).value();
            for (const glm::ivec3 i : twin::indices(glm::ivec3(size))) {
                if (i.x % 3 != 0)
                    continue;
                const double expected = twin_bilateral(volume, i, 1.3, 300.0);
                const float found = made.value(glm::uvec3(i));
                ASSERT_EQ(std::isnan(found), std::isnan(expected));
                if (!std::isnan(expected)) {
                    ASSERT_NEAR(found, expected, 1e-5 * 2000 + 400.0 / (1 << 24) * 300);
                }
            }
        }
}

// A wide range: Gaussian smoothing; a narrow one: nothing but equals are averaged.
TEST(Bilateral, KeepsEdgesAndSmoothsBetween) {
    const Volume volume =
        make_volume(make_grid({40, 12, 12}, {1, 1, 1}), ScalarType::i16, [](glm::uvec3 i) {
            return (i.x < 20 ? 0.0 : 1000.0) + ((i.x + i.y + i.z) % 2 ? 10.0 : -10.0);
        });
    for (const bool separable : {false, true}) {
        const Volume made = bilateral(volume, {1.5, 60.0, separable}, {}).value();
        for (const uint32_t x : {10u, 19u, 20u, 30u})
            EXPECT_NEAR(made.value({x, 6, 6}), x < 20 ? 0.0 : 1000.0, 2.0) << x << separable;
    }
}

TEST(Bilateral, ConstantsStayAndThreadsChangeNoBit) {
    const Volume flat = make_volume(make_grid({40, 9, 3}, {1, 1, 2}), ScalarType::f32,
                                    [](glm::uvec3 i) { return i.x == 35 ? NAN : 0.1; });
    const Volume volume = twin::noise(make_grid({70, 40, 33}, {1, 1, 2}), ScalarType::i16);
    for (const bool separable : {false, true}) {
        const Volume still = bilateral(flat, {2.0, 5.0, separable}, {}).value();
        EXPECT_EQ(still.range(), (ValueRange{0.1f, 0.1f}));
        EXPECT_EQ(still.no_data_count(), flat.no_data_count());
        const Volume all = bilateral(volume, {1.0, 400.0, separable}, {}).value();
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
        EXPECT_TRUE(twin::same_bits(bilateral(volume, {1.0, 400.0, separable}, {}).value(), all));
    }
}

// Squares of differences and of the range may exceed a float; of 3e38 sums do, too.
TEST(Bilateral, LargeValuesAreRightOrRefused) {
    const auto edge = [](double factor) {
        return make_volume(make_grid({8, 4, 4}, {1, 1, 1}), ScalarType::f32,
                           [=](glm::uvec3 i) { return factor * (i.x < 4 ? -1.0 : 1.0); });
    };
    const Volume unit = *bilateral(edge(1.0), {1.0, 0.5}, {});
    const Volume large = *bilateral(edge(1e25), {1.0, 0.5e25}, {});
    for (uint32_t x = 0; x < 8; ++x)
        EXPECT_NEAR(double{large.value({x, 2, 2})} / 1e25, unit.value({x, 2, 2}), 1e-5);
    EXPECT_FALSE(bilateral(edge(3e38), {1.0, 1e38}, {}));
}

TEST(Bilateral, RefusesWhatItCannotDo) {
    const Volume volume = twin::noise(make_grid({8, 8, 8}, {1, 1, 1}), ScalarType::i16);
    const auto message = [&](BilateralOptions o) {
        const Result<Volume> made = bilateral(volume, o, {});
        return made ? std::string("made") : made.error().message;
    };
    EXPECT_EQ(
        message({0, 50, false}),
        "sigma: expected more than 0 and at most 8 mm, which reaches 24 samples of the finest "
        "axis, found 0");
    EXPECT_EQ(message({1, 0, false}), "range: expected a difference of values above 0, found 0");
    EXPECT_EQ(message({1, INFINITY, false}),
              "range: expected a difference of values above 0, found inf");
}

} // namespace
} // namespace palpate
