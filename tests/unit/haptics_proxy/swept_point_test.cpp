// The repaired point proxy against closed forms: what the issue of touch promises.

#include "haptics/proxy/swept_point.h"

#include <cmath>
#include <random>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "haptics/proxy/effects.h"
#include "haptics/proxy/field.h"
#include "haptics/proxy/planes.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;
using haptics::Contact;

haptics::TouchParameters settings(const Scene& scene) {
    haptics::TouchParameters parameters = scene_parameters(scene);
    tune(parameters, *scene.touch.grey);
    return parameters;
}

// ---- the quadratic program ----------------------------------------------------------------------

TEST(Planes, ProjectionIsTheNearestOfAllSubsets) {
    std::mt19937_64 random(1);
    const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1.0; };
    int active_three = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        std::vector<haptics::Plane> planes(1 + static_cast<size_t>(trial) % 9);
        for (haptics::Plane& plane : planes) // the origin is free, so there is an answer
            plane = {glm::normalize(dvec3(unit(), unit(), unit())), -std::abs(unit())};
        const dvec3 goal = 3.0 * dvec3(unit(), unit(), unit());
        const haptics::Projection found = project_to_planes(goal, planes);
        ASSERT_TRUE(found.is_feasible);
        active_three += found.active_count == 3;
        for (const haptics::Plane& plane : planes)
            ASSERT_GE(glm::dot(plane.normal, found.point), plane.offset - 1e-8);
        // Every feasible corner, edge and face of up to three planes, by Cramer's rule.
        double best = INFINITY;
        const auto offer = [&](dvec3 p) {
            for (const haptics::Plane& plane : planes)
                if (glm::dot(plane.normal, p) < plane.offset - 1e-7)
                    return;
            best = std::min(best, glm::distance(p, goal));
        };
        offer(goal);
        for (const auto& a : planes) {
            offer(goal - (glm::dot(a.normal, goal) - a.offset) * a.normal);
            for (const auto& b : planes) {
                const dvec3 line = glm::cross(a.normal, b.normal);
                if (glm::length(line) < 1e-6)
                    continue;
                const glm::dmat3 m = glm::transpose(glm::dmat3(a.normal, b.normal, line));
                offer(glm::inverse(m) * dvec3(a.offset, b.offset, glm::dot(line, goal)));
                for (const auto& c : planes)
                    if (std::abs(glm::dot(line, c.normal)) > 1e-5)
                        offer(
                            glm::inverse(glm::transpose(glm::dmat3(a.normal, b.normal, c.normal))) *
                            dvec3(a.offset, b.offset, c.offset));
            }
        }
        ASSERT_NEAR(glm::distance(found.point, goal), best, 1e-6) << trial;
    }
    EXPECT_GT(active_three, 50);
}

TEST(Planes, SaysWhenNothingIsFree) {
    const std::vector<haptics::Plane> planes{{{1, 0, 0}, 1.0}, {{-1, 0, 0}, 1.0}};
    EXPECT_FALSE(project_to_planes(dvec3(0.0), planes).is_feasible);
}

// ---- the gates ----------------------------------------------------------------------------------

struct Gate {
    const char* name;
    Storage storage;
    size_t ticks;
};

class SweptPointGates : public testing::TestWithParam<size_t> {};

const std::vector<Gate>& gates() {
    static const std::vector<Gate> all{
        {"even_f32", {}, 600},
        {"even_i16", {.form = Form::grey_i16}, 300},
        {"uneven_f32", {.spacing_mm = kUneven_mm}, 600},
        {"uneven_i16", {.spacing_mm = kUneven_mm, .form = Form::grey_i16}, 300},
    };
    return all;
}

