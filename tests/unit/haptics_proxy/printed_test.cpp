// The algorithms as printed do what their papers say, and fail as documented. What fails here is
// what the repaired algorithms are for; a test that no longer fails means a print was "improved".

#include <cmath>

#include "engine/volume/builder.h"
#include "haptics/papers/papers.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;
using haptics::Contact;

double largest_drop(const Trace& run) {
    double drop = 0.0;
    for (size_t i = 1; i < run.ticks.size(); ++i)
        drop = std::max(drop, glm::distance(run.ticks[i].force, run.ticks[i - 1].force));
    return drop;
}

// ---- rules ----------------------------------------------------------------------------------

TEST(MotionRules, AreThoseOfThePrint) {
    using namespace haptics;
    EXPECT_EQ(unilateral(0.5, 2.0), 0.5);   // outwards: free
    EXPECT_EQ(unilateral(-1.5, 2.0), 0.0);  // held below the threshold
    EXPECT_EQ(unilateral(-3.0, 2.0), -1.0); // yields the rest
    EXPECT_EQ(bilateral(3.0, 2.0), 1.0);
    EXPECT_EQ(bilateral(-3.0, 2.0), -1.0);
    EXPECT_EQ(bilateral(1.0, 2.0), 0.0);
    EXPECT_EQ(directed(-1.0, 2.0), 1.0);
    // At rest the directed rule holds the proxy s / k ahead of the tool: a force of +s.
    EXPECT_EQ(directed(-2.0, 2.0), 0.0);
}

TEST(MotionRules, PrintedSignPushesOutwards) {
    EXPECT_EQ(haptics::unilateral_as_printed(-3.0, 2.0), 1.0);
    EXPECT_EQ(haptics::unilateral_as_printed(-3.0, 2.0), -haptics::unilateral(-3.0, 2.0));
}

TEST(HapticTransfer, SigmoidAndTable) {
    haptics::HapticTransfer sigmoid{.strength_n = 2.0, .center = 300.0, .width = 50.0};
    EXPECT_DOUBLE_EQ(strength_n(sigmoid, 300.0), 1.0);
    EXPECT_DOUBLE_EQ(strength_n(sigmoid, 350.0), 2.0 / (1.0 + std::exp(-1.0)));
    EXPECT_EQ(strength_n(sigmoid, 1e6), 2.0);
    EXPECT_EQ(strength_n(sigmoid, -1e6), 0.0);
    haptics::HapticTransfer table{.point_count = 3};
    table.values = {0.0, 100.0, 300.0};
    table.forces_n = {1.0, 2.0, 0.0};
    EXPECT_EQ(strength_n(table, -5.0), 1.0);
    EXPECT_EQ(strength_n(table, 50.0), 1.5);
    EXPECT_EQ(strength_n(table, 200.0), 1.0);
    EXPECT_EQ(strength_n(table, 900.0), 0.0);
}

// ---- Eriksson 2006 ----------------------------------------------------------------------------

TEST(Eriksson2006, HoldsAPlaneWithASpring) {
    const Scene scene = make_scene(flat_plane(), {});
    const Trace run = run_named("eriksson-2006", scene, press(scene.body, 20.0, 3.0, 0.1),
                                scene_parameters(scene));
    double deepest = 0.0;
    for (const Seen& tick : run.ticks)
        deepest = std::max(deepest, tick.force.z);
    // k times depth, with the proxy within 0.1 voxel of the surface
    EXPECT_NEAR(deepest, 3.0, 0.05);
}

TEST(Eriksson2006, PopsThroughAWallAtStiffnessTimesThickness) {
    for (const double thickness : {1.0, 2.0, 4.0}) {
        const Scene scene = make_scene(flat_wall(thickness), {});
        const Trace run = run_named("eriksson-2006", scene, press(scene.body, 20.0, 8.0, 0.1),
                                    scene_parameters(scene));
        EXPECT_GE(run.figures.pop_throughs, 1u) << thickness;
        // It held up to the back of the wall: k = 1 N/mm; a tick moves 0.02 mm, samples are
        // 0.5 mm apart and the stored wall is within 0.1 of them.
        EXPECT_NEAR(run.figures.largest_force_n, thickness, 0.08) << thickness;
        EXPECT_GT(largest_drop(run), 0.9 * thickness) << "in one tick";
    }
}

