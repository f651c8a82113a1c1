#include "engine/base/error.h"

#include <gtest/gtest.h>

#include "engine/base/assert.h"
#include "engine/base/log.h"

namespace palpate {
namespace {

Result<int> half(int number) {
    if (number % 2)
        return fail("{}: expected an even number, found {}", "input", number);
    return number / 2;
}

Result<std::string> half_as_text(int number) {
    PALPATE_TRY(const int result, half(number));
    return std::to_string(result);
}

TEST(Result, HoldsAValueOrOneSentence) {
    EXPECT_EQ(half_as_text(8).value(), "4");
    const Result<std::string> none = half_as_text(7);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().message, "input: expected an even number, found 7");
}

TEST(AssertDeathTest, SaysTheConditionBothValuesAndThePlace) {
    const int size = 3;
    PALPATE_ASSERT(size == 3);
    PALPATE_ASSERT_CMP(size, <, 4);
    EXPECT_DEATH(PALPATE_ASSERT(size == 4), "error_test.cpp:[0-9]+: .*size == 4");
    EXPECT_DEATH(PALPATE_ASSERT_CMP(size, >=, 4), "error_test.cpp:[0-9]+: .*size >= 4.* 3 and 4");
}

TEST(Log, WritesToStandardErrorFromItsLevelUp) {
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    log::debug("unseen");
    log::info("loaded {} slices", 93);
    log::set_level(log::Level::error);
    log::warning("unseen");
    log::error("{} are kept", "{braces}");
    log::set_level(log::Level::info);
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(),
              "palpate: info: loaded 93 slices\npalpate: error: {braces} are kept\n");
}

} // namespace
} // namespace palpate
