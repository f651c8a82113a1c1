// The counts of the plan: hours of touch. Quick twins are in swept_point_test.cpp.

#include <random>

#include "engine/volume/builder.h"
#include "haptics/proxy/field.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;

// 10^7 ticks of crossings, walks and hands over walls of 1.5 voxels and more.
TEST(SweptPointLong, PassesThroughNothingInTenMillionTicks) {
    uint64_t ticks = 0, popped = 0, bad = 0;
    for (uint64_t round = 1; ticks < 10'000'000; ++round)
        for (const dvec3 spacing : {dvec3(0.5), kUneven_mm}) {
            const Storage storage{.spacing_mm = spacing};
            for (const TouchCase& wall : touch_cases(storage, true)) {
                if (wall.id != "A7" || wall.name.ends_with("/1voxels"))
                    continue;
                const Scene scene = make_scene(wall, storage);
                haptics::TouchParameters parameters = scene_parameters(scene);
                tune(parameters, *scene.touch.grey);
                const auto algorithm = haptics::find_algorithm("swept-point")->make();
                for (const Trajectory& trajectory : trajectories(wall, 20'000, round, true)) {
                    const Figures f = open_loop(*algorithm, scene, trajectory, parameters);
                    ticks += f.ticks;
                    popped += f.pop_throughs;
                    bad += f.not_finite;
                    EXPECT_EQ(f.pop_throughs, 0u) << wall.name << " " << trajectory.name;
                }
            }
        }
    EXPECT_EQ(popped, 0u);
    EXPECT_EQ(bad, 0u);
    std::printf("    %llu ticks\n", static_cast<unsigned long long>(ticks));
}

// Every scene, angle, thickness and speed, in both spacings.
TEST(SweptPointLong, WholePlan) {
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm}) {
        const Storage storage{.spacing_mm = spacing};
        for (const TouchCase& body : touch_cases(storage, true)) {
            const Scene scene = make_scene(body, storage);
            haptics::TouchParameters parameters = scene_parameters(scene);
            tune(parameters, *scene.touch.grey);
            for (const Trajectory& trajectory : trajectories(body, 8000, 1, true)) {
                const auto algorithm = haptics::find_algorithm("swept-point")->make();
                const Figures f = open_loop(*algorithm, scene, trajectory, parameters);
                const std::string where = body.name + " " + trajectory.name;
                if (body.name.find("/1voxels") == std::string::npos) {
                    EXPECT_EQ(f.pop_throughs, 0u) << where;
                }
                EXPECT_EQ(f.not_finite, 0u) << where;
                EXPECT_LE(f.excess_jump_n, body.noise > 0.05 ? 0.10 : 0.02) << where;
            }
        }
    }
}

} // namespace
} // namespace palpate::touch