// Over the scenes and trajectories of the plan: nothing is passed through, nothing is sunk into,
// forces point the right way and do not jump.
TEST_P(SweptPointGates, HoldOverScenesAndTrajectories) {
    const Gate& gate = gates()[GetParam()];
    const bool uneven = gate.storage.spacing_mm != dvec3(0.5);
    for (const TouchCase& body : touch_cases(gate.storage, false)) {
        if (gate.storage.form == Form::grey_i16 && body.noise > 0.0)
            continue; // noise rounds away what integers do
        const Scene scene = make_scene(body, gate.storage);
        const haptics::TouchParameters parameters = settings(scene);
        for (const Trajectory& trajectory : trajectories(body, gate.ticks, 1, false)) {
            const auto algorithm = haptics::make_swept_point();
            const Figures f = open_loop(*algorithm, scene, trajectory, parameters);
            const std::string where = body.name + " " + trajectory.name;
            EXPECT_EQ(f.pop_throughs, 0u) << where;
            EXPECT_EQ(f.not_finite, 0u) << where;
            if (body.noise == 0.0 && body.id <= "A6") {
                EXPECT_LE(f.penetration_voxels, 0.05) << where;
            }
            if (body.noise == 0.05) {
                EXPECT_LE(f.penetration_voxels, 0.25) << where;
            }
            EXPECT_LE(f.excess_jump_n, body.noise > 0.05 ? 0.10 : 0.02) << where;
            // Directions: A1 - A3. A cavity or ball of 3 mm is 2.5 of the coarse samples and its
            // normals are not in the data.
            const bool coarse = uneven && body.name.find("/3mm") != std::string::npos;
            if ((body.id == "A1" || body.id == "A2" || body.id == "A3") && !coarse) {
                EXPECT_LE(f.direction_deg.percentile(0.99), 1.5) << where;
            }
            // Corners and grooves are rounded by 1.5 samples: where flat becomes round, curvature
            // jumps by 0.67 a sample, and a spline's slope errs by a share of that. The best that
            // any of seven interpolations does there is 2.3 to 6 degrees (p99 of normals,
            // measured); a normal that errs by e on a round hollow of radius R turns the force at
            // depth d by e R / (R + d), and 0.2 mm is the least depth that is judged, 0.75 mm the
            // radius.
            if (body.id == "A4" || body.id == "A6") {
                EXPECT_LE(f.direction_deg.percentile(0.99), 6.0 * 0.75 / 0.95) << where;
            }
            if (body.id == "A10" && !coarse) {
                EXPECT_LE(f.direction_deg.percentile(0.99), 6.0) << where;
            }
            if (body.id <= "A3" && body.id != "A10") {
                EXPECT_LE(f.magnitude_share.percentile(1.0), 0.02) << where;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Storages, SweptPointGates, testing::Range<size_t>(0, 4),
                         [](const auto& test) { return gates()[test.param].name; });

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

// ---- energy -------------------------------------------------------------------------------------

TEST(SweptPoint, GeneratesTheEnergyOfTheHeldSpringAndNoMore) {
    const Scene scene = make_scene(flat_plane(), {});
    for (const double speed : {20.0, 200.0}) {
        const Trace run =
            run_named("swept-point", scene, press(scene.body, speed, 5.0, 0.05), settings(scene));
        const double expected = speed * kTick_s * 5.0; // k = 1 N/mm
        EXPECT_NEAR(run.figures.energy_mj, expected, 0.01 * expected);
    }
}

// ---- friction -----------------------------------------------------------------------------------

TEST(SweptPoint, FrictionStaysInItsConeAndSticksWithoutDrift) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = settings(scene);
    parameters.friction_static = 0.5;
    parameters.friction_dynamic = 0.3;
    const Trace run = run_named("swept-point", scene, slide(scene.body, 2.0, 3.0, 2.0), parameters);
    double worst = 0.0, sliding = 0.0;
    bool was_moving = false;
    for (size_t i = 1; i < run.ticks.size(); ++i) {
        const Seen& tick = run.ticks[i];
        if (tick.force.z < 0.5)
            continue;
        const double share = std::hypot(tick.force.x, tick.force.y) / tick.force.z;
        worst = std::max(worst, share);
        const bool moves = glm::distance(tick.proxy, run.ticks[i - 1].proxy) > 1e-3;
        if (moves && was_moving) // the tick that comes loose is still held by the static one
            sliding = std::max(sliding, share);
        was_moving = moves;
    }
    EXPECT_LE(worst, 0.5 * 1.01);
    EXPECT_GE(worst, 0.4);
    EXPECT_LE(sliding, 0.3 * 1.01 + 0.01); // one tick of motion is 0.01 mm of 2

    // Pressed at 2 mm and drawn aside by 0.5 mm, a quarter of the depth: it sticks. 1 um/s is 1e-3
    // mm in a second.
    Path path = press(scene.body, 20.0, 2.0, 0.0);
    path.resize(path.size() / 2);
    const dvec3 start = path.back();
    for (int i = 0; i < 1200; ++i)
        path.push_back(start + dvec3(std::min(0.5, 0.005 * i), 0, 0));
    const Trace stuck = run_named("swept-point", scene, path, parameters);
    const dvec3 early = stuck.ticks[stuck.ticks.size() - 1001].proxy;
    EXPECT_LE(glm::distance(stuck.ticks.back().proxy, early), 1e-3);
    EXPECT_NEAR(stuck.ticks.back().force.x, -0.5, 0.01);
}

// ---- yielding -----------------------------------------------------------------------------------

TEST(SweptPoint, YieldsAtT0AndNeverBelow) {
    const Scene scene = make_scene(flat_plane(), {});
    for (const double t0 : {1.0, 3.0}) {
        haptics::TouchParameters parameters = settings(scene);
        parameters.yield_n = t0;
        const Trace run =
            run_named("swept-point", scene, press(scene.body, 5.0, 6.0, 0.2), parameters);
        EXPECT_NEAR(run.figures.largest_force_n, t0, 0.03 * t0 + 0.05); // 10 ms of 5 N/s
        for (const Seen& tick : run.ticks)
            if (tick.contact == Contact::yielding) {
                EXPECT_GE(tick.force.z, -1e-9) << "a tool that retreats is not pulled back";
            }
        // Below T0 it holds as if there were none.
        const Trace held =
            run_named("swept-point", scene, press(scene.body, 5.0, 0.9 * t0, 0.2), parameters);
        EXPECT_LE(held.figures.penetration_voxels, 0.05);
    }
}

TEST(SweptPoint, GoesThroughAWallOnlyByYielding) {
    const Scene scene = make_scene(flat_wall(2.0), {});
    haptics::TouchParameters parameters = settings(scene);
    parameters.yield_n = 1.0;
    const Trace run = run_named("swept-point", scene, press(scene.body, 5.0, 8.0, 0.2), parameters);
    EXPECT_GE(run.figures.pop_throughs, 1u);
    EXPECT_LE(run.figures.largest_force_n, 1.1);
    EXPECT_EQ(run.ticks[run.ticks.size() / 2].force, dvec3(0.0)); // free on the other side
}

// ---- edits --------------------------------------------------------------------------------------

// Removal, growth, undo and flicker under contact: the force changes by at most 0.10 N beyond what
// the hand moves.
TEST(SweptPoint, EditsUnderContactDoNotKick) {
    const Scene scene = make_scene(flat_plane(), {});
    const Volume before = *scene.touch.grey;
    VolumeEdit removal(before), growth(before);
    const Grid grid = before.grid();
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 20; y < 45; ++y)
            for (uint32_t x = 20; x < 45; ++x) {
                const dvec3 p = world_point(grid, {x, y, z});
                if (p.z > -2.0)
                    removal.set({x, y, z}, 0.0); // 2 mm of it are gone
                if (p.z < 1.5)
                    growth.set({x, y, z}, 1000.0); // 1.4 mm more
            }
    const Volume less = removal.commit(), more = growth.commit();
    for (const int kind : {0, 1, 2, 3}) {
        haptics::TouchScene touch = scene.touch;
        haptics::TouchParameters parameters = settings(scene);
        const auto algorithm = haptics::make_swept_point();
        haptics::TickInput input{.scene = &touch, .parameters = &parameters};
        dvec3 last_force(0.0), last_tool(0, 0, 2.0);
        double worst = 0.0, least = INFINITY, most = 0.0;
        for (int i = 0; i < 1200; ++i) {
            const dvec3 x(0.0005 * i, 0.1, std::max(-1.0, 2.0 - 0.02 * i));
            if (i == 300)
                touch.grey = kind == 0 ? less : more;
            if (i == 600 && kind >= 1)
                touch.grey = kind == 1 ? before : less;
            if (kind == 3 && i > 300 && i % 5 == 0) // 200 Hz
                touch.grey = i % 10 == 0 ? less : before;
            input.velocity_mm_per_s = (x - last_tool) * 1000.0;
            input.tool.position_mm = x;
            const haptics::TickOutput out = algorithm->tick(input);
            ASSERT_TRUE(std::isfinite(out.force_n.z));
            if (i > 0)
                worst = std::max(worst, glm::distance(out.force_n, last_force) -
                                            glm::distance(x, last_tool)); // k = 1 N/mm
            if (i > 500 && i < 600) {
                least = std::min(least, out.force_n.z);
                most = std::max(most, out.force_n.z);
            }
            last_force = out.force_n;
            last_tool = x;
        }
        EXPECT_LE(worst, 0.10) << kind;
        if (kind == 0) {
            EXPECT_LE(most, 1e-9) << "what is removed is no longer felt";
        }
        if (kind == 1) {
            EXPECT_NEAR(least, 2.3, 0.4) << "what was added is";
        }
    }
}

// An iso-value moved while touching slides the surface, too.
// Nothing but the snapshot changes: straight above its contact a proxy need not move at all, and
// what is touched must be looked for again.
TEST(SweptPoint, ForceEndsWithWhatIsTouchedUnderAHandAtRest) {
    const Scene scene = make_scene(flat_plane(), {});
    VolumeEdit removal(*scene.touch.grey);
    const Grid grid = scene.touch.grey->grid();
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 0; y < grid.size.y; ++y)
            for (uint32_t x = 0; x < grid.size.x; ++x)
                if (world_point(grid, {x, y, z}).z > -4.0)
                    removal.set({x, y, z}, 0.0);
    haptics::TouchScene touch = scene.touch;
    haptics::TouchParameters parameters = settings(scene);
    const auto algorithm = haptics::make_swept_point();
    haptics::TickInput input{.scene = &touch, .parameters = &parameters};
    haptics::TickOutput out;
    for (int i = 0; i < 300; ++i) {
        input.tool.position_mm = {0, 0, std::max(-1.0, 2.0 - 0.02 * i)};
        out = algorithm->tick(input);
    }
    EXPECT_NEAR(out.force_n.z, 1.0 + scene.body.touch_mm.z, 0.01); // k = 1 N/mm
    touch.grey = removal.commit();
    for (int i = 0; i < 50; ++i) // bled off within 1 N at 90 N/s
        out = algorithm->tick(input);
    EXPECT_EQ(out.force_n, dvec3(0.0));
    EXPECT_EQ(out.contact, haptics::Contact::free);
}

