#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/unit/haptics_proxy/yield_grid.h"

namespace palpate::haptics {
namespace {

// The whole grid of YieldSource.
TEST(YieldSourceGrid, NoForceIsLargerThanT0WhereverItIsStated) {
    constexpr double kRadii[] = {0.0, 0.4, 1.0, 1.5, 3.0, 6.0, 10.0};
    constexpr double kRates[] = {100.0, 333.0, 1000.0, 3000.0, 10000.0};
    for (const char* algorithm : {"swept-tool", "swept-point", "swept-local", "swept-mesh"}) {
        uint64_t runs = 0, wrong = 0, low = 0;
        double most = 0.0;
        const bool is_tool = std::string_view(algorithm) == "swept-tool";
        for (uint64_t seed = 100; seed < 104; ++seed) {
            PressScenes scenes;
            for (const T0From from : kAllT0)
                for (uint32_t body = 0; body < kPressBodies; ++body)
                    for (const double radius : kRadii)
                        for (const double hertz : kRates) {
                            if ((radius > 0.0 && !is_tool) ||
                                (from == T0From::parameters_grey &&
                                 std::string_view(algorithm) == "swept-mesh"))
                                continue;
                            const PressCase c{algorithm, from, body, radius, hertz, seed};
                            const Pressed pressed = press(c, scenes);
                            const bool is_right =
                                pressed.is_finite && pressed.most_n <= 1.03 * pressed.t0_n;
                            const bool is_firm = body == 0 || body == 1 || body == 5;
                            const bool is_low = is_firm && pressed.asked_n > 1.5 * pressed.t0_n &&
                                                pressed.most_n < 0.97 * pressed.t0_n;
                            EXPECT_TRUE(is_right && !is_low) << name_of(c) << ": " << pressed.most_n
                                                             << " N at T0 " << pressed.t0_n << " N";
                            ++runs;
                            wrong += !is_right;
                            low += is_low;
                            most = std::max(most, pressed.most_n / pressed.t0_n);
                        }
        }
        fmt::print("{}: {} presses, {} above T0, {} below; largest force {:.4f} T0\n", algorithm,
                   runs, wrong, low, most);
    }
}

} // namespace
} // namespace palpate::haptics
