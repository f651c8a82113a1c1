#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/session/session.h"
#include "engine/volume/builder.h"
#include "haptics/device/recorded.h"

// A session tells of the material that goes, and the hand feels it.
namespace palpate {
namespace {

using haptics::ServoTick;

constexpr double kTool_mm = 2.0;

// A block of 1000 below z = 0 of a volume of -1000, and a tool that removes or adds.
SessionSetup block_setup(double vibration_n) {
    const Grid grid = make_grid(glm::uvec3(48), glm::dvec3(0.5), glm::dvec3(-11.75));
    haptics::TouchParameters parameters{.iso = 0.0, .vibration_n = vibration_n};
    return {.document = Document(make_volume(grid, ScalarType::i16,
                                             [](glm::uvec3 i) { return i.z < 24 ? 1000 : -1000; })),
            .grey = "volume",
            .labels = {},
            .scene = {},
            .touch = {},
            .parameters = parameters,
            .edit = {.threaded = false}};
}

struct Felt {
    std::vector<ServoTick> ticks;
    std::vector<double> rates, removed_mm3;
};

// The hand rests above for 0.2 s, presses 0.5 mm deep and moves along x at 20 mm/s until up_s with
// the button down, and goes up again.
// `undone_at`: the tick before which somebody takes the last stroke back; below 0: nobody.
Felt mill(Session& session, double to_value, bool is_pressed, double up_s = 0.901,
          int64_t undone_at = -1) {
    Operation operation{.kind = OperationKind::cut, .to_value = to_value};
    session.use({Json{{"kind", "ball"}, {"radius_mm", kTool_mm}},
                 {make_ball(kTool_mm)},
                 operation,
                 {},
                 {}});
    const auto pose = [&](double time_s, glm::dvec3 at, bool down) {
        return haptics::HandPose{
            .time_s = time_s, .tool = {.position_mm = at}, .buttons = down && is_pressed ? 1u : 0u};
    };
    const haptics::HandPath path({pose(0.0, {-5, 0, 4}, false), pose(0.2, {-5, 0, 4}, false),
                                  pose(0.4, {-5, 0, -0.5}, true),
                                  pose(up_s - 0.001, {5, 0, -0.5}, true),
                                  pose(up_s, {5, 0, -0.5}, false), pose(1.1, {5, 0, 4}, false)});
    const haptics::Workspace workspace({0, 0, 0}, 1.0);
    haptics::RecordedDevice device({.workspace_m = glm::dvec3(0.1), .max_force_n = 10.0},
                                   records_of_path(path, workspace, 1'000'000));
    haptics::Servo::Options options;
    options.limits.ramp_s = 0.05;
    EXPECT_TRUE(session.start(
        {device, *haptics::find_algorithm("swept-point"), workspace, options, {}, {}}));
    Felt made;
    for (int64_t i = 0; i < 1200; ++i) {
        if (i == undone_at)
            session.undo();
        made.ticks.push_back(session.tick(i * 1'000'000, i * 1'000'000));
        made.rates.push_back(session.milling().rate_mm3_per_s);
        made.removed_mm3.push_back(session.milling().removed_mm3);
    }
    session.stop();
    session.settle();
    return made;
}

uint64_t solid_samples(const Volume& volume) {
    uint64_t count = 0;
    for (uint32_t z = 0; z < volume.size().z; ++z)
        for (uint32_t y = 0; y < volume.size().y; ++y)
            for (uint32_t x = 0; x < volume.size().x; ++x)
                count += volume.value({x, y, z}) >= 0.0f;
    return count;
}

TEST(SessionMilling, CountsWhatTheStrokeTookAway) {
    Session session(block_setup(0.0));
    const uint64_t before = solid_samples(session.state().volume());
    const Felt made = mill(session, -1000.0, true);
    const uint64_t after = solid_samples(session.state().volume());
    ASSERT_LT(after, before);
    EXPECT_NEAR(made.removed_mm3.back(), 0.125 * static_cast<double>(before - after), 1e-9);
    EXPECT_GT(made.rates[600], 10.0);
    EXPECT_EQ(made.rates[150], 0.0);
    EXPECT_EQ(made.rates.back(), 0.0);
    // Undo takes nothing away, and doing it again is no work of the hand.
    session.undo();
    session.settle();
    session.redo();
    const Felt after_redo = mill(session, -1000.0, false);
    EXPECT_EQ(after_redo.removed_mm3.back(), made.removed_mm3.back());
}

// The stroke ends between two measurements, at 0.9 and 0.91 s, and is taken back before the second.
TEST(SessionMilling, AnUndoHidesNothingOfTheStrokeBeforeIt) {
    Session kept(block_setup(0.0)), undone(block_setup(0.0));
    const Felt a = mill(kept, -1000.0, true, 0.907), b = mill(undone, -1000.0, true, 0.907, 908);
    ASSERT_EQ(undone.state().strokes_done, 0u);
    ASSERT_GT(a.removed_mm3[915], a.removed_mm3[900]); // there was something to hide
    EXPECT_EQ(a.removed_mm3.back(), b.removed_mm3.back());
}

// The vibration is the difference to the same run without it, and never above its amplitude.
TEST(SessionMilling, VibratesWhileMaterialGoesAndOnlyThen) {
    constexpr double kAmplitude_n = 0.4;
    const auto difference = [&](double to_value, bool is_pressed) {
        Session still(block_setup(0.0)), shaken(block_setup(kAmplitude_n));
        const Felt a = mill(still, to_value, is_pressed), b = mill(shaken, to_value, is_pressed);
        double most = 0.0;
        for (size_t i = 0; i < a.ticks.size(); ++i) {
            const double n = glm::distance(a.ticks[i].touched.force_n, b.ticks[i].touched.force_n);
            most = std::max(most, n);
            // It slews to 0 within Servo::kRemoval_s of the last measurement.
            bool goes = false;
            for (size_t k = i < 31 ? 0 : i - 31; k <= i; ++k)
                goes = goes || b.rates[k] > 0.0;
            if (!goes) {
                EXPECT_EQ(n, 0.0) << i;
            }
        }
        EXPECT_LE(most, kAmplitude_n);
        return most;
    };
    EXPECT_GT(difference(-1000.0, true), 0.02);
    EXPECT_EQ(difference(-1000.0, false), 0.0); // no button
    EXPECT_EQ(difference(500.0, true), 0.0);    // pressed, and nothing goes
}

} // namespace
} // namespace palpate