TEST(SweptPoint, IsoValueMovedUnderContactDoesNotKick) {
    const Scene scene = make_scene(flat_plane(), {});
    haptics::TouchParameters parameters = settings(scene);
    const auto algorithm = haptics::make_swept_point();
    haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
    double worst = 0.0;
    dvec3 last(0.0);
    for (int i = 0; i < 400; ++i) {
        input.tool.position_mm = {0, 0, i < 100 ? 2.0 - 0.03 * i : -1.0};
        if (i == 200)
            parameters.iso = 200.0;
        if (i == 300)
            parameters.iso = 800.0;
        const dvec3 force = algorithm->tick(input).force_n;
        if (i > 100)
            worst = std::max(worst, glm::distance(force, last));
        last = force;
    }
    EXPECT_LE(worst, 0.10);
    EXPECT_GT(worst, 0.01); // it did move
}

// ---- labels -------------------------------------------------------------------------------------

// Two labels side by side, the same surface: what they feel like changes smoothly across the
// border.
TEST(SweptPoint, LabelsDifferAndMeetSmoothly) {
    Scene scene = make_scene(flat_plane(), {.form = Form::labels});
    const Grid grid = scene.touch.labels->grid();
    const Volume one = *scene.touch.labels;
    scene.touch.labels = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return one.value(i) == 0.0f ? 0.0 : world_point(grid, dvec3(i)).x < 0.0 ? 1.0 : 2.0;
    });
    haptics::TouchParameters parameters = scene_parameters(scene);
    parameters.source = haptics::TouchSource::labels;
    parameters.label_count = 2;
    parameters.labels[0] = {.label = 1, .stiffness_n_per_m = 500.0};
    parameters.labels[1] = {.label = 2, .stiffness_n_per_m = 1500.0};
    Path path;
    for (int i = 0; i < 200; ++i)
        path.push_back({-4.0, 0.2, 2.0 - 0.02 * i});
    for (int i = 0; i < 800; ++i)
        path.push_back({-4.0 + 0.01 * i, 0.2, -2.0});
    const Trace run = run_named("swept-point", scene, path, parameters);
    const double depth = run.ticks[250].proxy.z + 2.0;
    EXPECT_NEAR(depth, 2.0, 0.5);
    EXPECT_NEAR(run.ticks[250].force.z, 0.5 * depth, 0.02 * depth);
    EXPECT_NEAR(run.ticks[999].force.z, 1.5 * (run.ticks[999].proxy.z + 2.0), 0.05 * depth);
    double worst = 0.0;
    for (size_t i = 220; i < run.ticks.size(); ++i)
        worst = std::max(worst, glm::distance(run.ticks[i].force, run.ticks[i - 1].force));
    // 1 N/mm over a border of about 3 samples (1.5 mm), 2 mm deep: 0.013 N for 0.01 mm, and the
    // steepest part of the spline is twice its mean.
    EXPECT_LE(worst, 0.04);
}

