// The repaired sampled tool: held as a sphere against a plane grown by its radius, in grooves and
// through walls; any implicit shape.

#include "haptics/proxy/swept_tool.h"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "engine/edit/shape.h"
#include "engine/volume/builder.h"
#include "haptics/field/field.h"
#include "haptics/field/sphere_samples.h"
#include "haptics/proxy/tool_points.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;
using haptics::Contact;

constexpr double kRadius_mm = 2.5;

haptics::TouchParameters sphere(const Scene& scene, uint32_t samples = 340) {
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.tool_radius_mm = kRadius_mm;
    parameters.tool_samples = samples;
    tune(parameters, *scene.touch.grey);
    return parameters;
}

// The same body as the centre of the ball feels it: grown by its radius.
TouchCase grown(TouchCase body) {
    body.touch_mm += kRadius_mm * body.normal;
    return body;
}

TEST(SweptTool, HoldsAPlaneAtItsRadius) {
    const Scene scene = make_scene(flat_plane(), {});
    for (const uint32_t samples : {340u, 2000u}) {
        const Trace run = run_named("swept-tool", scene, slide(grown(scene.body), 2.0, 3.0, 1.0),
                                    sphere(scene, samples));
        // It touches where it faces the plane, wherever its samples lie: what is left is the
        // spline's error, 0.0136 samples of 0.5 mm (field_test.cpp), and where the way ends.
        const double gap = 0.01;
        double worst = 0.0;
        for (size_t i = 1; i < run.ticks.size(); ++i) {
            const Seen& tick = run.ticks[i];
            EXPECT_GE(tick.proxy.z, 0.13 + kRadius_mm - gap) << i;
            if (tick.tool.z < 0.13 + kRadius_mm - 0.5) {
                EXPECT_NEAR(tick.proxy.z, 0.13 + kRadius_mm, gap);
                worst = std::max(worst, glm::distance(tick.force, run.ticks[i - 1].force) -
                                            glm::distance(tick.tool, run.ticks[i - 1].tool));
            }
        }
        EXPECT_LE(worst, 0.02);
    }
}

// 340 samples lie up to 7 degrees apart from any place of a ball; the normal of the one that
// touches a body as small as itself errs by twice as much.
TEST(SweptTool, ABallTouchesBetweenItsSamples) {
    const TouchCase body{
        .id = "A2", .name = "ball", .solid = ball({0, 0, -3.0}, 3.0), .deepest_mm = 1.5};
    const Scene scene = make_scene(body, {});
    const haptics::TouchParameters parameters = sphere(scene);
    const Trace run =
        run_named("swept-tool", scene, slide(grown(scene.body), 0.75, 3.0, 2.0), parameters);
    // A normal that errs by e on a bulge of radius R turns the force at depth d by e R / (R - d):
    // here by 0.92 degrees, a plane's (field_test.cpp), at 5.5 and 0.75 mm, and a bin of the
    // histogram.
    EXPECT_LE(run.figures.direction_deg.percentile(0.99), 0.92 * 5.5 / 4.75 + 0.05);
    EXPECT_LE(run.figures.penetration_voxels, 0.05);
    EXPECT_LE(run.figures.excess_jump_n, 0.02);
    EXPECT_GT(run.figures.direction_deg.count(), 500u);
}

// Hollows that the ball fits touch it along an arc, or on a patch: contacts that followed the
// surface together would leave the rest of it to nobody. Depth is what is asked on all bodies. A
// step may end 0.1 samples, 0.05 mm, from where all were looked at: 0.05 N at 1 N/mm.
TEST(SweptTool, StaysSpreadOverAHollowThatItFits) {
    for (const TouchCase& body : touch_cases({}, false)) {
        if (body.id != "A4" && body.id != "A6")
            continue;
        const Scene scene = make_scene(body, {});
        haptics::TouchParameters parameters = sphere(scene);
        parameters.tool_radius_mm = 1.5 * voxel_mm({});
        Path path = slide(body, 0.5 * body.deepest_mm, 3.0, 1.5);
        for (dvec3& x : path)
            x += parameters.tool_radius_mm * body.normal;
        const Trace run = run_named("swept-tool", scene, path, parameters);
        EXPECT_LE(run.figures.penetration_voxels, 0.05) << body.name;
        EXPECT_LE(run.figures.excess_jump_n, 0.05) << body.name;
        EXPECT_GT(run.figures.contact_ticks, 1000u) << body.name;
    }
}

