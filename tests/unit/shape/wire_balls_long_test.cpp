#include "tests/unit/shape/wire_balls.h"

namespace palpate {
namespace {

TEST(WireBalls, AllAreFound) {
    for (int number = 0; number < wire_balls::kBalls; ++number)
        EXPECT_GE(wire_balls::dice_of(number), 0.97) << number;
}

} // namespace
} // namespace palpate
