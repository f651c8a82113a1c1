#include "engine/segment/convert_type.h"

#include <gmock/gmock.h>

#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

TEST(ConvertType, RoundsLimitsAndSaysWhatIsLost) {
    const std::vector<float> samples{-1.5f, 0.5f, 1.5f, 254.6f, 300.0f, NAN};
    const Volume volume =
        make_volume(make_grid({6, 1, 1}, {1, 1, 1}), std::span<const float>(samples));
    const Volume u8 = make_bricks(converted_bricks(volume, ScalarType::u8), {}).value();
    const std::vector<float> expected{0, 0, 2, 255, 255, 0};
    for (uint32_t i = 0; i < 6; ++i)
        EXPECT_EQ(u8.value({i, 0, 0}), expected[i]);
    EXPECT_EQ(what_type_loses(volume, ScalarType::u8),
              "values -1.5 .. 300 are limited to 0 .. 255, 1 sample without data become 0");
    EXPECT_EQ(what_type_loses(volume, ScalarType::f32), "");
    EXPECT_EQ(what_type_loses(u8, ScalarType::i16), "");
    EXPECT_TRUE(
        make_bricks(converted_bricks(volume, ScalarType::f32), {}).value().no_data_count() == 1);
    EXPECT_EQ(scalar_type_named("i16"), ScalarType::i16);
    EXPECT_EQ(scalar_type_named("i32"), std::nullopt);
}

} // namespace
} // namespace palpate
