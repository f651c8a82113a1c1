#include "engine/segment/label_merge.h"

#include <gmock/gmock.h>

#include <random>

#include "engine/volume/builder.h"

namespace palpate {
namespace {

Volume random_map(const Grid& grid, ScalarType type, uint32_t labels, uint32_t seed) {
    return make_volume(grid, type, [=](glm::uvec3 i) {
        std::minstd_rand random(seed + i.x / 3 + 97 * (i.y / 3) + 9973 * (i.z / 3));
        random.discard(3);
        return double(random() % labels);
    });
}

TEST(WithLabels, IsTheRuleSampleBySample) {
    const Grid grid = make_grid({70, 33, 9}, {1, 1, 3});
    const Volume map = random_map(grid, ScalarType::u8, 6, 1);
    const Volume found = random_map(grid, ScalarType::u8, 4, 2);
    const uint16_t of[] = {1, 2, 5};
    const Result<Volume> result = with_labels(map, found, of, {});
    ASSERT_TRUE(result);
    EXPECT_EQ(result->type(), ScalarType::u8);
    for (uint32_t z = 0; z < 9; ++z)
        for (uint32_t y = 0; y < 33; ++y)
            for (uint32_t x = 0; x < 70; ++x) {
                const float had = map.value({x, y, z}), gets = found.value({x, y, z});
                float expected = had == 1.0f || had == 2.0f || had == 5.0f ? 0.0f : had;
                if (gets != 0.0f)
                    expected = gets;
                ASSERT_EQ(result->value({x, y, z}), expected) << x << " " << y << " " << z;
            }
}

TEST(WithLabels, SharesWhatDoesNotChange) {
    const Grid grid = make_grid({96, 32, 32}, {1, 1, 1});
    const Volume map = random_map(grid, ScalarType::u16, 3, 1);
    const Volume found =
        make_volume(grid, ScalarType::u8, [](glm::uvec3 i) { return i.x < 20 ? 7.0 : 0.0; });
    const uint16_t of[] = {7};
    const Result<Volume> result = with_labels(map, found, of, {});
    ASSERT_TRUE(result);
    EXPECT_EQ(result->brick_ptr({1, 0, 0}), map.brick_ptr({1, 0, 0}));
    EXPECT_EQ(result->brick_ptr({2, 0, 0}), map.brick_ptr({2, 0, 0}));
    EXPECT_EQ(result->value({19, 31, 31}), 7.0f);
}

TEST(WithLabels, HoldsLargeLabelsAndRefusesWhatIsNoMap) {
    const Grid grid = make_grid({4, 4, 4}, {1, 1, 1});
    const auto all = [&](ScalarType type, double value) {
        return make_volume(grid, type, [=](glm::uvec3) { return value; });
    };
    const uint16_t of[] = {300};
    const Result<Volume> large =
        with_labels(all(ScalarType::u8, 9), all(ScalarType::u16, 300), of, {});
    ASSERT_TRUE(large);
    EXPECT_EQ(large->value({1, 2, 3}), 300.0f);
    EXPECT_EQ(with_labels(all(ScalarType::u8, 9), all(ScalarType::i16, 3), of, {}).error().message,
              "expected labels of type u8 or u16, found i16");
    const Volume other = make_volume(make_grid({4, 4, 4}, {1, 1, 2}), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    EXPECT_FALSE(with_labels(all(ScalarType::u8, 9), other, of, {}));
}

} // namespace
} // namespace palpate
