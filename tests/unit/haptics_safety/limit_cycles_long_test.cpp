#include <fmt/format.h>

#include <sstream>

#include "tests/unit/haptics_safety/other_loops.h"

namespace palpate::haptics {
namespace {

TEST(LimitCyclesLong, EachOfAllLoopsIsEnded) {
    int loops = 0, faults = 0;
    double longest_s = 0.0, most_j = 0.0;
    for (const LoopCase& c : all_loops()) {
        const LoopResult r = expect_it_is_ended(c);
        ++loops;
        faults += r.fault_s >= 0.0;
        if (r.fault_s >= 0.0 && r.begun_s >= 0.0)
            longest_s = std::max(longest_s, r.fault_s - r.begun_s);
        most_j = std::max(most_j, r.most_made_j);
    }
    fmt::print(
        "{} loops, {} ended by a fault, at most {:.2f} s after it began; motors gave {:.0f} "
        "mJ at most\n",
        loops, faults, longest_s, 1e3 * most_j);
    EXPECT_GE(loops, 672);
    EXPECT_GT(faults, 100);
}

TEST(LimitCyclesLong, NoQuickHandIsTakenForOne) {
    for (uint64_t seed = 1; seed <= 2000; ++seed)
        expect_it_is_let_be(quick_hand(seed));
}

// Devices and hands that nothing was chosen on. Known to fail for a few loops (docs/log/touch.md).
TEST(LimitCyclesLong, EachLoopOfDrawnDevicesIsEnded) {
    int faults = 0, go_on = 0;
    for (uint64_t seed = 50001; seed <= 51500; ++seed) {
        const OtherLoop other = other_loop(seed);
        const LoopResult r = other.run();
        const double ended_s = r.fault_s >= 0.0 ? r.fault_s : r.last_s;
        const bool is_long = r.begun_s >= 0.0 && ended_s - r.begun_s > 0.5;
        const bool is_left = r.fault_s < 0.0 && r.end_m > 0.25 * Swings::kLeast_m &&
                             r.end_n > 0.5 * Swings::kLeast_n;
        if (is_long || is_left)
            fmt::print("seed {}: {:.2f} s, {:.1f} mm, {:.1f} N\n", seed, ended_s - r.begun_s,
                       1e3 * r.end_m, r.end_n);
        go_on += is_long || is_left;
        faults += r.fault_s >= 0.0;
        EXPECT_LE(r.after_fault_j, 1e-9) << seed;
        EXPECT_LE(r.most_n, SafetyLimits{}.most_force_n) << seed;
    }
    EXPECT_GT(faults, 100);
    EXPECT_EQ(go_on, 0);
}

TEST(LimitCyclesLong, NoDrawnHandThatTapsOrSlidesIsTakenForOne) {
    int taken = 0;
    for (uint64_t seed = 60001; seed <= 60380; ++seed) {
        const OtherHand hand = other_hand(seed);
        const LoopResult r = hand.run();
        if (r.faults & kFaultShaking) {
            std::ostringstream text;
            text << hand;
            fmt::print("seed {}, {}: fault at {:.2f} s\n", seed, text.str(), r.fault_s);
            ++taken;
        }
    }
    EXPECT_EQ(taken, 0);
}

} // namespace
} // namespace palpate::haptics
