#include "bench/study/guidance.h"
#include "haptics/safety/chain.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace palpate::bench {
namespace {

// Guidance takes over 5 s of a processor: simulated hands do each task with and without force, tick
// by tick.
TEST(Guidance, DrawsNearerToWhatIsMeantAndMakesNoEnergy) {
    const Result<Json> made =
        guidance_study({.first_phantom = 100, .phantoms = 1, .seeds = 4, .repeats = 2}, {});
    ASSERT_TRUE(made) << made.error().message;
    std::map<std::string, std::map<bool, Json>> rows;
    for (const Json& row : (*made)["rows"])
        rows[row["task"].string][row["force"].boolean] = row;
    for (const char* task : {"edge", "plane"}) {
        const Json &off = rows[task][false], &on = rows[task][true];
        EXPECT_LT(on["hand_mm"]["mean"].number, off["hand_mm"]["mean"].number) << task;
        EXPECT_GT(on["largest_force_n"].number, 0.0) << task;
        EXPECT_LT(on["proxy_mm"]["mean"].number, on["hand_mm"]["mean"].number) << task;
    }
    EXPECT_LT(rows["plane"][true]["proxy_mm"]["p95"].number, 1e-4);
    EXPECT_LE(rows["seeds"][true]["proxy_outside_share"].number,
              rows["seeds"][false]["proxy_outside_share"].number);
    for (auto& [task, states] : rows) {
        // The energy that a spring of k makes in its first tick T, which the controller takes back
        // in the next: k v^2 T^2 / 2, for a hand of at most 0.1 m/s.
        EXPECT_LE(states[true]["largest_energy_mj"].number, 1e3 * 500.0 * 1e-8 / 2.0) << task;
        // Damping of a swing, which ends nothing, is told as a fault beside those.
        const auto faults = static_cast<uint32_t>(states[true]["faults"].number);
        EXPECT_EQ(faults & ~uint32_t{haptics::kFaultDamped}, 0u) << task;
        EXPECT_EQ(states[false]["largest_force_n"].number, 0.0) << task;
    }
}

} // namespace
} // namespace palpate::bench
