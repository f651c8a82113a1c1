#include "engine/surface/trilinear_cell.h"

#include <gtest/gtest.h>

#include "tests/unit/surface/trilinear_checks.h"

namespace palpate {
namespace {

TEST(TrilinearCell, SurfacesHaveThePiecesOfTheInterpolant) {
    const testing::CellTally tally = testing::check_random_cells(/*cells=*/3000, /*seed=*/1);
    EXPECT_EQ(tally.undecided, 0);
    EXPECT_GT(tally.with_tube, 50);
}

// A cell that turned up in random grids. Ties are taken as unequal by 2^-20, and there is a place
// round which twelve cuts leave a part with both signs that rises along no axis.
TEST(TrilinearCell, WhatTwelveCutsLeaveOpenMoreDecide) {
    const CornerValues values{1.0, -3.0, -3.0, 5.0, -3.0, 7.0, 7.0, 5.0};
    std::array<testing::Real, 8> d;
    for (size_t c = 0; c < 8; ++c)
        d[c] = testing::untied(values[c]);
    EXPECT_FALSE((testing::TrilinearTruth<testing::Real, 12>(d).classes()));
    EXPECT_TRUE(testing::check_cell(values).decided);
}

TEST(TrilinearCell, GridsHaveTheBettiNumbersOfTheInterpolant) {
    EXPECT_EQ(testing::check_random_grids(/*grids=*/400, /*seed=*/1), 0);
}

} // namespace
} // namespace palpate