// ---- whatever comes -----------------------------------------------------------------------------

TEST(SweptPoint, NoInputGivesAnythingButNumbers) {
    constexpr double kBad[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, 1e-308, 0.0, 1.0, 1e7};
    std::mt19937_64 random(5);
    const auto bad = [&] { return kBad[random() % std::size(kBad)]; };
    Scene scene = make_scene(flat_plane(), {});
    haptics::TouchScene holes;
    holes.grey = make_volume(make_grid({9, 1, 40}, dvec3(1.0)), ScalarType::f32, [](glm::uvec3 i) {
        return i.z % 3 == 0 ? NAN : i.x % 2 ? INFINITY : 1e30;
    });
    haptics::TouchScene nothing, constant, one;
    constant.grey = make_volume(make_grid({40, 40, 40}, dvec3(0.5)), ScalarType::i16,
                                [](glm::uvec3) { return 32767.0; });
    one.grey = make_volume(make_grid({1, 1, 1}, dvec3(0.5)), ScalarType::f32,
                           [](glm::uvec3) { return 1.0; });
    const haptics::TouchScene* scenes[] = {&scene.touch, &holes, &nothing, &constant, &one};
    for (const haptics::AlgorithmEntry& entry : haptics::algorithms()) {
        const auto algorithm = entry.make();
        for (int i = 0; i < 3000; ++i) {
            haptics::TouchParameters parameters;
            if (random() % 2) {
                parameters.iso = bad();
                parameters.stiffness_n_per_m = bad();
                parameters.friction_static = parameters.friction_dynamic = bad();
                parameters.yield_n = bad();
                parameters.damping_n_s_per_m = bad();
                parameters.tool_radius_mm = bad();
                parameters.vibration_n = bad();
                parameters.normal_blur_samples = bad();
                parameters.tool_samples = static_cast<uint32_t>(random());
                parameters.source = static_cast<haptics::TouchSource>(random() % 2);
                for (auto& transfer : parameters.transfer)
                    transfer = {bad(), bad(), bad()};
            }
            parameters.tool_samples = std::min(parameters.tool_samples, 500u);
            haptics::TickInput input{.scene = scenes[random() % std::size(scenes)],
                                     .parameters = &parameters};
            input.removing = random() % 2;
            input.tool.position_mm =
                random() % 2 ? dvec3(bad(), bad(), bad()) : dvec3(0.1, 0.2, -0.3 * (i % 20));
            input.velocity_mm_per_s = random() % 8 ? dvec3(1.0) : dvec3(bad());
            if (random() % 16 == 0)
                input.dt_s = bad();
            if (random() % 64 == 0)
                algorithm->reset(input);
            const haptics::TickOutput out = algorithm->tick(input);
            for (int axis = 0; axis < 3; ++axis) {
                ASSERT_TRUE(std::isfinite(out.force_n[axis])) << entry.name << " " << i;
                ASSERT_TRUE(std::isfinite(out.proxy.position_mm[axis])) << entry.name << " " << i;
                ASSERT_TRUE(std::isfinite(out.normal[axis])) << entry.name << " " << i;
            }
        }
    }
}

