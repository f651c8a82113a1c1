// Commands that change at once what a pressed hand feels: the force changes in a tick by no more
// than the hand's motion and the fade's rate explain, and soon is the rendered one.

#include "haptics/servo/force_fade.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "engine/edit/shape.h"
#include "haptics/proxy/tool_points.h"
#include "tests/unit/haptics_servo/bench_loop.h"

namespace palpate::haptics {
namespace {

constexpr double kRate_n_per_tick = 1e-3 * ForceFade::kRate_n_per_s;
constexpr double kRounding_n = 1e-9;

TEST(ForceFade, WithoutACommandTheForceIsTheRenderedOne) {
    ForceFade fade(6.0);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> any(-50.0, 50.0);
    for (int i = 0; i < 1000; ++i) {
        const Wrench rendered{{any(random), any(random), any(random)}, {any(random), 0, 0}};
        EXPECT_EQ(fade.next(rendered, 0.0, 1e-3), rendered);
    }
}

// Rendered forces that jump at random, some of them beyond all limits, while commands come.
TEST(ForceFade, TheChangeIsBoundedAndTheForceIsSoonTheRenderedOne) {
    constexpr double kMost_n = 6.0;
    std::mt19937 random(2);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    for (int run = 0; run < 200; ++run) {
        ForceFade fade(kMost_n);
        const double size = run % 3 ? 5.0 : 100.0;
        Wrench rendered{size * glm::dvec3(any(random), any(random), any(random)),
                        0.1 * glm::dvec3(any(random), any(random), any(random))};
        Wrench before = fade.next(rendered, 0.0, 1e-3);
        before.force_n = limit_magnitude(before.force_n, kMost_n);
        before.torque_nm = limit_magnitude(before.torque_nm, kMost_n * ForceFade::kLever_m);
        fade.command(0.0);
        for (int i = 0; i < 300; ++i) {
            const double natural_n = 0.05 * std::abs(any(random));
            if (i < 90 && random() % 10 == 0) // jumps within the time that is watched
                rendered.force_n = size * glm::dvec3(any(random), any(random), any(random));
            if (i == 20)
                rendered.torque_nm = 0.1 * glm::dvec3(any(random), any(random), any(random));
            const Wrench now = fade.next(rendered, natural_n, 1e-3);
            const bool is_over = i >= 100 + 2.0 * kMost_n / kRate_n_per_tick;
            if (is_over) { // kWatch_s, and what is left at its end
                ASSERT_EQ(now, rendered) << run << " " << i;
            } else if (i < 100) {
                ASSERT_LE(glm::distance(now.force_n, before.force_n),
                          natural_n + kRate_n_per_tick + kRounding_n);
                ASSERT_LE(glm::distance(now.torque_nm, before.torque_nm),
                          ForceFade::kLever_m * (natural_n + kRate_n_per_tick) + kRounding_n);
            }
            before = now;
        }
    }
}

TEST(ForceFade, WhatIsNotFiniteReachesTheSafetyChain) {
    ForceFade fade(6.0);
    fade.next({{1, 0, 0}, {}}, 0.0, 1e-3);
    fade.command(0.0);
    EXPECT_TRUE(std::isnan(fade.next({{NAN, 0, 0}, {}}, 0.0, 1e-3).force_n.x));
    EXPECT_EQ(fade.next({{2, 0, 0}, {}}, NAN, 1e-3).force_n.x, 2.0); // begins anew
}

// A hand that no force moves comes down 2 mm deep into a ball by 2.7 s and slides over it.
glm::dvec3 slides(double t) {
    const double down = std::clamp((t - 2.3) / 0.4, 0.0, 1.0);
    const double angle = 0.1 * std::sin(8.0 * std::max(0.0, t - 2.7));
    return (14.0 - 6.0 * down) * glm::dvec3(std::sin(angle), 0.0, std::cos(angle));
}

struct Switch {
    const char* name;
    const char* algorithm;
    std::function<void(TouchScene&, TouchParameters&)> change;
};

// All of what a command may change at once.
TEST(ForceFade, CommandsUnderAPressedHandMakeNoJump) {
    const TouchScene ball = ball_scene();
    const Grid& grid = ball.grey->grid();
    const auto other_ball = [&](double radius_mm) {
        return synthetic::sample(synthetic::sphere({0, 0, 0}, radius_mm, 0.5), grid,
                                 ScalarType::i16);
    };
    const Volume labels =
        synthetic::sample(synthetic::sphere({0, 0, 0}, 9.0, 0.1, 3.0), grid, ScalarType::u8);
    const auto shape = [](double radius_mm) {
        return std::make_shared<const ToolPoints>(sample_tool(*make_ball(radius_mm), 300));
    };
    std::vector<Switch> switches;
    for (const AlgorithmEntry& entry : algorithms()) {
        switches.push_back({"volume", entry.name, [&](TouchScene& scene, TouchParameters&) {
                                scene.grey = other_ball(9.0);
                            }});
        switches.push_back({"no volume", entry.name,
                            [](TouchScene& scene, TouchParameters&) { scene.grey.reset(); }});
        switches.push_back({"stiffness", entry.name,
                            [](TouchScene&, TouchParameters& p) { p.stiffness_n_per_m = 3000.0; }});
        switches.push_back({"source", entry.name, [&](TouchScene& scene, TouchParameters& p) {
                                scene.labels = labels;
                                p.source = TouchSource::labels;
                            }});
        switches.push_back({"blur", entry.name,
                            [](TouchScene&, TouchParameters& p) { p.normal_blur_samples = 0.0; }});
    }
    for (const char* name : {"wish-2008-surface", "wish-2008-viscosity", "wish-2008-potential"})
        switches.push_back({"transfer", name, [](TouchScene&, TouchParameters& p) {
                                for (HapticTransfer& transfer : p.transfer)
                                    transfer = {.strength_n = 4.0,
                                                .point_count = 2,
                                                .values = {0.0, 1000.0},
                                                .forces_n = {4.0, 0.2}};
                            }});
    for (const char* name : {"koerner-1999", "swept-local"})
        switches.push_back(
            {"opacity", name, [](TouchScene&, TouchParameters& p) {
                 p.opacity = {.point_count = 2, .values = {0.0, 900.0}, .forces_n = {0.0, 1000.0}};
             }});
    switches.push_back({"tool", "swept-tool",
                        [&](TouchScene& scene, TouchParameters&) { scene.tool = shape(3.5); }});
    size_t felt = 0, jumped = 0;
    for (const Switch& s : switches) {
        TouchScene scene = ball;
        TouchParameters p{.iso = 500.0, .stiffness_n_per_m = 500.0, .damping_n_s_per_m = 1.0};
        p.friction_static = p.friction_dynamic = 0.2;
        p.transfer.fill({.strength_n = 1.5});
        if (s.algorithm == std::string_view("swept-tool"))
            scene.tool = shape(2.0);
        std::vector<HandPose> poses;
        for (double t = 0.0; t <= 4.0; t += 1e-3)
            poses.push_back({.time_s = t, .tool = {.position_mm = slides(t)}});
        Loop loop(
            scene, p, find_algorithm(s.algorithm)->make(),
            std::make_unique<RecordedDevice>(
                DeviceCapabilities{.workspace_m = glm::dvec3(0.05), .max_force_n = 8.0},
                records_of_path(HandPath(std::move(poses)), Workspace({0, 0, 0}, 1.0), kTick_ns),
                kTick_ns));
        ServoTick before;
        glm::dvec3 touched{0.0};
        for (int i = 0; i < 3500; ++i) {
            if (i == 3000) {
                s.change(scene, p);
                scene.version = 2;
                loop.scenes.publish(std::make_unique<const TouchScene>(scene));
                loop.parameters.publish(std::make_unique<const TouchParameters>(p));
            }
            const ServoTick t = loop.tick();
            if (i >= 3000 && i < 3100) {
                TouchParameters most = p; // on the way there the smaller counts less
                most.stiffness_n_per_m = std::max(500.0, p.stiffness_n_per_m);
                const double natural_n = natural_change_n(
                    most, glm::distance(t.tool.position_mm, before.tool.position_mm),
                    glm::distance(t.velocity_mm_per_s, before.velocity_mm_per_s), false);
                ASSERT_LE(glm::distance(t.rendered_world_n, before.rendered_world_n),
                          natural_n + kRate_n_per_tick + kRounding_n)
                    << s.name << " of " << s.algorithm << ", tick " << i;
                ASSERT_LE(glm::length(t.sent.force_n), 0.8 * 8.0);
                jumped += glm::distance(limit_magnitude(t.touched.force_n, 6.0), touched) > 0.2;
            }
            if (i >= 3100 + 2.0 * 6.0 / kRate_n_per_tick) {
                ASSERT_EQ(t.rendered_world_n, t.touched.force_n) << s.name << " " << s.algorithm;
            }
            touched = limit_magnitude(t.touched.force_n, 6.0);
            felt += i == 2999 && glm::length(t.sent.force_n) > 0.1;
            before = t;
            ASSERT_EQ(t.faults, 0u) << s.name << " of " << s.algorithm;
        }
    }
    EXPECT_GT(felt, switches.size() / 2); // most of them press, and without the fade some jump
    EXPECT_GT(jumped, 10u);
}

// An algorithm whose status and force change at once, while the hand rests.
constexpr uint32_t kChange = 50; // the last tick before it
Contact status_before, status_after;
double force_before_n, force_after_n;
struct Script {
    uint32_t ticks = 0;
};
TickOutput script_tick(Script& script, const TickInput& input) noexcept {
    const bool is_after = ++script.ticks > kChange;
    TickOutput out{.proxy = input.tool};
    out.force_n.z = is_after ? force_after_n : force_before_n;
    out.contact = is_after ? status_after : status_before;
    return out;
}

TEST(ForceFade, AChangeOfStatusMakesNoJump) {
    constexpr Contact kAll[] = {Contact::free,      Contact::touching, Contact::yielding,
                                Contact::submerged, Contact::behind,   Contact::unknown};
    for (const Contact before : kAll)
        for (const Contact after : kAll) {
            if (before == after || !(has_no_surface(before) || has_no_surface(after)))
                continue;
            status_before = before;
            status_after = after;
            // Lost, found, and turned.
            for (const auto& [from_n, to_n] : {std::pair(3.0, 0.0), {0.0, 3.0}, {3.0, -2.0}}) {
                force_before_n = from_n;
                force_after_n = to_n;
                const HandPath rests({{.time_s = 0}, {.time_s = 1}});
                Loop loop(
                    {}, {.stiffness_n_per_m = 500.0},
                    std::make_unique<StatefulAlgorithm<Script, script_tick>>(),
                    std::make_unique<RecordedDevice>(
                        DeviceCapabilities{.workspace_m = glm::dvec3(0.05), .max_force_n = 8},
                        records_of_path(rests, Workspace({0, 0, 0}, 1.0), kTick_ns), kTick_ns));
                glm::dvec3 last(0.0);
                for (uint32_t i = 1; i < kChange + 200; ++i) {
                    const ServoTick t = loop.tick();
                    if (i > 1) {
                        ASSERT_LE(glm::distance(t.rendered_world_n, last),
                                  kRate_n_per_tick + kRounding_n)
                            << static_cast<int>(before) << " to " << static_cast<int>(after)
                            << ", tick " << i;
                    }
                    last = t.rendered_world_n;
                }
                EXPECT_EQ(last.z, to_n);
            }
        }
}

} // namespace
} // namespace palpate::haptics
