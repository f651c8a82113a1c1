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

TEST(TrilinearCell, GridsHaveTheBettiNumbersOfTheInterpolant) {
    EXPECT_EQ(testing::check_random_grids(/*grids=*/400, /*seed=*/1), 0);
}

} // namespace
} // namespace palpate