TEST(SweptPoint, SameInputsGiveTheSameForcesToTheBit) {
    const TouchCase body = touch_cases({}, false)[6];
    const Scene scene = make_scene(body, {.noise = 0.05});
    const Path path = hand(body, 2.0, 1.0, 3);
    const Trace a = run_named("swept-point", scene, path, settings(scene));
    const Trace b = run_named("swept-point", scene, path, settings(scene));
    for (size_t i = 0; i < a.ticks.size(); ++i)
        ASSERT_EQ(a.ticks[i].force, b.ticks[i].force);
}

// A start inside material: out where a surface is near, nothing felt where none is.
TEST(SweptPoint, StartInsideMaterialIsPushedOutOrFeelsNothing) {
    const Scene scene = make_scene(flat_plane(), {});
    const haptics::TouchParameters parameters = settings(scene);
    for (const double depth : {0.5, 6.0}) {
        const auto algorithm = haptics::make_swept_point();
        haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
        input.tool.position_mm = {0, 0, 0.13 - depth};
        haptics::TickOutput out;
        for (int i = 0; i < 50; ++i)
            out = algorithm->tick(input);
        if (depth < 1.0) {
            EXPECT_EQ(out.contact, Contact::touching);
            EXPECT_NEAR(out.force_n.z, depth, 0.02);
        } else {
            EXPECT_EQ(out.contact, Contact::submerged);
            EXPECT_EQ(out.force_n, dvec3(0.0));
        }
    }
}

