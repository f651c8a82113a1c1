#include <gtest/gtest.h>

#include "engine/volume/builder.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/servo/force_fade.h"

namespace palpate::haptics {
namespace {

constexpr double kDrag_n_s_per_m = 2.0;
const glm::dvec3 kVelocity_mm_per_s(30.0, -40.0, 120.0);

// Solid below z = 0.
TouchScene floor_scene() {
    const Grid grid = make_grid({24, 24, 24}, glm::dvec3(1.0), glm::dvec3(-11.5));
    TouchScene scene;
    scene.grey = make_volume(grid, ScalarType::f32, [](glm::uvec3 at) {
        return glm::clamp(12.0 - static_cast<double>(at.z), 0.0, 1.0);
    });
    return scene;
}

glm::dvec3 force_n(const char* algorithm, double drag_n_s_per_m, double z_mm) {
    const TouchScene scene = floor_scene();
    TouchParameters parameters;
    parameters.air_drag_n_s_per_m = drag_n_s_per_m;
    const std::unique_ptr<Algorithm> touch = find_algorithm(algorithm)->make();
    TickInput input{.scene = &scene, .parameters = &parameters};
    input.tool.position_mm.z = 4.0;
    touch->reset(input);
    TickOutput output;
    for (; input.tool.position_mm.z > z_mm; input.tool.position_mm.z -= 0.1)
        output = touch->tick(input);
    input.velocity_mm_per_s = kVelocity_mm_per_s;
    return touch->tick(input).force_n;
}

// A force of its own, -b v, in free space as on a surface: all else is as without it. Sums of
// forces below 10 N are rounded by less than 1e-14 N.
TEST(AirDrag, HoldsTheHandBackInProportionToItsSpeedWhereverItIs) {
    const glm::dvec3 expected_n = -1e-3 * kDrag_n_s_per_m * kVelocity_mm_per_s;
    for (const char* algorithm : {"swept-point", "swept-tool", "swept-local"})
        for (const double z_mm : {2.0, -1.0}) {
            const glm::dvec3 plain_n = force_n(algorithm, 0.0, z_mm),
                             dragged_n = force_n(algorithm, kDrag_n_s_per_m, z_mm);
            EXPECT_EQ(glm::length(plain_n) > 0.0, z_mm < 0.0) << algorithm;
            EXPECT_LT(glm::distance(dragged_n - plain_n, expected_n), 1e-14) << algorithm;
        }
}

// The servo lets a force change by what the hand itself did, so drag has to count there.
TEST(AirDrag, IsAChangeThatTheHandMakes) {
    TouchParameters parameters;
    const double without_n = natural_change_n(parameters, 0.5, 20.0, 0.0);
    parameters.air_drag_n_s_per_m = kDrag_n_s_per_m;
    EXPECT_NEAR(natural_change_n(parameters, 0.5, 20.0, 0.0) - without_n, 0.04, 1e-15);
}

} // namespace
} // namespace palpate::haptics
