#include "engine/segment/signed_distance.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/volume/synthetic.h"
#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

// The smallest squared distance to a sample of another label, over all of them, in squares of
// `unit`; in double.
std::vector<double> brute_force(const Volume& labels, double unit) {
    const std::vector<float> kind = samples_of(labels);
    const glm::dvec3 spacing = spacing_mm(labels.grid()) / unit;
    std::vector<double> out(kind.size(), INFINITY);
    for (size_t a = 0; a < kind.size(); ++a)
        for (size_t b = 0; b < a; ++b) {
            if (kind[a] == kind[b])
                continue;
            const glm::dvec3 apart = spacing * (glm::dvec3(index_of(labels.size(), a)) -
                                                glm::dvec3(index_of(labels.size(), b)));
            const double squared = glm::dot(apart, apart);
            out[a] = std::min(out[a], squared);
            out[b] = std::min(out[b], squared);
        }
    return out;
}

struct Case {
    glm::uvec3 size;
    glm::dvec3 spacing;
    int kinds;
    double stay;
};
const Case kCases[] = {
    {{9, 11, 7}, {1, 1, 1}, 2, 0.5},
    {{33, 5, 35}, {1, 2, 3}, 2, 0.98},
    {{2, 70, 61}, {1, 1, 2}, 2, 0.9995},
    {{41, 40, 1}, {0.5, 0.5, 3}, 3, 0.9},
    {{1, 1, 90}, {0.7, 0.8, 0.9}, 2, 0.97},
    {{12, 13, 40}, {0.957, 0.957, 1.5}, 4, 0.99},
    {{3, 90, 30}, {0.3, 0.41, 0.77}, 2, 0.9998},
};

TEST(SignedDistance, IsThatOfBruteForceOnRandomLabels) {
    uint64_t seed = 1;
    for (const Case& one : kCases)
        for (int run = 0; run < 3; ++run) {
            const Volume labels =
                random_labels(make_grid(one.size, one.spacing), one.kinds, one.stay, seed++);
            const Result<Volume> made = signed_distance(labels, {.of = DistanceOf::labels}, {});
            ASSERT_TRUE(made) << made.error().message;
            const std::vector<double> expected = brute_force(labels, 1.0);
            const std::vector<float> kind = samples_of(labels), found = samples_of(*made);
            for (size_t i = 0; i < found.size(); ++i) {
                if (std::isinf(expected[i])) {
                    EXPECT_TRUE(std::isnan(found[i]));
                    continue;
                }
                // Three roundings of squares (their halves count), one of the weights, of the root
                // and of the unit: at most 4 half units in the last place.
                const double mm = std::sqrt(expected[i]);
                ASSERT_NEAR(double{found[i]}, kind[i] == 0 ? mm : -mm, mm * 4 * 0x1p-24)
                    << "seed " << seed << " sample " << i;
            }
        }
}

TEST(SignedDistance, SquaresAreWholeNumbersOnIsotropicGrids) {
    const Volume labels = random_labels(make_grid({40, 37, 3}, glm::dvec3(0.7)), 2, 0.99, 7);
    const Result<Volume> made = signed_distance(labels, {}, {});
    const std::vector<double> expected = brute_force(labels, 0.7);
    const std::vector<float> found = samples_of(*made);
    for (size_t i = 0; i < found.size(); ++i)
        ASSERT_EQ(std::abs(found[i]),
                  0.7f * std::sqrt(static_cast<float>(std::round(expected[i]))));
}

TEST(SignedDistance, SeparatesOneLabelFromAllOthers) {
    const Volume labels = random_labels(make_grid({20, 21, 22}, {1, 1, 1}), 4, 0.9, 3);
    std::vector<float> kind = samples_of(labels);
    std::vector<uint8_t> mask(kind.size());
    for (size_t i = 0; i < kind.size(); ++i)
        mask[i] = kind[i] == 2.0f ? 200 : 0;
    const Result<Volume> of_label =
        signed_distance(labels, {.of = DistanceOf::label, .label = 2}, {});
    const Result<Volume> of_mask =
        signed_distance(make_volume<uint8_t>(labels.grid(), mask), {}, {});
    EXPECT_EQ(samples_of(*of_label), samples_of(*of_mask));
}

