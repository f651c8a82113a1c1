#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate::haptics {

// The scenes that are felt while algorithms are fuzzed. Small, so that a tick is quick: a ball with
// grey values, labels, mesh and field, snapshots of it after edits, and volumes without sense.
struct FuzzScenes {
    std::vector<TouchScene> all;
    size_t sound = 0; // the first so many are snapshots of the ball

    FuzzScenes() {
        const Grid grid = make_grid(glm::uvec3(28), glm::dvec3(0.5), glm::dvec3(-6.75));
        const auto grey = [&](glm::uvec3 i) {
            const double depth = 4.0 - glm::length(world_point(grid, glm::dvec3(i)));
            return 500.0 + 500.0 * std::tanh(2.0 * depth);
        };
        TouchScene ball;
        ball.grey = make_volume(grid, ScalarType::i16, grey);
        ball.labels = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
            return grey(i) < 500.0 ? 0.0 : 1.0 + i.x % 3;
        });
        ball.touch_mesh =
            make_touch_mesh(std::make_shared<Mesh>(marching_cubes(*ball.grey, 500.0f)), 1.0);
        for (int axis = 0; axis < 3; ++axis)
            ball.field[static_cast<size_t>(axis)] =
                make_volume(grid, ScalarType::f32,
                            [&](glm::uvec3 i) { return world_point(grid, glm::dvec3(i))[axis]; });
        std::mt19937_64 random(11);
        for (uint64_t version = 1; version <= 12; ++version) {
            ball.version = version;
            all.push_back(ball);
            VolumeEdit edit(*ball.grey), relabel(*ball.labels);
            for (int k = 0; k < 200; ++k) {
                const glm::uvec3 at(random() % 28, random() % 28, random() % 28);
                edit.set(at, random() % 2 ? 1000.0 : -1000.0);
                relabel.set(at, static_cast<double>(random() % 4));
            }
            ball.grey = edit.commit();
            ball.labels = relabel.commit();
        }
        sound = all.size();
        const auto add = [&](glm::uvec3 size, ScalarType type, const auto& value) {
            TouchScene scene;
            scene.grey = make_volume(make_grid(size, glm::dvec3(1.0)), type, value);
            all.push_back(scene);
        };
        add({9, 1, 40}, ScalarType::f32, [](glm::uvec3 i) {
            return i.z % 3 == 0 ? NAN : i.x % 2 ? INFINITY : 1e30;
        });
        add({20, 20, 20}, ScalarType::i16, [](glm::uvec3) { return 32767.0; });
        add({20, 20, 20}, ScalarType::i16,
            [](glm::uvec3 i) { return (i.x + i.y + i.z) % 2 ? 32767.0 : -32768.0; });
        add({1, 1, 1}, ScalarType::f32, [](glm::uvec3) { return 1.0; });
        all.emplace_back(); // nothing at all
    }
};

// Ticks of one algorithm on input by chance: a hand that wanders over the ball, edits, and one tick
// in four where any of the numbers may be anything. Whatever comes in, what goes out are numbers.
inline void fuzz_algorithm(const AlgorithmEntry& entry, const FuzzScenes& scenes, uint64_t seed,
                           uint64_t ticks) {
    constexpr double kOdd[] = {NAN,  INFINITY, -INFINITY, 1e308, -1e308, 1e-308, -0.0, 0.0,   1.0,
                               -1.0, 1e7,      -1e7,      0.001, 1e4,    1e6,    30.0, 500.0, 1e-6};
    std::mt19937_64 random(seed);
    const auto odd = [&] { return kOdd[random() % std::size(kOdd)]; };
    const auto share = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    const auto within = [&](double most) {
        const double x = share(), y = share(), z = share();
        return most * (2.0 * glm::dvec3(x, y, z) - 1.0);
    };
    const auto algorithm = entry.make();
    TouchParameters parameters;
    glm::dvec3 hand(0.0, 0.0, 6.0);
    size_t scene = 0;
    for (uint64_t tick = 0; tick < ticks; ++tick) {
        const uint64_t dice = random();
        if (dice % 64 == 0) // new parameters, of which most are sound
            parameters = {.iso = 500.0,
                          .tool_radius_mm = 2.0 * share(),
                          .tool_samples = static_cast<uint32_t>(random() % 60),
                          .stiffness_n_per_m = 2000.0 * share(),
                          .damping_n_s_per_m = 5.0 * share(),
                          .friction_static = 0.5 * static_cast<double>(random() % 2),
                          .friction_dynamic = 0.3,
                          .yield_n = 2.0 * static_cast<double>(random() % 2),
                          .vibration_n = 0.1,
                          .source = static_cast<TouchSource>(random() % 2),
                          .normal_blur_samples = share()};
        if (dice >> 6 & 1)
            scene = random() % (dice >> 7 & 15 ? scenes.sound : scenes.all.size());
        hand = glm::length(hand) < 9.0 ? hand + within(dice >> 11 & 63 ? 0.1 : 8.0)
                                       : glm::dvec3(0.0, 0.0, 6.0);
        TouchParameters used = parameters;
        TickInput input{.scene = &scenes.all[scene], .parameters = &used};
        input.tool.position_mm = hand;
        input.velocity_mm_per_s = within(100.0);
        input.removal = dice >> 17 & 1;
        input.buttons = static_cast<uint32_t>(random());
        if ((dice >> 18 & 3) == 0) {
            double* numbers[] = {&used.iso,
                                 &used.stiffness_n_per_m,
                                 &used.friction_static,
                                 &used.friction_dynamic,
                                 &used.yield_n,
                                 &used.damping_n_s_per_m,
                                 &used.viscosity_n_s_per_m,
                                 &used.tool_radius_mm,
                                 &used.vibration_n,
                                 &used.normal_blur_samples,
                                 &used.surface_delay_s,
                                 &used.drill_threshold_mm,
                                 &used.transfer[0].strength_n,
                                 &used.transfer[1].center,
                                 &used.transfer[2].width,
                                 &input.dt_s,
                                 &input.tool.position_mm.x,
                                 &input.tool.position_mm.y,
                                 &input.tool.position_mm.z,
                                 &input.tool.rotation.w,
                                 &input.tool.rotation.x,
                                 &input.velocity_mm_per_s.y};
            for (uint64_t i = 0; i <= (dice >> 20 & 3); ++i)
                *numbers[random() % std::size(numbers)] = odd();
        }
        if ((dice >> 32 & 255) == 0)
            algorithm->reset(input);
        const TickOutput out = algorithm->tick(input);
        const auto is_number = [](glm::dvec3 v) {
            return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
        };
        const bool numbers = is_number(out.force_n) && is_number(out.torque_nm) &&
                             is_number(out.normal) && is_number(out.proxy.position_mm) &&
                             std::isfinite(out.depth_mm) && std::isfinite(out.confidence);
        ASSERT_TRUE(numbers) << entry.name << ", seed " << seed << ", tick " << tick;
    }
}

} // namespace palpate::haptics
