// Hands that slide in contact, from slow to as fast as devices go: the force stays the spring's
// own, and ends where contact does.

#include <cmath>

#include "haptics/proxy/swept_mesh.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;
using haptics::Contact;

constexpr double kDepth_mm = 0.6;
constexpr double kStiffness_n_per_mm = 0.5;

void line_to(Path& path, dvec3 to, double speed_mm_s) {
    const dvec3 from = path.back();
    const auto steps = size_t(std::ceil(glm::distance(from, to) / (speed_mm_s * kTick_s)));
    for (size_t i = 1; i <= steps; ++i)
        path.push_back(glm::mix(from, to, double(i) / double(steps)));
}

// In, to and fro at one speed, out, and a hold in the air.
Path sliding(const TouchCase& body, double raise_mm, double speed_mm_s, double half_way_mm) {
    const auto at = [&](double along_mm, double height_mm) {
        return body.touch_mm + (raise_mm + height_mm) * body.normal + along_mm * body.along;
    };
    Path path{at(-half_way_mm, 2.0)};
    line_to(path, at(-half_way_mm, -kDepth_mm), 100.0);
    for (int i = 0; i < 4; ++i)
        line_to(path, at(i % 2 ? -half_way_mm : half_way_mm, -kDepth_mm), speed_mm_s);
    line_to(path, at(-half_way_mm, 4.0), 1000.0);
    path.insert(path.end(), 50, dvec3(path.back()));
    return path;
}

Scene scene_of(const TouchCase& body) {
    Scene scene = make_scene(body, {});
    scene.touch.mesh =
        std::make_shared<Mesh>(haptics::touch_surface(*scene.touch.grey, settings(scene)));
    scene.touch.touch_mesh = haptics::make_touch_mesh(scene.touch.mesh, 0.5);
    return scene;
}

// 0.1 N of the force of a spring from the hand to the nearest free place, in each tick, on bodies
// that a hand meets once along its way.
TEST(Slide, ForceIsTheSpringsOwnAtAnySpeed) {
    size_t bodies = 0;
    for (const TouchCase& body : touch_cases({}, false)) {
        const bool is_asked = body.id == "A1" || body.id == "A2" || body.name == "cavity/15mm" ||
                              body.name == "torus" || body.name == "cylinder";
        if (!is_asked)
            continue;
        ++bodies;
        const Scene scene = scene_of(body);
        haptics::TouchParameters parameters = settings(scene);
        parameters.stiffness_n_per_m = 1e3 * kStiffness_n_per_mm;
        for (const char* name :
             {"swept-point", "swept-tool", "swept-tool/2.5", "swept-mesh", "swept-local"}) {
            const std::string_view asked = name;
            const bool is_large = asked == "swept-tool/2.5";
            parameters.tool_radius_mm = is_large ? 2.5 : asked == "swept-tool" ? 0.75 : 0.0;
            const Solid truth = grown(body.solid, parameters.tool_radius_mm);
            for (const double speed : {10.0, 100.0, 300.0, 500.0, 1000.0}) {
                const Trace run =
                    run_named(is_large ? "swept-tool" : name, scene,
                              sliding(body, parameters.tool_radius_mm, speed, 6.0), parameters);
                double worst_n = 0.0, in_air_n = 0.0;
                size_t touched = 0;
                for (const Seen& tick : run.ticks) {
                    const double depth_mm = -truth.distance_mm(tick.tool),
                                 force_n = glm::length(tick.force);
                    if (depth_mm < -0.5)
                        in_air_n = std::max(in_air_n, force_n);
                    worst_n = std::max(
                        worst_n, std::abs(force_n - kStiffness_n_per_mm * std::max(0.0, depth_mm)));
                    touched += depth_mm > 0.2;
                    EXPECT_NE(tick.contact, Contact::behind) << name << " on " << body.name;
                }
                EXPECT_LE(worst_n, 0.1) << name << " on " << body.name << ", " << speed << " mm/s";
                EXPECT_EQ(in_air_n, 0.0) << name << " on " << body.name << ", " << speed << " mm/s";
                EXPECT_GE(touched, 10u) << name << " on " << body.name;
            }
        }
    }
    EXPECT_EQ(bodies, 8u);
}

