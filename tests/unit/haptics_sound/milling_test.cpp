#include "haptics/sound/milling.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/edit/stroke_run.h"
#include "engine/volume/builder.h"

namespace palpate::haptics {
namespace {

Volume block(double value = 1000.0) {
    return make_volume(make_grid({64, 40, 36}, {0.5, 0.25, 1.0}, {-16, -5, -18}), ScalarType::i16,
                       [&](glm::uvec3 i) { return i.x < 32 ? value : -1000.0; });
}

Volume cut(const Volume& before, std::initializer_list<glm::dvec3> way_mm, double to = -1000.0) {
    Operation operation{.kind = OperationKind::cut, .to_value = to, .surface_value = 300.0};
    std::vector<StrokePose> poses;
    for (const glm::dvec3 at : way_mm)
        poses.push_back({0.1 * double(poses.size()), {at, {1, 0, 0, 0}}});
    return *apply_stroke(before, {make_ball(3.0)}, operation, poses);
}

// Against a count over all samples, and against the ball's volume: the staircase of samples differs
// from the ball by at most its surface times half a sample's diagonal.
TEST(RemovedBetween, IsTheBallThatWasCut) {
    const Volume before = block(), after = cut(before, {{-8, 0, 0}});
    uint64_t count = 0;
    for (uint32_t z = 0; z < 36; ++z)
        for (uint32_t y = 0; y < 40; ++y)
            for (uint32_t x = 0; x < 64; ++x)
                count += before.value({x, y, z}) >= 300 && after.value({x, y, z}) < 300;
    const Removed removed = removed_between(before, after, 300.0, before);
    EXPECT_DOUBLE_EQ(removed.mm3, 0.125 * double(count));
    EXPECT_DOUBLE_EQ(removed.mean_value, 1000.0);
    const double ball_mm3 = 4.0 / 3.0 * M_PI * 27.0, surface_mm2 = 4.0 * M_PI * 9.0;
    EXPECT_NEAR(removed.mm3, ball_mm3, surface_mm2 * 0.5 * std::hypot(0.5, 0.25, 1.0));
}

TEST(RemovedBetween, AirAndAddedMaterialAreNone) {
    const Volume before = block();
    EXPECT_EQ(removed_between(before, cut(before, {{8, 0, 0}}), 300.0, before).mm3, 0.0);
    EXPECT_EQ(removed_between(before, cut(before, {{8, 0, 0}}, 900.0), 300.0, before).mm3, 0.0);
    EXPECT_EQ(removed_between(before, before, 300.0, before).mm3, 0.0);
}

TEST(MillingMeter, SumsLooksAndFallsToZeroExactly) {
    MillingMeter meter;
    Volume now = block();
    const Volume first = now;
    Milling milling = meter.look(0.0, now, 300.0, false, true, 5.0);
    EXPECT_EQ(milling.rate_mm3_per_s, 0.0);
    double recent_mm3 = 0.0; // within the window of the last look
    for (int i = 1; i <= 20; ++i) {
        const Volume before = now;
        now = cut(now, {{-14 + 0.5 * i, 0, 0}});
        milling = meter.look(0.01 * i, now, 300.0, false, true, 5.0);
        EXPECT_GT(milling.rate_mm3_per_s, 0.0);
        if (0.01 * 20 - 0.01 * i < MillingMeter::kWindow_s)
            recent_mm3 += removed_between(before, now, 300.0, first).mm3;
    }
    EXPECT_NEAR(milling.removed_mm3, removed_between(first, now, 300.0, first).mm3, 1e-9);
    EXPECT_NEAR(milling.rate_mm3_per_s, recent_mm3 / MillingMeter::kWindow_s, 1e-6);
    EXPECT_DOUBLE_EQ(milling.hardness, 1.0); // nothing harder is in the volume
    milling = meter.look(0.201 + MillingMeter::kWindow_s, now, 300.0, false, true, 0.0);
    EXPECT_EQ(milling.rate_mm3_per_s, 0.0);
    EXPECT_EQ(milling_level(milling), 0.0);
}

TEST(MillingMeter, ChangesByOthersCountAsNone) {
    MillingMeter meter;
    const Volume before = block(), after = cut(before, {{-8, 0, 0}});
    meter.look(0.0, before, 300.0, false, true, 0.0);
    EXPECT_EQ(meter.look(0.1, after, 300.0, false, false, 0.0).removed_mm3, 0.0);
    // An undo by hand adds, and what it adds can be removed again.
    EXPECT_EQ(meter.look(0.2, before, 300.0, false, true, 0.0).removed_mm3, 0.0);
    EXPECT_GT(meter.look(0.3, after, 300.0, false, true, 0.0).removed_mm3, 0.0);
    const Volume other = make_volume(make_grid({8, 8, 8}, {1, 1, 1}), ScalarType::u8,
                                     [](glm::uvec3) { return 1.0; });
    const double so_far = meter.look(0.4, other, 0.5, true, true, 0.0).removed_mm3;
    EXPECT_EQ(so_far, meter.look(0.5, other, 0.5, true, true, 0.0).removed_mm3);
}

TEST(MillingMeter, ReadsNoMoreOftenThanItsWindowHasPlaces) {
    MillingMeter fast, slow;
    Volume now = block();
    Milling a, b;
    slow.look(0.0, now, 300.0, false, true, 0.0);
    std::vector<double> removed_mm3; // so far, after each millisecond
    for (int i = 0; i <= 100; ++i) { // 1 kHz
        now = cut(now, {{-15 + 0.1 * i, 0, 0}});
        a = fast.look(0.001 * i, now, 300.0, false, true, 0.0);
        removed_mm3.push_back(a.removed_mm3);
        if (i % 10 == 0)
            b = slow.look(0.001 * i, now, 300.0, false, true, 0.0);
    }
    // The window holds what came after 50 ms. A place of 50 ms / 7 takes the looks of 8 ms; one
    // that began before the window is left out whole, and with it at most those until 57 ms.
    const double in_window_mm3 = removed_mm3[100] - removed_mm3[50];
    EXPECT_GT(in_window_mm3, 0.0);
    EXPECT_NEAR(b.rate_mm3_per_s * MillingMeter::kWindow_s, in_window_mm3, 1e-6);
    EXPECT_LE(a.rate_mm3_per_s * MillingMeter::kWindow_s, in_window_mm3 + 1e-6);
    EXPECT_GE(a.rate_mm3_per_s * MillingMeter::kWindow_s,
              removed_mm3[100] - removed_mm3[57] - 1e-6);
}

TEST(MillingLevel, RisesWithRateAndHardnessBelowOne) {
    double last = 0.0;
    for (double rate = 1.0; rate < 1e6; rate *= 2.0) {
        const double level = milling_level({.rate_mm3_per_s = rate, .hardness = 0.5});
        EXPECT_GT(level, last);
        EXPECT_GT(milling_level({.rate_mm3_per_s = rate, .hardness = 0.9}), level);
        last = level;
    }
    EXPECT_LT(milling_level({.rate_mm3_per_s = 1e12, .hardness = 1.0}), 1.0);
    EXPECT_EQ(milling_level({.hardness = 1.0}), 0.0);
}

TEST(Dust, GrainsAreTiedToTheRemovedVolume) {
    Dust dust;
    uint64_t grains = 0;
    double mm3 = 0.0;
    for (int i = 0; i < 1000; ++i)
        grains += dust.take(mm3 += 0.013);
    EXPECT_EQ(grains, static_cast<uint64_t>(mm3 / Dust::kGrain_mm3)); // no remainder is lost
    EXPECT_EQ(dust.take(mm3), 0u);
    EXPECT_EQ(dust.take(0.0), 0u); // another session
    EXPECT_EQ(dust.take(0.5), 10u);
    EXPECT_EQ(dust.take(NAN), 0u);
}

} // namespace
} // namespace palpate::haptics
