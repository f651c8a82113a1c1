#include "engine/base/percentile.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(Percentile, IsTheLeastValueThatSoManyDoNotExceed) {
    const std::vector<double> values{5, 1, 4, 2, 3};
    EXPECT_EQ(percentile(values, 0.0), 1.0);
    EXPECT_EQ(percentile(values, 0.2), 1.0);
    EXPECT_EQ(percentile(values, 0.21), 2.0);
    EXPECT_EQ(percentile(values, 0.5), 3.0);
    EXPECT_EQ(percentile(values, 0.99), 5.0);
    EXPECT_EQ(percentile(values, 1.0), 5.0);
    EXPECT_EQ(percentile({7.0}, 0.5), 7.0);
}

} // namespace
} // namespace palpate
