// The counts of the plan: hours of touch. Quick twins are in wall_test.cpp, repaired_test.cpp and
// swept_point_test.cpp. PALPATE_TICKS sets another count of ticks, PALPATE_ALGORITHM which of the
// repaired algorithms, separated by commas (all four).

#include <cmath>
#include <cstdlib>
#include <string>

#include "haptics/proxy/swept_mesh.h"
#include "tests/unit/haptics_proxy/walls.h"

namespace palpate::touch {
namespace {

using glm::dvec3;

uint64_t setting(const char* name, uint64_t otherwise) {
    const char* value = std::getenv(name);
    return value ? std::stoull(value) : otherwise;
}

// Ticks of crossings, walks and hands over walls of 1.5 voxels and more, of grey values and of
// labels. A tool is a ball of 1.5 voxels, and held against the wall grown by that.
Passes pass_walls(const std::string& name, uint64_t ticks) {
    Passes all;
    for (uint64_t round = 1; all.ticks < ticks; ++round)
        for (const dvec3 spacing : {dvec3(0.5), kUneven_mm})
            for (const Form form : {Form::grey_f32, Form::labels}) {
                const Storage storage{.spacing_mm = spacing, .form = form};
                for (const TouchCase& wall : walls_of(storage)) {
                    Scene scene = make_scene(wall, storage);
                    haptics::TouchParameters parameters = wall_settings(scene);
                    if (name == "swept-mesh") {
                        const Volume& felt =
                            form == Form::labels ? *scene.touch.labels : *scene.touch.grey;
                        scene.touch.touch_mesh = haptics::make_touch_mesh(
                            std::make_shared<Mesh>(haptics::touch_surface(felt, parameters)),
                            0.5 * std::cbrt(spacing.x * spacing.y * spacing.z));
                    }
                    if (name == "swept-tool")
                        parameters.tool_radius_mm = 1.5 * voxel_mm(storage);
                    scene.body.solid = grown(wall.solid, parameters.tool_radius_mm);
                    const auto algorithm = haptics::find_algorithm(name)->make();
                    for (Trajectory trajectory : trajectories(wall, 20'000, round, true)) {
                        for (dvec3& x : trajectory.path)
                            x += parameters.tool_radius_mm * wall.normal;
                        const uint64_t before = all.passes;
                        count_passes(*algorithm, scene, trajectory.path, parameters, all);
                        EXPECT_EQ(all.passes, before)
                            << name << ", " << wall.name
                            << (form == Form::labels ? " of labels at " : " at ") << spacing.z
                            << " mm, " << trajectory.name << ", round " << round << ": from ("
                            << all.from.x << ", " << all.from.y << ", " << all.from.z << ") to ("
                            << all.to.x << ", " << all.to.y << ", " << all.to.z << ")";
                    }
                    if (all.ticks >= ticks)
                        return all;
                }
            }
    return all;
}

TEST(RepairedLong, PassThroughNothingInTenMillionTicks) {
    const char* asked = std::getenv("PALPATE_ALGORITHM");
    const std::string names =
        std::string(asked ? asked : "swept-point,swept-tool,swept-local,swept-mesh") + ",";
    for (size_t begin = 0, end; (end = names.find(',', begin)) != std::string::npos;
         begin = end + 1) {
        const std::string name = names.substr(begin, end - begin);
        ASSERT_NE(haptics::find_algorithm(name), nullptr) << name;
        const Passes all = pass_walls(name, setting("PALPATE_TICKS", 10'000'000));
        EXPECT_EQ(all.not_finite, 0u) << name;
        std::printf("    %s: %llu ticks, %llu passes\n", name.c_str(),
                    static_cast<unsigned long long>(all.ticks),
                    static_cast<unsigned long long>(all.passes));
        std::fflush(stdout);
    }
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