// Touch is that of the tool's middle, which is a radius deep by then.
TEST(Eriksson2006, JumpsByStiffnessTimesRadiusAtFirstTouch) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = scene_parameters(scene); // 1 N/mm
    parameters.tool_radius_mm = 2.0;
    const Trace run =
        run_named("eriksson-2006", scene, press(scene.body, 20.0, 1.0, 0.1), parameters);
    double largest = 0.0;
    for (size_t i = 1; i < run.ticks.size(); ++i)
        largest = std::max(largest, run.ticks[i].force.z - run.ticks[i - 1].force.z);
    // A tick moves 0.02 mm, the surface lies within 0.05 mm.
    EXPECT_NEAR(largest, 2.0, 0.08);
}

// Along +n from within material the print looks for the surface where it is not: the proxy goes
// deeper by the whole search, 20 steps of 0.1 samples, in each tick that the tool is in material.
TEST(Eriksson2006, LiteralSignSearchesTheSurfaceDeeper) {
    const Scene scene = make_scene(flat_plane(), {});
    const Path path = press(scene.body, 20.0, 1.0, 0.1);
    const auto deepest = [&](const char* name) {
        double least = INFINITY;
        for (const Seen& tick : run_named(name, scene, path, scene_parameters(scene)).ticks)
            least = std::min(least, tick.proxy.z);
        return least;
    };
    EXPECT_GT(deepest("eriksson-2006"), 0.13 - 0.1);
    EXPECT_LT(deepest("eriksson-2006-literal"), 0.13 - 0.9);
}

TEST(Eriksson2006, FrictionHoldsTheProxyWithinItsCone) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.friction_dynamic = 0.3;
    const Trace run =
        run_named("eriksson-2006", scene, slide(scene.body, 2.0, 3.0, 2.0), parameters);
    double worst = 0.0;
    for (const Seen& tick : run.ticks)
        if (tick.force.z > 1.0)
            worst = std::max(worst, std::hypot(tick.force.x, tick.force.y) / tick.force.z);
    EXPECT_LE(worst, 0.3 * 1.05);
    EXPECT_GE(worst, 0.28);
}

TEST(Eriksson2006, WhiteVibrationOnlyWhileRemoving) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.vibration_n = 0.2;
    const auto algorithm = haptics::make_eriksson_2006();
    haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
    input.tool.position_mm = {0, 0, -1.0};
    const auto force = [&](bool removing) {
        input.removal = removing ? 1.0 : 0.0;
        return algorithm->tick(input).force_n;
    };
    for (int i = 0; i < 50; ++i)
        force(false);
    EXPECT_LE(glm::distance(force(false), force(false)), 1e-9);
    // White: neighbours are uncorrelated. The standard error of 4000 products of uniform numbers of
    // variance 1/3 is 1 / sqrt(4000) of the variance; 5 of them.
    double product = 0.0, square = 0.0, last = 0.0;
    const double rest = force(false).x;
    for (int i = 0; i < 4000; ++i) {
        const double x = force(true).x - rest;
        ASSERT_LE(std::abs(x), 0.2 + 1e-9);
        product += x * last;
        square += x * x;
        last = x;
    }
    EXPECT_NEAR(square / 4000.0, 0.04 / 3.0, 0.04 / 3.0 * 0.1);
    EXPECT_LE(std::abs(product / square), 5.0 / std::sqrt(4000.0));
}

// ---- Vidholm & Agmund 2004 --------------------------------------------------------------------

Scene label_plane() {
    return make_scene(flat_plane(), {.form = Form::labels});
}

haptics::TouchParameters sphere_tool(const Scene& scene) {
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.source = haptics::TouchSource::labels;
    parameters.tool_radius_mm = 2.5;
    parameters.tool_samples = 340;
    return parameters;
}

// A tool of radius r first touches r above the surface.
Path press_sphere(const Scene& scene, double speed, double depth) {
    TouchCase raised = scene.body;
    raised.touch_mm += 2.5 * raised.normal;
    return press(raised, speed, depth, 0.1);
}

TEST(Vidholm2004, HoldsALabelWithASphere) {
    const Scene scene = label_plane();
    const Trace run =
        run_named("vidholm-2004", scene, press_sphere(scene, 10.0, 2.0), sphere_tool(scene));
    double most = 0.0;
    for (const Seen& tick : run.ticks)
        most = std::max(most, tick.force.z);
    EXPECT_NEAR(most, 2.0, 0.3); // within a voxel: labels have no surface between samples
}

TEST(Vidholm2004, EmbedsAsFarAsATickMovesAndStaysThere) {
    const Scene scene = label_plane();
    const auto embedded = [&](double speed) {
        const Trace run =
            run_named("vidholm-2004", scene, press_sphere(scene, speed, 2.0), sphere_tool(scene));
        // The proxy while the hand rests, deepest in: below where it should be held.
        double lowest = INFINITY;
        for (const Seen& tick : run.ticks)
            lowest = std::min(lowest, tick.proxy.z);
        return scene.body.touch_mm.z + 2.5 - lowest;
    };
    // One tick at v moves v T; the lattice of labels adds up to a voxel (0.5 mm).
    EXPECT_LE(embedded(10.0), 0.5);
    EXPECT_GE(embedded(1000.0), 0.4);
    EXPECT_LE(embedded(1000.0), 1.5);
    EXPECT_GE(embedded(2000.0), embedded(10.0) + 0.4);
}

