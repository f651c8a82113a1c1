#include <fmt/format.h>

#include "tests/unit/haptics_safety/limit_cycles_cases.h"

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

} // namespace
} // namespace palpate::haptics
