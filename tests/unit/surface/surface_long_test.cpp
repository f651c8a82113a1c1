// The counts that take minutes; the quick tests run the same code on fewer.
#include <gtest/gtest.h>

#include "tests/unit/surface/random_edits.h"
#include "tests/unit/surface/shapes.h"
#include "tests/unit/surface/trilinear_checks.h"

namespace palpate {
namespace {

class LongRun : public ::testing::TestWithParam<int> {};

TEST_P(LongRun, IncrementalEqualsFullAfterAThousandEdits) {
    testing::expect_incremental_equals_full(/*edits=*/1000,
                                            static_cast<uint32_t>(100 + GetParam()));
}

TEST_P(LongRun, AHundredThousandCellsHaveThePiecesOfTheInterpolant) {
    const testing::CellTally tally =
        testing::check_random_cells(/*cells=*/100000, static_cast<uint32_t>(100 + GetParam()));
    EXPECT_EQ(tally.undecided, 0);
    EXPECT_GT(tally.with_tube, 1000);
}

TEST_P(LongRun, TenThousandGridsHaveTheBettiNumbersOfTheInterpolant) {
    EXPECT_EQ(testing::check_random_grids(/*grids=*/10000, static_cast<uint32_t>(100 + GetParam())),
              0);
}

// Its ripples need some 200 samples a side before errors fall in order.
TEST(MarchingCubesLong, MarschnerLobbConvergesAtOrderTwo) {
    testing::expect_order_two(synthetic::marschner_lobb(20.0), 0.5f, {97, 193, 385});
}

INSTANTIATE_TEST_SUITE_P(Parts, LongRun, ::testing::Range(0, 10)); // each ends within its time

} // namespace
} // namespace palpate