// A ball of a groove's own rounding touches it all across, also where its bend ends: there the
// surface's normal turns by 1 / 1.5 a sample on one side and not at all on the other, and a
// Gaussian of s samples, s^2 = 0.36 - 0.49 + 1/3 of the blur and the spline, turns it by 0.4 s
// / 1.5, 6.9 degrees; a lattice by another 0.92 (field_test.cpp).
TEST(SweptTool, FitsAGroove) {
    for (const dvec3 spacing : {dvec3(0.5), kUneven_mm}) {
        const Storage storage{.spacing_mm = spacing};
        for (const TouchCase& body : touch_cases(storage, true)) {
            if (body.id != "A6")
                continue;
            const Scene scene = make_scene(body, storage);
            haptics::TouchParameters parameters = sphere(scene);
            parameters.tool_radius_mm = 1.5 * voxel_mm(storage);
            Path path = slide(body, 0.5 * body.deepest_mm, 3.0, 1.5);
            for (dvec3& x : path)
                x += parameters.tool_radius_mm * body.normal;
            const Trace run = run_named("swept-tool", scene, path, parameters);
            EXPECT_LE(run.figures.direction_deg.percentile(0.99), 6.9 + 0.92) << body.name;
        }
    }
}

TEST(SweptTool, IsPushedOutOfWhateverSpeedPutItIn) {
    const Scene scene = make_scene(flat_plane(), {});
    for (const double speed : {10.0, 1000.0, 2000.0}) {
        const Trace run = run_named("swept-tool", scene, press(grown(scene.body), speed, 6.0, 0.1),
                                    sphere(scene));
        EXPECT_NEAR(run.figures.largest_force_n, 6.0, 0.15) << speed << ": nothing is lost";
        for (const Seen& tick : run.ticks)
            EXPECT_NE(tick.contact, Contact::submerged);
    }
}

// Samples of nothing but noise below z = 0, air above it: no surface, but matter everywhere.
Scene speckle() {
    Scene scene = make_scene(flat_plane(), {});
    std::mt19937 random(1);
    std::vector<float> samples(sample_count(scene.touch.grey->grid()));
    const Grid& grid = scene.touch.grey->grid();
    size_t at = 0;
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t i = 0; i < grid.size.x * grid.size.y; ++i) {
            const float noise = float(random() % 1001);
            samples[at++] =
                (grid.world_from_index * glm::dvec4(0.0, 0.0, z, 1.0)).z < 0.0 ? noise : 0.0f;
        }
    scene.touch.grey = make_volume<float>(grid, samples);
    scene.touch.version = scene.touch.grey->version();
    return scene;
}

// The proxy's own motion gives work to the spring that the hand never did: no more, since the
// start, than the spring holds over half a sample and a twentieth at the deepest. Without its
// account a ball of 4 mm on a circle gives 0.87 mJ, and 0.66 are allowed.
TEST(SweptTool, MakesNoEnergyAmidNoise) {
    const Scene scene = speckle();
    for (const double friction : {0.0, 0.3}) {
        for (Trajectory& path : trajectories(scene.body, 4000, 1, false)) {
            if (path.id != "T3" && path.id != "T4" && path.id != "T5")
                continue;
            haptics::TouchParameters parameters = sphere(scene);
            parameters.tool_radius_mm = 4.0;
            parameters.friction_static = parameters.friction_dynamic = friction;
            for (dvec3& x : path.path)
                x += (parameters.tool_radius_mm - 1.0) * scene.body.normal;
            const Trace run = run_named("swept-tool", scene, path.path, parameters);
            double given_mj = 0.0, most_mj = 0.0, deepest_mm = 0.0;
            for (size_t i = 1; i < run.ticks.size(); ++i) {
                const Seen &now = run.ticks[i], &before = run.ticks[i - 1];
                const double to = glm::distance(now.proxy, now.tool),
                             from = glm::distance(before.proxy, now.tool);
                deepest_mm = std::max({deepest_mm, to, from});
                given_mj += 0.5e-3 * parameters.stiffness_n_per_m * (to * to - from * from);
                most_mj = std::max(most_mj, given_mj);
            }
            const double doubt_mm = 2.0 * (0.025 + 0.25) * 0.5;
            EXPECT_LE(most_mj, 1e-3 * parameters.stiffness_n_per_m * deepest_mm * doubt_mm * 1.001)
                << path.name << ", friction " << friction;
            EXPECT_GT(deepest_mm, 2.0);
        }
    }
}