TEST(Vidholm2004, LosesItsNormalWhenSubmerged) {
    const Scene scene = label_plane();
    haptics::TouchParameters parameters = sphere_tool(scene);
    parameters.yield_n = 3.0; // it is pushed in until all its samples are inside
    const Trace run = run_named("vidholm-2004", scene, press_sphere(scene, 20.0, 9.0), parameters);
    bool submerged = false;
    double before = 0.0, after = INFINITY;
    for (const Seen& tick : run.ticks) {
        if (tick.contact == Contact::submerged) {
            submerged = true;
            after = std::min(after, tick.force.z);
        } else if (!submerged) {
            before = std::max(before, tick.force.z);
        }
    }
    EXPECT_TRUE(submerged);
    EXPECT_NEAR(before, 3.0, 0.2);
    EXPECT_LT(after, 1.0); // the normal is that of rounding: no force holds the hand any longer
}

// ---- WISH 2008 --------------------------------------------------------------------------------

TEST(Wish2008, SurfaceHoldsUpToItsStrength) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = scene_parameters(scene);
    // In the soft edge of the plane the proxy finds a gradient; strength 1.5 N everywhere.
    parameters.transfer[0] = {.strength_n = 1.5};
    const Trace run =
        run_named("wish-2008-surface", scene, press(scene.body, 5.0, 3.0, 0.2), parameters);
    EXPECT_NEAR(run.figures.largest_force_n, 1.5, 0.05);
}

TEST(Wish2008, LiteralSignMovesTheProxyOutInsteadOfYielding) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.transfer[0] = {.strength_n = 0.5};
    const Path path = press(scene.body, 5.0, 2.0, 0.2);
    const Trace meant = run_named("wish-2008-surface", scene, path, parameters);
    const Trace literal = run_named("wish-2008-surface-literal", scene, path, parameters);
    EXPECT_LE(meant.figures.largest_force_n, 0.55);
    // Pushed beyond its strength the constraint throws the proxy out: more force than it allows.
    EXPECT_GT(literal.figures.largest_force_n, 0.7);
}

TEST(Wish2008, ViscosityDragsOnEveryAxis) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = scene_parameters(scene);
    for (haptics::HapticTransfer& axis : parameters.transfer)
        axis = {.strength_n = 0.4};
    // Along the surface, within its edge, where there is a gradient.
    TouchCase low = scene.body;
    low.touch_mm.z -= 0.05;
    Path path;
    for (int i = 0; i < 500; ++i)
        path.push_back(low.touch_mm + dvec3(0.01 * i, 0, 0));
    const Trace run = run_named("wish-2008-viscosity", scene, path, parameters);
    EXPECT_NEAR(run.ticks.back().force.x, -0.4, 0.01);
    EXPECT_NEAR(run.ticks.back().force.y, 0.0, 0.01);
}

// A vector field (1, 2, 2) / 3 everywhere: a constant force of the strength along it.
TEST(Wish2008, VectorModeIsAConstantForceAlongTheField) {
    Scene scene = make_scene(flat_plane(), {});
    const Grid grid = scene.touch.grey->grid();
    const dvec3 direction = dvec3(1, 2, 2) / 3.0;
    for (int axis = 0; axis < 3; ++axis)
        scene.touch.field[static_cast<size_t>(axis)] =
            make_volume(grid, ScalarType::f32, [=](glm::uvec3) { return direction[axis]; });
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.transfer[0] = {.strength_n = 0.8};
    Path path;
    for (int i = 0; i < 100; ++i)
        path.push_back({0.02 * i, 0.01 * i, 3.0});
    const Trace run = run_named("wish-2008-vector", scene, path, parameters);
    EXPECT_LE(glm::distance(run.ticks.back().force, 0.8 * direction), 1e-6);
}

TEST(Wish2008, PotentialModePullsAlongTheGradient) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.transfer[0] = {.strength_n = 0.3};
    const Trace run =
        run_named("wish-2008-potential", scene, Path(50, scene.body.touch_mm), parameters);
    EXPECT_LE(glm::distance(run.ticks[1].force, dvec3(0, 0, -0.3)), 0.02);
}

} // namespace
} // namespace palpate::touch
