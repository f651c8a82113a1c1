#include "engine/volume/brick.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

template <class T>
class BrickOf : public testing::Test {};
using Types = testing::Types<uint8_t, int8_t, uint16_t, int16_t, float>;
TYPED_TEST_SUITE(BrickOf, Types);

template <class T>
std::vector<T> random_samples(uint64_t seed) {
    std::vector<T> samples(kBrickSamples);
    for (uint32_t i = 0; i < kBrickSamples; ++i) // up to +-120: in the range of every type but u8,
        samples[i] = static_cast<T>(             // which takes half of them
            (std::is_signed_v<T> ? 0 : 120) + 20.0 * synthetic::noise({i, 0, 0}, seed));
    return samples;
}

glm::uvec3 local(uint32_t offset) {
    return {offset % kBrickSide, offset / kBrickSide % kBrickSide,
            offset / (kBrickSide * kBrickSide)};
}

TYPED_TEST(BrickOf, HoldsItsSamplesAndRepeatsTheOutermostIntoThePadding) {
    using T = TypeParam;
    const std::vector<T> samples = random_samples<T>(1);
    for (const glm::uvec3 valid :
         {glm::uvec3(32), glm::uvec3(1), glm::uvec3(31, 32, 1), glm::uvec3(8, 17, 25)}) {
        const BrickPtr brick = Brick::make(std::span<const T>(samples), valid);
        EXPECT_EQ(brick->type(), scalar_type_of<T>);
        for (uint32_t i = 0; i < kBrickSamples; ++i) {
            const T expected = samples[offset_in_brick(glm::min(local(i), valid - 1u))];
            ASSERT_EQ(brick->value(i), static_cast<float>(expected));
        }
        std::vector<T> read(kBrickSamples);
        brick->template read<T>(read);
        for (uint32_t i = 0; i < kBrickSamples; ++i)
            ASSERT_EQ(static_cast<float>(read[i]), brick->value(i));
    }
}

TYPED_TEST(BrickOf, RangesAreThoseOfTheSamplesInsideTheVolume) {
    using T = TypeParam;
    for (const glm::uvec3 valid : {glm::uvec3(32), glm::uvec3(31, 9, 1), glm::uvec3(8, 17, 25)}) {
        // Extremes beyond the volume, which may count nowhere.
        std::vector<T> samples = random_samples<T>(2);
        for (uint32_t i = 0; i < kBrickSamples; ++i)
            if (glm::any(glm::greaterThanEqual(local(i), valid)))
                samples[i] =
                    i % 2 ? std::numeric_limits<T>::lowest() : std::numeric_limits<T>::max();
        const BrickPtr brick = Brick::make(std::span<const T>(samples), valid);
        std::array<ValueRange, kBlocksPerBrick> expected;
        ValueRange whole;
        for (uint32_t i = 0; i < kBrickSamples; ++i)
            if (glm::all(glm::lessThan(local(i), valid))) {
                expected[block_of(local(i))].include(static_cast<float>(samples[i]));
                whole.include(static_cast<float>(samples[i]));
            }
        EXPECT_EQ(brick->range(), whole);
        for (uint32_t b = 0; b < kBlocksPerBrick; ++b)
            EXPECT_EQ(brick->block_range(b), expected[b]) << "block " << b;
        EXPECT_EQ(brick->no_data_count(), 0u);
    }
}

TYPED_TEST(BrickOf, OfOneValueStoresItOnce) {
    using T = TypeParam;
    std::vector<T> samples(kBrickSamples, T{7});
    for (const BrickPtr& brick : {Brick::make(std::span<const T>(samples)),
                                  Brick::make(std::span<const T>(samples.data(), 1))}) {
        EXPECT_TRUE(brick->is_constant());
        EXPECT_EQ(brick->template samples<T>().size(), 1u);
        EXPECT_LE(brick->bytes(), sizeof(Brick) + sizeof(T));
        EXPECT_EQ(brick->value(kBrickSamples - 1), 7.0f);
        EXPECT_EQ(brick->block_range(63), (ValueRange{7.0f, 7.0f}));
    }
    samples[kBrickSamples - 1] = T{8};
    EXPECT_FALSE(Brick::make(std::span<const T>(samples))->is_constant());
    // The one sample that differs lies beyond the volume: constant after all.
    EXPECT_TRUE(Brick::make(std::span<const T>(samples), {31, 32, 32})->is_constant());
}

TYPED_TEST(BrickOf, ReportsTheBlocksThatDiffer) {
    using T = TypeParam;
    const std::vector<T> samples = random_samples<T>(3);
    const BrickPtr before = Brick::make(std::span<const T>(samples));
    EXPECT_EQ(differing_blocks(*before, *before), 0u);
    for (const glm::uvec3 at : {glm::uvec3(0), glm::uvec3(31), glm::uvec3(7, 8, 16)}) {
        std::vector<T> changed = samples;
        changed[offset_in_brick(at)] = static_cast<T>(changed[offset_in_brick(at)] + 1);
        const BrickPtr after = Brick::make(std::span<const T>(changed));
        EXPECT_EQ(differing_blocks(*before, *after), uint64_t{1} << block_of(at));
    }
    const BrickPtr zero = Brick::make(std::span<const T>(std::array{T{0}}));
    const BrickPtr one = Brick::make(std::span<const T>(std::array{T{1}}));
    EXPECT_EQ(differing_blocks(*zero, *one), ~uint64_t{0});
    std::vector<T> almost(kBrickSamples, T{0});
    almost[offset_in_brick({9, 0, 0})] = T{1};
    EXPECT_EQ(differing_blocks(*zero, *Brick::make(std::span<const T>(almost))), uint64_t{1} << 1);
}

// Infinities, and NaN of any sign and payload, are one and the same "no data".
TEST(Brick, NoDataHasOneBitPattern) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    const std::array bad{
        nan,      -nan,     std::bit_cast<float>(0x7f812345u), std::bit_cast<float>(0xffc00001u),
        infinity, -infinity};
    std::vector<float> samples(kBrickSamples);
    for (uint32_t i = 0; i < kBrickSamples; ++i)
        samples[i] = bad[i % bad.size()];
    const BrickPtr none = Brick::make(std::span<const float>(samples), {32, 32, 5});
    EXPECT_TRUE(none->is_constant());
    EXPECT_TRUE(none->range().empty());
    EXPECT_TRUE(none->block_range(0).empty());
    EXPECT_EQ(none->no_data_count(), 32u * 32u * 5u);

    samples.assign(kBrickSamples, 1.0f);
    samples[offset_in_brick({3, 4, 5})] = infinity;
    samples[offset_in_brick({20, 4, 31})] = nan; // beyond the volume below: not counted
    const BrickPtr some = Brick::make(std::span<const float>(samples), {32, 32, 31});
    EXPECT_EQ(some->no_data_count(), 1u);
    EXPECT_EQ(some->range(), (ValueRange{1.0f, 1.0f}));
    EXPECT_TRUE(std::isnan(some->value(offset_in_brick({3, 4, 5}))));
    samples[offset_in_brick({3, 4, 5})] = std::bit_cast<float>(0xffc00001u);
    const BrickPtr same = Brick::make(std::span<const float>(samples), {32, 32, 31});
    EXPECT_EQ(differing_blocks(*some, *same), 0u);
}

} // namespace
} // namespace palpate