// Nobody's error: a ball that grows against a hand at rest, and a shape that turns in contact, stay
// where they touch.
TEST(SweptTool, MayGrowAndTurnInContact) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = sphere(scene);
    const auto algorithm = haptics::make_swept_tool();
    haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
    haptics::TickOutput out;
    for (int i = 0; i < 800; ++i) {
        parameters.tool_radius_mm = 1.5 + 0.002 * std::max(0, i - 300);
        input.tool.position_mm = {0.2, 0.1, std::max(-1.0, 4.0 - 0.02 * i)};
        out = algorithm->tick(input);
        if (i > 300) {
            ASSERT_NEAR(out.proxy.position_mm.z, 0.13 + parameters.tool_radius_mm, 0.03) << i;
        }
    }
    EXPECT_NEAR(parameters.tool_radius_mm, 2.5, 0.01);

    haptics::TouchScene with_capsule = scene.touch;
    with_capsule.tool = std::make_shared<const haptics::ToolPoints>(
        haptics::sample_tool(*make_capsule(0.75, 2.0), 1000));
    input.scene = &with_capsule;
    for (int i = 0; i < 1600; ++i) {
        const double turn_rad = std::min(1.2, 0.002 * std::max(0, i - 300));
        // It lies, and then one end goes down.
        input.tool.rotation =
            glm::angleAxis(0.5 * std::numbers::pi + turn_rad, dvec3(0.0, 1.0, 0.0));
        input.tool.position_mm = {0.2, 0.1, std::max(-1.0, 4.0 - 0.02 * i)};
        out = algorithm->tick(input);
        if (i > 300) { // samples are 0.2 mm apart on its round end
            ASSERT_NEAR(out.proxy.position_mm.z, 0.13 + 0.75 + 2.0 * std::sin(turn_rad), 0.06) << i;
        }
    }
}

// Somebody edits far away in every tick: what holds a tool amid noise is held to the same account,
// and one that nothing holds stays free of it.
TEST(SweptTool, EditsElsewhereExchangeNothing) {
    const Scene scene = speckle();
    for (const bool begins_within : {false, true}) {
        haptics::TouchParameters parameters = sphere(scene);
        std::vector<dvec3> proxies[2];
        for (const bool edited : {false, true}) {
            haptics::TouchScene touch = scene.touch;
            const auto algorithm = haptics::make_swept_tool();
            haptics::TickInput input{.scene = &touch, .parameters = &parameters};
            for (int i = 0; i < 1000; ++i) {
                if (edited && i > 0)
                    edit_elsewhere(touch, i);
                input.tool.position_mm = {0.004 * i, 0.1,
                                          begins_within ? -4.0 : std::max(-1.0, 5.0 - 0.02 * i)};
                proxies[edited].push_back(algorithm->tick(input).proxy.position_mm);
            }
        }
        for (size_t i = 0; i < proxies[0].size(); ++i)
            ASSERT_EQ(proxies[0][i], proxies[1][i]) << i;
    }
}

