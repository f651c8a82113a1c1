// Nothing passes through a wall, whatever the hand does.

#include "tests/unit/haptics_proxy/walls.h"

#include "haptics/proxy/swept_point.h"

namespace palpate::touch {
namespace {

using glm::dvec3;

// Walls of 1.5 voxels and more at up to 5 m/s, crossed from many directions.
TEST(SweptPoint, PassesThroughNoWallAtAnySpeed) {
    uint64_t ticks = 0;
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm}) {
        const Storage storage{.spacing_mm = spacing};
        for (const TouchCase& wall : touch_cases(storage, true)) {
            if (wall.id != "A7" || wall.name.ends_with("/1voxels"))
                continue;
            const Scene scene = make_scene(wall, storage);
            const haptics::TouchParameters parameters = settings(scene);
            const auto algorithm = haptics::make_swept_point();
            for (const double speed : {100.0, 1000.0, 5000.0})
                for (int turn = 0; turn < 6; ++turn) {
                    TouchCase turned = wall;
                    const double angle = turn;
                    const dvec3 side = glm::cross(wall.normal, wall.along);
                    turned.along = std::cos(angle) * wall.along + std::sin(angle) * side;
                    const Figures f = open_loop(*algorithm, scene,
                                                {.path = crossing(turned, speed, 9.0)}, parameters);
                    ticks += f.ticks;
                    EXPECT_EQ(f.pop_throughs, 0u) << wall.name << " " << speed << " " << turn;
                }
        }
    }
    EXPECT_GT(ticks, 10'000u);
}

// Walls of labels of 1.5 voxels, flat and closed, under a walk with leaps of up to 100 mm. They are
// one sample thick where they are thinnest. The flat one has no rim within reach: see
// kWallReach_mm.
TEST(SweptPoint, PassesThroughNoWallOfLabelsOnLeaps) {
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm}) {
        const Storage storage{.spacing_mm = spacing, .form = Form::labels};
        for (const TouchCase& wall : walls_of(storage)) {
            if (!wall.name.ends_with("/1.5voxels"))
                continue;
            const Scene scene = make_scene(wall, storage);
            const auto algorithm = haptics::make_swept_point();
            Passes found;
            count_passes(*algorithm, scene, walk(wall, 100.0, 8000, 1), wall_settings(scene),
                         found);
            EXPECT_EQ(found.passes, 0u) << wall.name << " at " << spacing.z << " mm";
            EXPECT_EQ(found.not_finite, 0u);
        }
    }
}

} // namespace
} // namespace palpate::touch