TEST(SignedDistance, OfABallIsThatOfTheSphereToASample) {
    const Grid grid = make_grid({45, 45, 45}, glm::dvec3(1.0), glm::dvec3(-22.0));
    const synthetic::Field ball = synthetic::sphere_distance({0, 0, 0}, 15.0);
    const Volume labels = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return ball.value(world_point(grid, glm::dvec3(i))) >= 0.0 ? 1.0 : 0.0;
    });
    const Result<Volume> made = signed_distance(labels, {}, {});
    for (size_t i = 0; i < sample_count(grid); ++i) {
        const glm::uvec3 at = index_of(grid.size, i);
        // Some sample of the other side lies within half a diagonal of the nearest point of the
        // sphere, and none nearer than the sphere.
        const double exact = -ball.value(world_point(grid, glm::dvec3(at)));
        const double found = double{made->value(at)};
        EXPECT_EQ(found > 0.0, exact > 0.0);
        EXPECT_GE(std::abs(found), std::abs(exact) - 1e-5);
        EXPECT_LE(std::abs(found), std::abs(exact) + std::sqrt(3.0));
    }
}

TEST(SignedDistance, OfAnEmptyOrFullMaskIsNoData) {
    const Grid grid = make_grid({40, 3, 5}, {1, 1, 2});
    for (const double value : {0.0, 1.0}) {
        const Volume labels = make_volume(grid, ScalarType::u8, [&](glm::uvec3) { return value; });
        EXPECT_EQ(signed_distance(labels, {}, {})->no_data_count(), sample_count(grid));
        const Result<Volume> limited = signed_distance(labels, {.max_mm = 3.0}, {});
        EXPECT_EQ(limited->range(), (value == 0.0 ? ValueRange{3, 3} : ValueRange{-3, -3}));
    }
}

TEST(SignedDistance, AreTheSameInABandAndItsLimitBeyond) {
    const Volume labels = random_labels(make_grid({33, 80, 40}, {1, 1.1, 2}), 2, 0.999, 5);
    const std::vector<float> all = samples_of(*signed_distance(labels, {}, {}));
    const std::vector<float> band = samples_of(*signed_distance(labels, {.max_mm = 5.5}, {}));
    for (size_t i = 0; i < all.size(); ++i)
        ASSERT_EQ(band[i], std::clamp(all[i], -5.5f, 5.5f));
}

TEST(SignedDistance, HasTheSameBitsOnAnyNumberOfThreads) {
    const Volume labels = random_labels(make_grid({70, 66, 50}, {0.4, 0.5, 2}), 3, 0.9999, 11);
    const std::vector<float> expected =
        samples_of(*signed_distance(labels, {.of = DistanceOf::labels}, {}));
    for (const size_t threads : {1, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_EQ(samples_of(*signed_distance(labels, {.of = DistanceOf::labels}, {})), expected);
    }
}

TEST(SignedDistance, IsTheSameOnATurnedGridAndRefusesASlantedOne) {
    const Grid upright = make_grid({20, 21, 22}, {1, 1.5, 2});
    Grid turned = upright;
    turned.world_from_index =
        glm::rotate(glm::dmat4(1.0), 0.7, glm::normalize(glm::dvec3(1, 2, 3))) *
        upright.world_from_index;
    const Volume labels = random_labels(upright, 2, 0.95, 2);
    const std::vector<float> a = samples_of(*signed_distance(labels, {}, {}));
    const std::vector<float> b = samples_of(*signed_distance(with_grid(labels, turned), {}, {}));
    for (size_t i = 0; i < a.size(); ++i)
        EXPECT_NEAR(a[i], b[i], std::abs(a[i]) * 0x1p-21f); // spacings of a product of matrices
    Grid slanted = upright;
    slanted.world_from_index[2][0] = 0.2;
    const Result<Volume> refused = signed_distance(with_grid(labels, slanted), {}, {});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("perpendicular"), std::string::npos);
}

TEST(SignedDistance, RefusesValuesThatAreNoLabelsAndStops) {
    const Grid grid = make_grid({4, 4, 4}, {1, 1, 1});
    const Volume negative =
        make_volume(grid, ScalarType::i16, [](glm::uvec3 i) { return double(i.x) - 2.0; });
    EXPECT_FALSE(signed_distance(negative, {}, {}));
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(signed_distance(random_labels(grid, 2, 0.5, 1), {}, {stop.get_token(), {}}));
}

} // namespace
} // namespace palpate