TEST(SweptTool, BegunAmidNoiseNothingIsFeltUntilItIsFree) {
    const Scene scene = speckle();
    haptics::TouchParameters parameters = sphere(scene);
    // From within, about there, out, and back on it.
    Path path;
    for (int i = 0; i < 1000; ++i)
        path.push_back({0.004 * i, std::sin(0.01 * i), -4.0});
    for (int i = 0; i < 1000; ++i)
        path.push_back({4.0, 0.0, -4.0 + 0.012 * i});
    for (int i = 0; i < 500; ++i)
        path.push_back({4.0, 0.0, 8.0 - 0.014 * i});
    const Trace run = run_named("swept-tool", scene, path, parameters);
    bool was_free = false;
    for (size_t i = 1; i < run.ticks.size(); ++i) {
        const Seen& tick = run.ticks[i];
        was_free |= tick.contact == Contact::free;
        if (was_free)
            continue;
        // For 0.1 s it looks for a way out; its force is let go of as after an edit.
        ASSERT_EQ(tick.contact, i < 100 ? Contact::touching : Contact::submerged) << i;
        if (i >= 100) {
            ASSERT_LE(glm::length(tick.force),
                      std::max(0.0, glm::length(run.ticks[i - 1].force) - 0.09 + 0.005))
                << i;
        }
        // No sample of the ball is above the noise's uppermost spacing.
        ASSERT_LT(tick.tool.z, kRadius_mm + 0.5);
    }
    EXPECT_TRUE(was_free);
    EXPECT_EQ(run.ticks.back().contact, Contact::touching);
    EXPECT_GT(run.ticks.back().force.z, 0.3);
}

// A tick's work is bounded: what one cannot do, thrown into rough material it has never seen, the
// next ones do. Within 20 ms at rest no sample is left in material, noise apart.
TEST(SweptTool, CatchesUpAfterALeapIntoRoughMaterial) {
    const Scene scene = make_scene(flat_plane(), {.noise = 0.1});
    const haptics::TouchParameters parameters = sphere(scene);
    auto field = std::make_unique<haptics::Field>();
    field->follow(*scene.touch.grey, parameters);
    haptics::SphereSamples directions;
    for (int trial = 0; trial < 20; ++trial) {
        const auto algorithm = haptics::make_swept_tool();
        haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
        input.tool.position_mm = {0.4 * trial - 4.0, 0.3 * trial - 3.0, 8.0};
        algorithm->reset(input);
        algorithm->tick(input);
        input.tool.position_mm.z = -2.0;
        haptics::TickOutput out;
        for (int i = 0; i < 20; ++i)
            out = algorithm->tick(input);
        // The plane is at 0.13; three standard deviations of the noise move it by half a sample.
        EXPECT_NEAR(out.proxy.position_mm.z, 0.13 + kRadius_mm, 0.25) << trial;
        for (const dvec3& way : directions.directions(parameters.tool_samples))
            EXPECT_LE(field->trilinear(out.proxy.position_mm + kRadius_mm * way), 500.0 + 200.0);
    }
}

TEST(SweptTool, PassesThroughNoWall) {
    for (const double thickness : {0.75, 1.0, 2.0}) {
        const Scene scene = make_scene(flat_wall(thickness), {});
        for (const double speed : {100.0, 1000.0, 5000.0}) {
            const Trace run = run_named("swept-tool", scene,
                                        crossing(grown(scene.body), speed, 8.0), sphere(scene));
            EXPECT_EQ(run.figures.pop_throughs, 0u) << thickness << " " << speed;
        }
    }
}

// A groove narrower than the ball: both sides hold, neither cancels the other.
TEST(SweptTool, HoldsInAGrooveNarrowerThanItself) {
    TouchCase body{.id = "A6", .name = "groove"};
    const std::vector<dvec3> n = wedge_normals(60.0, {0, 0, 1}, {0, 1, 0});
    body.solid = hollow_corner({0, 0, -2.0}, n, 0.75);
    const Scene scene = make_scene(body, {});
    // The ball's centre rests r / sin(30 deg) = 5 mm above the apex.
    TouchCase centre = body;
    centre.touch_mm = {0, 0, -2.0 + 2.0 * kRadius_mm};
    const Path path = press(centre, 20.0, 2.0, 0.2);
    const Trace run = run_named("swept-tool", scene, path, sphere(scene));
    const Seen& deepest = run.ticks[static_cast<size_t>(4.0 / 0.02) + 150];
    EXPECT_NEAR(deepest.force.z, 2.0, 0.2);
    EXPECT_NEAR(deepest.force.x, 0.0, 0.1);
    double worst = 0.0;
    for (size_t i = 1; i < run.ticks.size(); ++i)
        worst = std::max(worst, glm::distance(run.ticks[i].force, run.ticks[i - 1].force) -
                                    glm::distance(run.ticks[i].tool, run.ticks[i - 1].tool));
    EXPECT_LE(worst, 0.1);
}

