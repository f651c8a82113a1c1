#include <gtest/gtest.h>

#include "tests/unit/segment/seeded_shapes.h"

namespace palpate {
namespace {

// 100 seeds of each kind in each shape, on two spacings.
TEST(FastMarchingDefault, FindsShapesFromHundredsOfSeeds) {
    seeded::expect_found("fast-marching", 0.0, 100, 12.0, 0.95);
    seeded::expect_found("fast-marching", 0.1, 100, 12.0, 0.9);
}

} // namespace
} // namespace palpate
