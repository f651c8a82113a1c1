#include "engine/segment/seed_places.h"

#include <gtest/gtest.h>

#include "engine/segment/label_samples.h"
#include "engine/segment/seed_values.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "tests/unit/segment/seeded_shapes.h"

namespace palpate {
namespace {

// 20 samples each of 100, 60 and 0 along x.
Volume three_values() {
    return make_volume(make_grid({60, 24, 24}, {1, 1, 1}), ScalarType::f32, [](glm::uvec3 i) {
        return i.x < 20 ? 100.0 : i.x < 40 ? 60.0 : 0.0;
    });
}

Volume map_of(const Volume& volume, std::span<const SeedBall> balls) {
    return make_volume(volume.grid(), ScalarType::u8, [&](glm::uvec3 i) {
        for (const SeedBall& ball : balls)
            if (glm::distance(world_point(volume.grid(), glm::dvec3(i)), ball.center_mm) <=
                ball.radius_mm)
                return 1.0;
        return 0.0;
    });
}

// (1 2 1) / 4 along each axis.
Volume smoothed(const Volume& volume) {
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1;
    return make_volume(volume.grid(), ScalarType::f32, [&](glm::uvec3 at) {
        double sum = 0.0;
        for (int i = 0; i < 27; ++i) {
            const glm::ivec3 step = glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1;
            const glm::ivec3 to = glm::clamp(glm::ivec3(at) + step, glm::ivec3(0), last);
            const glm::ivec3 weight = 2 - glm::abs(step);
            sum += weight.x * weight.y * weight.z / 64.0 * double{volume.value(glm::uvec3(to))};
        }
        return sum;
    });
}

SeedValues values_of(std::span<const SeedBall> balls) {
    const Volume volume = three_values();
    const Volume settled = settled_seeds(volume, volume, map_of(volume, balls), 1, balls);
    const std::vector<SeedValues> values = seed_values(volume, settled);
    EXPECT_EQ(values.size(), 1u);
    return values.at(0);
}

TEST(SettledSeeds, BallsOfTwoKindsCountAlike) {
    const SeedBall balls[] = {{1, {10, 12, 12}, 4}, {1, {30, 12, 12}, 4}};
    const SeedValues values = values_of(balls);
    EXPECT_DOUBLE_EQ(values.mean, 80.0);
    EXPECT_DOUBLE_EQ(values.sd, 20.0);
}

TEST(SettledSeeds, ABallOverAnEdgeIsOfItsCentresKind) {
    for (const double x : {38.0, 37.0, 36.0}) { // the edge lies at 39.5
        const SeedBall ball[] = {{1, {x, 12, 12}, 4}};
        EXPECT_DOUBLE_EQ(values_of(ball).mean, 60.0) << x;
    }
}

TEST(SettledSeeds, SeedsInNoBallAreOfTheMoreFrequentKind) {
    const Volume volume = three_values();
    const SeedBall ball[] = {{1, {37, 12, 12}, 4}};
    const Volume settled = settled_seeds(volume, volume, map_of(volume, ball), 1, {});
    EXPECT_DOUBLE_EQ(seed_values(volume, settled).at(0).mean, 60.0);
}

// With noise of 5 % a value lies ten standard deviations from the middle of both sides, so that
// none of two thousand seeds, one at each sample of a shell of few samples, is settled outside.
TEST(SettledSeeds, ASeedGoesToTheSideThatItsValueIsOf) {
    const seeded::Case shell =
        seeded::make_case(seeded::Shape::shell, 8.0, {0.8, 0.8, 2.4}, 0.05, 0.0, 31);
    const Volume smooth = smoothed(shell.volume);
    const Volume none = make_volume(smooth.grid(), ScalarType::u8, [](glm::uvec3) { return 0.0; });
    int outside = 0;
    for_each_of_label(shell.truth, 1, [&](glm::ivec3 at) {
        VolumeEdit edit(none);
        edit.set(glm::uvec3(at), 1.0f);
        const Volume settled = settled_seeds(shell.volume, smooth, edit.commit(), 1, {});
        for_each_of_label(settled, 1, [&](glm::ivec3 to) {
            outside += shell.truth.value(glm::uvec3(to)) != 1.0f;
        });
    });
    EXPECT_EQ(outside, 0);
}

} // namespace
} // namespace palpate