TEST(SweptTool, FrictionStaysInItsCone) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = sphere(scene);
    parameters.friction_static = parameters.friction_dynamic = 0.4;
    const Trace run =
        run_named("swept-tool", scene, slide(grown(scene.body), 2.0, 3.0, 1.5), parameters);
    double worst = 0.0;
    for (const Seen& tick : run.ticks)
        if (tick.force.z > 0.5)
            worst = std::max(worst, std::hypot(tick.force.x, tick.force.y) / tick.force.z);
    EXPECT_LE(worst, 0.4 * 1.01 + 0.02);
    EXPECT_GE(worst, 0.35);
}

// Leaps of centimetres in a tick, over every wall of the plan's quick form.
TEST(Repaired, PassThroughNoWallOnLeaps) {
    for (const TouchCase& body : touch_cases({}, false)) {
        if (body.id != "A7")
            continue;
        const Scene scene = make_scene(body, {});
        haptics::TouchParameters parameters = sphere(scene);
        parameters.tool_radius_mm = 0.0;
        for (const char* name : {"swept-point", "swept-tool", "swept-local"}) {
            const Trace run = run_named(name, scene, walk(body, 100.0, 1200, 7), parameters);
            EXPECT_EQ(run.figures.pop_throughs, 0u) << name << " " << body.name;
            EXPECT_GT(run.figures.contact_ticks, 50u) << name << " " << body.name;
        }
    }
}

TEST(ToolPoints, LieOnTheShapeAndAllAroundIt) {
    const ShapePtr shapes[] = {make_ball(2.0), make_capsule(1.0, 6.0), make_burr(2.0, 6, 0.4),
                               make_box({2.0, 3.0, 4.0})};
    for (const ShapePtr& shape : shapes) {
        const haptics::ToolPoints made = haptics::sample_tool(*shape, 500);
        ASSERT_EQ(made.points_mm.size(), 500u);
        dvec3 low(INFINITY), high(-INFINITY);
        for (const dvec3 p : made.points_mm) {
            EXPECT_LE(std::abs(shape->signed_mm(p)), 0.02);
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
        const BoxMm box = shape->bounds();
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(low[axis], box.low[axis], 0.5);
            EXPECT_NEAR(high[axis], box.high[axis], 0.5);
        }
    }
}

// A capsule on its tip and on its side: it is held where its shape touches, and leans on its arm.
TEST(SweptTool, AnyShapeIsHeldWhereItTouches) {
    Scene scene = make_scene(flat_plane(), {});
    auto points =
        std::make_shared<haptics::ToolPoints>(haptics::sample_tool(*make_capsule(1.0, 4.0), 800));
    scene.touch.tool = points;
    const haptics::TouchParameters parameters = sphere(scene);
    const auto algorithm = haptics::make_swept_tool();
    haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
    for (const bool lying : {false, true}) {
        // Lying: the tool's +z along world +x.
        input.tool.rotation = lying ? glm::dquat(std::sqrt(0.5), 0.0, std::sqrt(0.5), 0.0)
                                    : glm::dquat(1.0, 0.0, 0.0, 0.0);
        input.tool.position_mm = {0, 0, 4.0};
        algorithm->reset(input);
        haptics::TickOutput out;
        for (int i = 0; i < 400; ++i) {
            input.tool.position_mm.z = std::max(0.5, 4.0 - 0.02 * i);
            out = algorithm->tick(input);
        }
        // The origin is the middle of the lower cap, 1 mm from the surface of the tool.
        EXPECT_NEAR(out.proxy.position_mm.z, 1.13, 0.08) << lying;
        EXPECT_NEAR(out.force_n.z, 0.63, 0.08) << lying;
        EXPECT_LE(std::abs(out.torque_nm.z), 1e-6) << lying;
    }
}

} // namespace
} // namespace palpate::touch
