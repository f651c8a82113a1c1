// The counts of the plan: hours of touch. Quick twins are in wall_test.cpp and
// swept_point_test.cpp. PALPATE_TICKS sets another count of ticks.

#include <cstdlib>
#include <string>

#include "tests/unit/haptics_proxy/walls.h"

namespace palpate::touch {
namespace {

using glm::dvec3;

uint64_t setting(const char* name, uint64_t otherwise) {
    const char* value = std::getenv(name);
    return value ? std::stoull(value) : otherwise;
}

// 10^7 ticks of crossings, walks and hands over walls of 1.5 voxels and more, of grey values and of
// labels.
TEST(SweptPointLong, PassesThroughNothingInTenMillionTicks) {
    Passes all;
    for (uint64_t round = 1; all.ticks < setting("PALPATE_TICKS", 10'000'000); ++round)
        for (const dvec3 spacing : {dvec3(0.5), kUneven_mm})
            for (const Form form : {Form::grey_f32, Form::labels}) {
                const Storage storage{.spacing_mm = spacing, .form = form};
                for (const TouchCase& wall : walls_of(storage)) {
                    const Scene scene = make_walled_scene(wall, storage, kNoWayRound_mm);
                    const haptics::TouchParameters parameters = wall_settings(scene);
                    const auto algorithm = haptics::find_algorithm("swept-point")->make();
                    for (const Trajectory& trajectory : trajectories(wall, 20'000, round, true)) {
                        const uint64_t before = all.passes;
                        count_passes(*algorithm, scene, trajectory.path, parameters, all);
                        EXPECT_EQ(all.passes, before)
                            << wall.name << (form == Form::labels ? " of labels at " : " at ")
                            << spacing.z << " mm, " << trajectory.name << ", round " << round
                            << ": from (" << all.from.x << ", " << all.from.y << ", " << all.from.z
                            << ") to (" << all.to.x << ", " << all.to.y << ", " << all.to.z << ")";
                    }
                }
            }
    EXPECT_EQ(all.not_finite, 0u);
    std::printf("    %llu ticks, %llu passes\n", static_cast<unsigned long long>(all.ticks),
                static_cast<unsigned long long>(all.passes));
}

// Every scene, angle, thickness and speed, in both spacings.
TEST(SweptPointLong, WholePlan) {
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm}) {
        const Storage storage{.spacing_mm = spacing};
        for (const TouchCase& body : touch_cases(storage, true)) {
            const Scene scene = make_scene(body, storage);
            const haptics::TouchParameters parameters = settings(scene);
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
