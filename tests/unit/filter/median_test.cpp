#include <algorithm>

#include "engine/segment/median.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

float twin_median(const Volume& volume, glm::ivec3 i, glm::ivec3 radius) {
    if (std::isnan(twin::at(volume, i)))
        return NAN;
    std::vector<double> all;
    for (const glm::ivec3 d : twin::indices(2 * radius + 1))
        if (const double v = twin::at(volume, i + d - radius); !std::isnan(v))
            all.push_back(v);
    std::sort(all.begin(), all.end());
    return float(all[(all.size() - 1) / 2]);
}

// Networks (27, 9, 3 samples) and the sliding histogram (others, and where data is missing), to the
// bit, on every type, across brick borders.
TEST(Median, EqualsTheTwin) {
    for (const ScalarType type :
         {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16, ScalarType::f32})
        for (const glm::ivec3 radius : {glm::ivec3(1), {1, 0, 1}, {0, 0, 1}, {2, 1, 3}, {0, 0, 0}})
            for (const uint32_t missing : {0u, 4u}) {
                if (missing > 0 && type != ScalarType::f32)
                    continue;
                const Volume volume = twin::noise(make_grid({37, 6, 35}, {1, 1, 2}), type, missing);
                const Volume made = median(volume, {radius}, {}).value();
                ASSERT_EQ(made.type(), type);
                for (const glm::ivec3 i : twin::indices({37, 6, 35})) {
                    const float expected = twin_median(volume, i, radius);
                    const float found = made.value(glm::uvec3(i));
                    ASSERT_TRUE(found == expected || (std::isnan(found) && std::isnan(expected)))
                        << name_of(type) << " " << radius.x << " at " << i.x << "," << i.y << ","
                        << i.z << ": " << found << " for " << expected;
                }
            }
}

// Values far apart: the histogram leaps over empty ranks both ways.
TEST(Median, OfValuesFarApart) {
    const Volume volume =
        make_volume(make_grid({40, 9, 9}, {1, 1, 1}), ScalarType::u16,
                    [](glm::uvec3 i) { return (i.x / 3) % 2 ? 65000.0 + i.y : 3.0 * i.z; });
    const Volume made = median(volume, {glm::ivec3(2)}, {}).value();
    for (const glm::ivec3 i : twin::indices({40, 9, 9}))
        ASSERT_EQ(made.value(glm::uvec3(i)), twin_median(volume, i, glm::ivec3(2)));
}

TEST(Median, RadiusInMillimetresIsPerAxis) {
    const Grid grid = make_grid({8, 8, 8}, {0.5, 1.0, 3.0});
    EXPECT_EQ(median_of_mm(grid, 1.0)->radius_samples, glm::ivec3(2, 1, 1));
    EXPECT_EQ(median_of_mm(grid, 3.0)->radius_samples, glm::ivec3(6, 3, 1));
    EXPECT_EQ(median_of_mm(grid, 9).error().message,
              "radius: expected 0 mm or more and at most 16 samples to each side, found 9");
    const Volume volume = twin::noise(grid, ScalarType::i16);
    EXPECT_EQ(median(volume, {glm::ivec3(0, 17, 0)}, {}).error().message,
              "radius: expected 0 .. 16 samples on each axis, found 0, 17, 0");
}

TEST(Median, ThreadsChangeNoBit) {
    const Volume volume = twin::noise(make_grid({70, 65, 40}, {1, 1, 2}), ScalarType::i16);
    const Volume all = median(volume, {}, {}).value();
    for (const size_t threads : {1, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_TRUE(twin::same_bits(median(volume, {}, {}).value(), all));
    }
}

} // namespace
} // namespace palpate