// Samples of 0.06 mm and a hand of 3 m/s: 50 samples in a tick are more than its work allows.
TEST(Slide, WhatCannotFollowLosesForceAndSaysSo) {
    TouchCase body = flat_plane();
    body.solid = plane({0, 0, 0.01}, {0, 0, 1});
    body.touch_mm = {0, 0, 0.01};
    body.reach_mm = 4.0;
    const Scene scene = make_scene(body, {.spacing_mm = dvec3(0.06)});
    haptics::TouchParameters parameters = settings(scene);
    parameters.stiffness_n_per_m = 1e3 * kStiffness_n_per_mm;
    parameters.tool_radius_mm = 0.5;
    parameters.tool_samples = 2000;
    Path path{{-3.0, 0.0, 1.5}};
    line_to(path, {-3.0, 0.1, 0.51 - kDepth_mm}, 50.0);
    const size_t slides = path.size();
    line_to(path, {3.0, 0.1, 0.51 - kDepth_mm}, 3000.0);
    const size_t rests = path.size();
    path.insert(path.end(), 100, dvec3(path.back()));
    const Trace run = run_named("swept-tool", scene, path, parameters);
    size_t behind = 0;
    const double own_n = kStiffness_n_per_mm * kDepth_mm;
    for (size_t i = slides; i < run.ticks.size(); ++i) {
        EXPECT_LE(glm::length(run.ticks[i].force), own_n + 0.01) << i;
        if (i > slides && run.ticks[i].contact == Contact::behind) {
            ++behind;
            EXPECT_LT(glm::length(run.ticks[i].force), glm::length(run.ticks[i - 1].force) + 1e-9);
        }
    }
    EXPECT_GT(behind, 0u);
    // It has followed within 20 ms, and what faded has come back within 20 more.
    for (size_t i = rests + 40; i < run.ticks.size(); ++i) {
        EXPECT_EQ(run.ticks[i].contact, Contact::touching) << i;
        EXPECT_NEAR(glm::length(run.ticks[i].force), own_n, 0.01) << i;
    }
}

// Windows of a local surface reach 0.5 mm here. 5 mm are ten of them, within the looks of a tick as
// long as normals are made of the first and the last one alone.
TEST(Slide, ALocalSurfaceFollowsAMeterPerSecondAtTwoHundredHertz) {
    const TouchCase body = flat_plane();
    const Scene scene = make_scene(body, {.spacing_mm = dvec3(0.5)});
    haptics::TouchParameters parameters = settings(scene);
    parameters.stiffness_n_per_m = 1e3 * kStiffness_n_per_mm;
    Path path{{-5.0, 0.2, 1.0}};
    line_to(path, {-5.0, 0.2, body.touch_mm.z - kDepth_mm}, 50.0);
    const size_t slides = path.size();
    for (int i = 0; i < 20; ++i)
        path.push_back({i % 2 ? -5.0 : 0.0, i % 2 ? 0.2 : -0.2, path.back().z});
    const Trace run = run_named("swept-local", scene, path, parameters);
    for (size_t i = slides; i < run.ticks.size(); ++i) {
        EXPECT_EQ(run.ticks[i].contact, Contact::touching) << i;
        EXPECT_NEAR(glm::length(run.ticks[i].force), kStiffness_n_per_mm * kDepth_mm, 0.01) << i;
    }
}

// 6 mm in a tick are thirty windows of 0.2 mm, of which a tick passes sixteen at most and as many
// as its looks allow: no fewer than eight, with 729 points each and as many triangles again. Then
// it has followed after four ticks. Until then force does not rise.
TEST(Slide, ALocalSurfaceThatIsLeftBehindCatchesUpWithAHandAtRest) {
    TouchCase body = flat_plane();
    body.solid = plane({0, 0, 0.03}, {0, 0, 1});
    body.touch_mm = {0, 0, 0.03};
    body.reach_mm = 4.0;
    const Scene scene = make_scene(body, {.spacing_mm = dvec3(0.2)});
    haptics::TouchParameters parameters = settings(scene);
    parameters.stiffness_n_per_m = 1e3 * kStiffness_n_per_mm;
    Path path{{-3.0, 0.0, 1.0}};
    line_to(path, {-3.0, 0.1, 0.03 - kDepth_mm}, 50.0);
    const size_t leaps = path.size();
    path.insert(path.end(), 100, dvec3(3.0, -0.1, 0.03 - kDepth_mm));
    const Trace run = run_named("swept-local", scene, path, parameters);
    const double own_n = kStiffness_n_per_mm * kDepth_mm;
    size_t behind = 0;
    for (size_t i = leaps; i < run.ticks.size(); ++i) {
        behind += run.ticks[i].contact == Contact::behind;
        EXPECT_LE(glm::length(run.ticks[i].force), own_n + 0.01) << i;
        if (i >= leaps + 4) {
            EXPECT_EQ(run.ticks[i].contact, Contact::touching) << i;
        }
        if (i >= leaps + 40) {
            EXPECT_NEAR(glm::length(run.ticks[i].force), own_n, 0.01) << i;
        }
    }
    EXPECT_GT(behind, 0u);
}

} // namespace
} // namespace palpate::touch
