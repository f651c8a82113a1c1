#include "engine/segment/seed_places.h"

#include <gtest/gtest.h>

#include "engine/segment/seed_values.h"
#include "engine/volume/builder.h"

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

} // namespace
} // namespace palpate
