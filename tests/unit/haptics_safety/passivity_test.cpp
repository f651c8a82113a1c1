#include "haptics/safety/passivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "haptics/device/simulated.h"

namespace palpate::haptics {
namespace {

constexpr double kT = 1e-3;

TEST(StoredEnergy, IsTheIntegralOfTheCutForce) {
    for (const double most : {1.0, 3.0, 100.0})
        for (const double depth : {0.001, 0.004, 0.02}) {
            constexpr double kStiffness = 500.0;
            double sum = 0.0;
            constexpr int kParts = 20000;
            for (int i = 0; i < kParts; ++i)
                sum += std::min(most, kStiffness * depth * (i + 0.5) / kParts) * depth / kParts;
            // The midpoint rule is exact but in the part with the kink.
            EXPECT_NEAR(stored_energy_j(kStiffness * depth, kStiffness, most), sum,
                        1e-7 * sum + 1e-12);
        }
}

// A held spring pressed at even speed and left again by a hand that nothing turns, on a device
// whose forces act `delay_ticks` later and which says so.
struct Press {
    double work_j = 0.0, most_damping = 0.0;
    double observed_j = 0.0; // by the observer
    double settled = 0.0;    // damping when nine tenths of the press were done, N s/m
};
Press press(double k, double v, double depth, bool controlled, uint32_t delay_ticks = 0) {
    const double way_s = depth / v;
    DevicePreset preset = *find_device_preset("ideal");
    preset.plant.delay_ticks = delay_ticks;
    SimulatedDevice device(
        preset, {.mass_kg = 1.0, .damping_n_s_per_m = 1e15, .stiffness_n_per_m = 0.0},
        HandPath({{.time_s = 0},
                  {.time_s = way_s, .tool = {.position_mm = {1e3 * depth, 0, 0}}},
                  {.time_s = 2 * way_s},
                  {.time_s = 2.5 * way_s, .tool = {.position_mm = {-5, 0, 0}}}}),
        Workspace({0, 0, 0}, 1.0));
    Passivity passivity(
        {.most_damping_n_s_per_m = 1000.0, .leak_s = 1e9, .delay_s = delay_ticks * kT});
    Press result;
    DeviceSample sample;
    for (int64_t now = 0; now <= std::llround(2.4 * way_s * 1e9); now += 1'000'000) {
        device.read(now, sample);
        glm::dvec3 force(-k * std::max(sample.position_m.x, 0.0), 0, 0);
        if (controlled) {
            const double stored = stored_energy_j(glm::length(force), k, 1e9);
            force =
                passivity.limit(sample.position_m, sample.velocity_m_per_s, force, {stored, k}, kT);
            result.most_damping = std::max(result.most_damping, passivity.damping());
            if (now <= std::llround(0.9 * way_s * 1e9))
                result.settled = passivity.damping();
            result.observed_j = passivity.work_j();
            passivity.sent(force);
        }
        device.write(now, {force, {}});
    }
    result.work_j = device.motor_work_j();
    return result;
}

TEST(Passivity, ObservesAndTakesAwayWhatASampledSpringMakes) {
    for (const double k : {300.0, 1000.0, 3000.0})
        for (const double v : {0.05, 0.2}) {
            const double made = k * v * kT * 0.005;
            EXPECT_NEAR(press(k, v, 0.005, false).work_j, made, 1e-3 * made);
            const Press controlled = press(k, v, 0.005, true);
            // Nothing is left over, and what is taken is of the same size.
            EXPECT_LE(controlled.work_j, 0.001 * made) << k << ' ' << v;
            EXPECT_GE(controlled.work_j, -1.1 * made) << k << ' ' << v;
            // The damping is that of the bound, k T / 2; at the turn, when force still pushes the
            // old way, a whole k d v T has been made within one tick, so that there it may be more.
            EXPECT_GE(controlled.most_damping, 0.5 * k * kT * (1 - 1e-6));
        }
}

// Late by D the spring makes k v d (T + 2 D) on the way in and out, and what keeps it from that is
// damping of k (T / 2 + D).
TEST(Passivity, KnowsThatForcesActLater) {
    for (const uint32_t delay : {1u, 2u})
        for (const double k : {300.0, 1000.0, 3000.0})
            for (const double v : {0.05, 0.2}) {
                SCOPED_TRACE(testing::Message() << delay << ' ' << k << ' ' << v);
                // Less what late force gives back at the turn, where it pushes the old way: k v T
                // for each tick, for as many ticks as it is late.
                const double turn = 0.5 * delay * (delay + 1) * k * std::pow(v * kT, 2);
                const double made = k * v * kT * 0.005 * (1 + 2 * delay) - turn;
                EXPECT_NEAR(press(k, v, 0.005, false, delay).work_j, made, 1e-3 * made);
                const Press controlled = press(k, v, 0.005, true, delay);
                EXPECT_LE(controlled.work_j, 0.001 * made);
                EXPECT_GE(controlled.work_j, -1.1 * made);
                // The observer's account is the motors', but for what acts after the last sample:
                // nothing, as the hand is in the air by then.
                EXPECT_NEAR(controlled.observed_j, controlled.work_j, 1e-3 * made);
                // After 90 ticks of even speed it stands where it takes what the spring makes.
                if (v == 0.05) {
                    EXPECT_NEAR(controlled.settled, k * kT * (0.5 + delay), 0.02 * k * kT);
                }
            }
}

TEST(Passivity, AFractionOfATickIsAMean) {
    // Forces of 1 and 3 N in two ticks, a quarter of a tick late: over the second tick's way 1 N
    // acted for a quarter of the time and 3 N for the rest.
    Passivity passivity({.leak_s = 1e9, .delay_s = 0.25 * kT});
    double x = 0.0;
    for (const double force_n : {1.0, 3.0, 0.0}) {
        passivity.limit({x, 0, 0}, {}, {}, {}, kT);
        passivity.sent({force_n, 0, 0});
        x += 1e-3;
    }
    // 0.75 of 1 N over the first mm, (0.25 * 1 + 0.75 * 3) N over the second.
    EXPECT_NEAR(passivity.work_j(), 0.75e-3 + 2.5e-3, 1e-15);
    // A sample that stands in for one that did not come says nothing; the next tells of both ticks.
    const double before_j = passivity.work_j();
    passivity.limit({x - 1e-3, 0, 0}, {}, {}, {}, kT, false);
    passivity.sent({5.0, 0, 0});
    EXPECT_EQ(passivity.work_j(), before_j);
    passivity.limit({x, 0, 0}, {}, {}, {}, kT);
    // Back from now: 0.25 ticks of 5 N have not acted yet; of the two ticks before, 5 N had 0.75,
    // 0 N a whole one and 3 N a quarter.
    EXPECT_NEAR(passivity.work_j() - before_j, (0.75 * 5.0 + 0.25 * 3.0) / 2 * 1e-3, 1e-15);
}

// A hand that wanders through a wall by random, on a device with encoders. At no moment has it been
// given more than what a late spring makes before the damping against it acts.
TEST(Passivity, NoHandIsGivenMoreThanIsMadeBeforeDampingActs) {
    for (const char* name : {"ideal", "falcon", "omega"})
        for (const uint32_t delay : {0u, 1u, 2u})
            for (uint64_t seed = 1; seed <= 10; ++seed) {
                SCOPED_TRACE(testing::Message() << name << ' ' << delay << ' ' << seed);
                std::mt19937_64 random(seed);
                std::uniform_real_distribution<double> place_mm(-5.0, 4.0), way_s(0.03, 0.3);
                std::vector<HandPose> poses{{.tool = {.position_mm = {5, 0, 0}}}};
                while (poses.back().time_s < 3.0)
                    poses.push_back({.time_s = poses.back().time_s + way_s(random),
                                     .tool = {.position_mm = {place_mm(random), 0, 0}}});
                DevicePreset preset = *find_device_preset(name);
                preset.plant.delay_ticks = delay;
                SimulatedDevice device(preset, {}, HandPath(poses), Workspace({0, 0, 0}, 1.0));
                const double k = 500.0, late_s = delay * kT;
                Passivity passivity({.delay_s = late_s});
                DeviceSample sample;
                double most_j = -1.0, most_speed = 0.0, most_n = 0.0;
                for (int64_t now = 0; now < 3'000'000'000; now += 1'000'000) {
                    device.read(now, sample);
                    const double true_m = std::max(0.0, -device.true_position_m().x);
                    // Energy that the wall has still to give back is the hand's.
                    most_j = std::max(most_j, device.motor_work_j() + 0.5 * k * true_m * true_m);
                    if (true_m > 0.0)
                        most_speed =
                            std::max(most_speed, std::abs(device.true_velocity_m_per_s().x));
                    glm::dvec3 force(k * std::max(-sample.position_m.x, 0.0), 0, 0);
                    const double stored_j = stored_energy_j(force.x, k, 1e9);
                    force = passivity.limit(sample.position_m, sample.velocity_m_per_s, force,
                                            {stored_j, k}, kT);
                    most_n = std::max(most_n, glm::length(force));
                    passivity.sent(force);
                    device.write(now, {force, {}});
                }
                // A tick makes k v^2 T (T / 2 + D). The damping against it is noticed after a tick
                // and D, acts D later, and is whole after (1 / 2 + D / T) / 0.2 ticks, half of it
                // in the mean.
                const double a_tick_j = k * most_speed * most_speed * kT * (0.5 * kT + late_s);
                const double ticks = 1.0 + 2.0 * delay + 0.5 * (0.5 + delay) / 0.2;
                const double steps_j = 2.0 * preset.plant.encoder_step_m * most_n;
                EXPECT_LE(most_j, a_tick_j * ticks + steps_j) << a_tick_j * ticks << ' ' << steps_j;
            }
}

TEST(Passivity, PaysNothingForASpringThatWasPressedLongAgo) {
    // Stored energy is no dissipated energy: it does not leak. Pressed, held for 10 s, released
    // with leak_s of 0.5: the observer must not take the release for made energy beyond k v T d.
    Passivity passivity({.most_damping_n_s_per_m = 1000.0, .leak_s = 0.5});
    const double k = 1000.0;
    double most_made = 0.0, before = 0.0;
    for (int tick = 0; tick < 10'200; ++tick) {
        const double depth = 5e-3 * std::clamp(std::min(tick, 10'200 - tick) / 100.0, 0.0, 1.0);
        const glm::dvec3 force(-k * depth, 0, 0);
        passivity.limit({depth, 0, 0}, {(depth - before) / kT, 0, 0}, force,
                        {stored_energy_j(k * depth, k, 1e9), k}, kT);
        before = depth;
        passivity.sent(force);
        most_made = std::max(most_made, passivity.made_j());
    }
    const double v = 5e-3 / 0.1;
    EXPECT_LE(most_made, k * v * kT * 5e-3 * (1 + 1e-9));
}

TEST(Passivity, WhatWasDissipatedIsForgotten) {
    Passivity passivity({.most_damping_n_s_per_m = 1000.0, .leak_s = 0.5});
    double x = 0.0;
    for (int tick = 0; tick < 1000; ++tick) { // through something thick
        x += 1e-4;
        passivity.limit({x, 0, 0}, {0.1, 0, 0}, {-1.0, 0, 0}, {}, kT);
        passivity.sent({-1.0, 0, 0});
    }
    // 0.1 mJ a tick, leaking with 0.5 s: never more than 0.5 s of it.
    EXPECT_GE(passivity.made_j(), -1e-4 * 500 * (1 + 1e-9));
    for (int tick = 0; tick < 2500; ++tick) {
        passivity.limit({x, 0, 0}, {}, {}, {}, kT);
        passivity.sent({});
    }
    EXPECT_NEAR(passivity.made_j(), 0.0, 0.05 * std::exp(-5.0));
    EXPECT_NEAR(passivity.work_j(), -0.1, 1e-3); // the account without leak keeps it
}

TEST(Passivity, WhatIsMadeAtOnceIsTakenAwayWithoutABlow) {
    // 0.025 mJ in one tick at 40 mm/s: a tool of 3 mm that goes to another groove. Taken away
    // within that tick it would be a blow of 0.625 N.
    constexpr double kSpeed = 0.04, kMade_j = 0.025e-3;
    const Passivity::Settings settings{.leak_s = 1e9};
    Passivity passivity(settings);
    double before = 0.0, taken_j = 0.0;
    int ticks = 0;
    for (int tick = 0; tick < 200; ++tick) {
        const double stored_j = tick < 10 ? 0.0 : kMade_j;
        const glm::dvec3 force =
            passivity.limit({kSpeed * kT * tick, 0, 0}, {kSpeed, 0, 0}, {}, {stored_j}, kT);
        passivity.sent(force);
        ASSERT_LE(std::abs(force.x - before), settings.slew_n_per_s * kT * (1 + 1e-9)) << tick;
        before = force.x;
        taken_j -= force.x * kSpeed * kT;
        ticks += force.x != 0.0;
    }
    // All of it, and on the way down from the peak as much again, a tick more each way.
    EXPECT_GE(taken_j, kMade_j);
    EXPECT_LE(taken_j, 2.5 * kMade_j);
    EXPECT_LE(ticks, 30);
    EXPECT_EQ(before, 0.0);
}

TEST(Passivity, DampingEndsWithTheMotion) {
    // Half a second at 0.2 m/s with the account overdrawn: all that the device may be damped by.
    // Then the hand stands still, or turns round.
    for (const double after : {0.0, -0.2}) {
        const Passivity::Settings settings{.leak_s = 1e9};
        Passivity passivity(settings);
        double x = 0.0, last_n = 0.0;
        for (int tick = 0; tick < 600; ++tick) {
            const double v = tick < 500 ? 0.2 : after;
            const double stored_j = 0.04 * tick; // made from nothing
            last_n = passivity.limit({x, 0, 0}, {v, 0, 0}, {}, {stored_j}, kT).x;
            passivity.sent({last_n, 0, 0});
            x += v * kT;
            ASSERT_LE(last_n * v, 0.0) << tick;
            if (tick == 499) {
                EXPECT_NEAR(last_n, -settings.most_damping_n_s_per_m * 0.2, 1e-9);
            }
            if (after == 0.0 && tick >= 500) {
                ASSERT_LE(std::abs(last_n), 4.0 * std::pow(0.9, tick - 499) + 1e-9) << tick;
            }
        }
        // From the turn on it grows anew.
        EXPECT_NEAR(last_n, after == 0.0 ? 0.0 : 100 * settings.slew_n_per_s * kT, 0.03);
    }
}

TEST(Passivity, SteadyDampingEndsWithTheSpring) {
    Passivity passivity({.leak_s = 1e9, .slew_n_per_s = 0.0}); // the spring's part alone
    constexpr double kSpeed = 0.1, kStiffness = 2000.0;
    double x = 0.0, stored_j = 0.0, force_n = 0.0;
    for (int tick = 0; tick < 400; ++tick, x += kSpeed * kT) {
        const bool has_spring = tick < 100;
        stored_j += has_spring ? 1e-3 : 0.0; // made from nothing
        force_n =
            passivity
                .limit({x, 0, 0}, {kSpeed, 0, 0}, {}, {stored_j, has_spring ? kStiffness : 0.0}, kT)
                .x;
        passivity.sent({force_n, 0, 0});
        if (tick == 99) {
            EXPECT_NEAR(force_n, -1.5 * kStiffness * kT * kSpeed, 1e-9);
        }
    }
    EXPECT_EQ(force_n, 0.0);
}

TEST(Passivity, OneEncoderStepIsNotAnsweredWithABlow) {
    // A hand that trembles over the edge of one step of 50 um while the account is overdrawn: the
    // way of a tick says 50 mm/s, 1 N at 20 N s/m. The estimator's window of 15 ticks says a
    // fifteenth at most.
    constexpr double kStep = 50e-6;
    Passivity passivity({.leak_s = 1e9, .slew_n_per_s = 1e9});
    VelocityEstimator estimator(kStep);
    double most_n = 0.0;
    for (int tick = 0; tick < 500; ++tick) {
        const glm::dvec3 at(tick % 2 ? kStep : 0.0, 0, 0);
        const glm::dvec3 velocity = estimator.add(at, kT);
        const double stored = tick < 20 ? 0.0 : 0.01; // made from nothing
        const glm::dvec3 force = passivity.limit(at, velocity, {}, {stored}, kT);
        passivity.sent(force);
        if (tick > 20) {
            most_n = std::max(most_n, std::abs(force.x));
            ASSERT_GT(passivity.made_j(), 0.0);
        }
    }
    EXPECT_LE(most_n, 20.0 * kStep / (15 * kT) * (1 + 1e-9));
}

// Mass and hand against a wall too stiff for the sampling: how far it shakes at the end.
struct Shaken {
    DevicePreset preset;
    double k;
    double most_damping = 20.0;
    HandModel hand{.mass_kg = 0.0, .damping_n_s_per_m = 1.5, .stiffness_n_per_m = 150.0};
};
double shake_m(const Shaken& shaken, bool controlled) {
    const double k = shaken.k;
    SimulatedDevice device(shaken.preset, shaken.hand,
                           HandPath({{.time_s = 0, .tool = {.position_mm = {-5, 0, 0}}},
                                     {.time_s = 0.3, .tool = {.position_mm = {10, 0, 0}}}}),
                           Workspace({0, 0, 0}, 1.0));
    Passivity passivity({.most_damping_n_s_per_m = shaken.most_damping, .leak_s = 0.5});
    DeviceSample sample;
    double low = 1.0, high = -1.0;
    for (int64_t now = 0; now < 3'000'000'000; now += 1'000'000) {
        device.read(now, sample);
        glm::dvec3 force(-k * std::max(sample.position_m.x, 0.0), 0, 0);
        if (controlled) {
            force = passivity.limit(sample.position_m, sample.velocity_m_per_s, force,
                                    {stored_energy_j(glm::length(force), k, 1e9), k}, kT);
            passivity.sent(force);
        }
        device.write(now, {force, {}});
        if (now >= 2'000'000'000) {
            low = std::min(low, device.true_position_m().x);
            high = std::max(high, device.true_position_m().x);
        }
    }
    return high - low;
}

TEST(Passivity, AWallThatShakesWithoutItIsStillWithIt) {
    DevicePreset ideal = *find_device_preset("ideal");
    ideal.plant = {.mass_kg = 0.15, .damping_n_s_per_m = 0.5, .delay_ticks = 0};
    // b = 2 N s/m holds k up to 2 b / T = 4 kN/m (Colgate & Schenkel). At 1 kN/m what is left of b
    // is 1.5 N s/m, and 5 mm of impact decay as exp(-b t / 2m) to 1 um in the 1.7 s before we look.
    EXPECT_LE(shake_m({ideal, 1000.0}, false), 1e-5);
    for (const double k : {8000.0, 12000.0, 20000.0}) {
        EXPECT_GE(shake_m({ideal, k, 200.0}, false), 2e-4) << k;
        EXPECT_LE(shake_m({ideal, k, 200.0}, true), 5e-5) << k;
    }
    // With a tick of delay and encoders, and no more damping than a device renders.
    const HandModel soft{.mass_kg = 0.05, .damping_n_s_per_m = 1.5, .stiffness_n_per_m = 150.0};
    for (const auto& [name, k] : {std::pair("touch", 4000.0), {"omega", 8000.0}}) {
        DevicePreset preset = *find_device_preset(name);
        preset.plant.delay_ticks = 1;
        const Shaken shaken{preset, k, 20.0, soft};
        EXPECT_GE(shake_m(shaken, false), 1e-3) << name;
        EXPECT_LE(shake_m(shaken, true), preset.capabilities.resolution_m) << name;
    }
}

} // namespace
} // namespace palpate::haptics