TEST(BandNoise, LiesBetween20And400Hz) {
    haptics::BandNoise noise;
    std::vector<double> x(8192);
    for (int i = 0; i < 1000; ++i)
        noise.next(1e-4);
    for (double& value : x) {
        value = noise.next(1e-4); // 10 kHz
        ASSERT_LE(std::abs(value), 1.0);
    }
    // Power by a plain Fourier sum, in bands of 40 Hz.
    const auto power = [&](double from, double to) {
        double sum = 0.0;
        int count = 0;
        for (double hertz = from; hertz < to; hertz += 10000.0 / 8192.0 * 3.0, ++count) {
            double re = 0.0, im = 0.0;
            for (size_t i = 0; i < x.size(); ++i) {
                const double window = 0.5 - 0.5 * std::cos(2.0 * M_PI * double(i) / 8192.0);
                re += window * x[i] * std::cos(2.0 * M_PI * hertz * 1e-4 * static_cast<double>(i));
                im += window * x[i] * std::sin(2.0 * M_PI * hertz * 1e-4 * static_cast<double>(i));
            }
            sum += re * re + im * im;
        }
        return sum / count;
    };
    // Butterworth of second order falls by 12 dB an octave: at 4 times the edge to 1/257, at a
    // fifth of the low edge to 1/626; a quarter of the mean is left to chance.
    const double band = power(60, 300);
    EXPECT_LE(power(1600, 1900), band / 60.0);
    EXPECT_LE(power(1, 5), band / 60.0);
}

} // namespace
} // namespace palpate::touch
