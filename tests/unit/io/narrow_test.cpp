#include "engine/io/narrow.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

namespace palpate::io {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

template <class T>
constexpr ComponentType component_type_of = ComponentType::f64;
template <>
constexpr ComponentType component_type_of<uint8_t> = ComponentType::u8;
template <>
[[maybe_unused]] constexpr ComponentType component_type_of<int8_t> = ComponentType::i8;
template <>
constexpr ComponentType component_type_of<uint16_t> = ComponentType::u16;
template <>
constexpr ComponentType component_type_of<int16_t> = ComponentType::i16;
template <>
constexpr ComponentType component_type_of<int32_t> = ComponentType::i32;
template <>
[[maybe_unused]] constexpr ComponentType component_type_of<uint32_t> = ComponentType::u32;
template <>
constexpr ComponentType component_type_of<int64_t> = ComponentType::i64;
template <>
constexpr ComponentType component_type_of<uint64_t> = ComponentType::u64;
template <>
constexpr ComponentType component_type_of<float> = ComponentType::f32;

// A row of values along x, in a file named "f".
template <class T>
Result<LoadedVolume> narrowed(std::vector<T> values, VolumeKind kind = VolumeKind::values,
                              std::vector<Rescale> rescale = {}, uint32_t components = 1) {
    VoxelClaim claim;
    claim.size = {values.size() / components, 1, 1};
    claim.type = component_type_of<T>;
    claim.components = components;
    Decoded decoded;
    decoded.grid = make_grid(claim.size, {1, 1, 1});
    decoded.rescale = std::move(rescale);
    return narrow("f", decoded, claim, std::as_bytes(std::span(values)), kind, 1 << 30);
}

template <class T>
ScalarType type_of(std::vector<T> values, std::vector<Rescale> rescale = {}) {
    return narrowed(std::move(values), VolumeKind::values, std::move(rescale))->volume.type();
}

TEST(Narrow, TakesTheSmallestTypeThatHoldsEveryValue) {
    EXPECT_EQ(type_of<int32_t>({0, 255}), ScalarType::u8);
    EXPECT_EQ(type_of<int32_t>({0, 256}), ScalarType::u16);
    EXPECT_EQ(type_of<int32_t>({-128, 127}), ScalarType::i8);
    EXPECT_EQ(type_of<int32_t>({-1, 128}), ScalarType::i16);
    EXPECT_EQ(type_of<int32_t>({-129, 0}), ScalarType::i16);
    EXPECT_EQ(type_of<int32_t>({0, 65535}), ScalarType::u16);
    EXPECT_EQ(type_of<int32_t>({-1, 32768}), ScalarType::f32);
    EXPECT_EQ(type_of<int32_t>({-1024, 3071}), ScalarType::i16);
    EXPECT_EQ(type_of<double>({-1024.0, 3071.0}), ScalarType::i16);
    EXPECT_EQ(type_of<float>({0.0f, 0.5f}), ScalarType::f32);
    EXPECT_EQ(type_of<uint8_t>({0, 9}), ScalarType::u8);
    EXPECT_EQ(type_of<int16_t>({0, 9}), ScalarType::u8);
}

// Slices are shared among threads, whose findings are joined: enough of them that some are.
TEST(Narrow, CountsTheLeastAndLargestValueOfEverySlice) {
    constexpr uint32_t kSlices = 64, kInSlice = 4096;
    for (uint32_t z = 0; z < kSlices; ++z)
        for (const int32_t extreme : {-300, 300}) {
            std::vector<int32_t> values(size_t{kSlices} * kInSlice, 7);
            values[size_t{z} * kInSlice] = extreme;
            VoxelClaim claim;
            claim.size = {kInSlice, 1, kSlices};
            claim.type = ComponentType::i32;
            Decoded decoded;
            decoded.grid = make_grid(claim.size, {1, 1, 1});
            const auto loaded = narrow("f", decoded, claim, std::as_bytes(std::span(values)),
                                       VolumeKind::values, 1 << 30);
            ASSERT_TRUE(loaded);
            EXPECT_EQ(loaded->volume.type(), extreme < 0 ? ScalarType::i16 : ScalarType::u16) << z;
        }
}

TEST(Narrow, KeepsValuesExactlyAndSaysNothing) {
    const auto loaded = narrowed<double>({-1000.0, 0.0, 1234.0, 3.0});
    ASSERT_TRUE(loaded);
    EXPECT_THAT(loaded->warnings, IsEmpty());
    EXPECT_EQ(loaded->volume.value({0, 0, 0}), -1000.0f);
    EXPECT_EQ(loaded->volume.value({2, 0, 0}), 1234.0f);
    EXPECT_THAT(narrowed<double>({0.5, 0.25})->warnings, IsEmpty()); // exact in f32
}

TEST(Narrow, ReportsTheLargestRounding) {
    // Between 2^24 and 2^25 floats are 2 apart: odd numbers are off by 1.
    const auto loaded = narrowed<int32_t>({16777217, 5});
    ASSERT_TRUE(loaded);
    EXPECT_EQ(loaded->volume.type(), ScalarType::f32);
    EXPECT_THAT(loaded->warnings, ElementsAre(HasSubstr("rounds by at most 1")));
    // 2^53 + 1 is no double; the rounding must not be lost on the way. Floats are 2^30 apart here.
    const auto wide = narrowed<int64_t>({(int64_t{1} << 53) + 1, 5});
    EXPECT_THAT(wide->warnings, ElementsAre(HasSubstr("rounds by at most 1")));
    EXPECT_THAT(narrowed<uint64_t>({~uint64_t{0}, 5})->warnings,
                ElementsAre(HasSubstr("rounds by at most 1"))); // 2^64 - 1 becomes 2^64
}

TEST(Narrow, AppliesRescaleInDouble) {
    const auto hu = narrowed<uint16_t>({0, 1024, 4095}, VolumeKind::values, {{1.0, -1024.0}});
    EXPECT_EQ(hu->volume.type(), ScalarType::i16);
    EXPECT_EQ(hu->volume.value({0, 0, 0}), -1024.0f);
    EXPECT_EQ(hu->volume.range(), (ValueRange{-1024.0f, 3071.0f}));
    const auto half = narrowed<int16_t>({1, 3}, VolumeKind::values, {{0.5, 0.0}});
    EXPECT_EQ(half->volume.type(), ScalarType::f32);
    EXPECT_EQ(half->volume.value({1, 0, 0}), 1.5f);
}

TEST(Narrow, AppliesOneRescalePerSlice) {
    const std::vector<uint8_t> values{1, 1, 1};
    VoxelClaim claim{.size = {1, 1, 3}, .type = ComponentType::u8};
    Decoded decoded;
    decoded.grid = make_grid(claim.size, {1, 1, 1});
    decoded.rescale = {{1, 0}, {10, 0}, {100, 5}};
    const auto loaded =
        narrow("f", decoded, claim, std::as_bytes(std::span(values)), VolumeKind::values, 1 << 30);
    EXPECT_EQ(loaded->volume.value({0, 0, 0}), 1.0f);
    EXPECT_EQ(loaded->volume.value({0, 0, 1}), 10.0f);
    EXPECT_EQ(loaded->volume.value({0, 0, 2}), 105.0f);
}

TEST(Narrow, CountsNoData) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    const auto loaded = narrowed<float>({1.0f, nan, inf, -inf, 2.0f});
    ASSERT_TRUE(loaded);
    EXPECT_EQ(loaded->volume.type(), ScalarType::f32);
    EXPECT_EQ(loaded->volume.no_data_count(), 3u);
    EXPECT_EQ(loaded->volume.range(), (ValueRange{1.0f, 2.0f}));
    EXPECT_THAT(loaded->warnings, ElementsAre(HasSubstr("3 of 5 values")));
    const auto beyond = narrowed<double>({1.0, 1e300});
    EXPECT_EQ(beyond->volume.no_data_count(), 1u);
    EXPECT_THAT(beyond->warnings, ElementsAre(HasSubstr("beyond the range of f32")));
}

TEST(Narrow, LabelsAreWholeAndFit) {
    const auto label = [](auto values) { return narrowed(std::move(values), VolumeKind::labels); };
    EXPECT_EQ(label(std::vector<double>{0, 255})->volume.type(), ScalarType::u8);
    EXPECT_EQ(label(std::vector<int64_t>{0, 256})->volume.type(), ScalarType::u16);
    EXPECT_EQ(label(std::vector<float>{0, 65535})->volume.type(), ScalarType::u16);
    EXPECT_THAT(label(std::vector<int32_t>{0, 65536}).error().message, HasSubstr("to 65536"));
    EXPECT_THAT(label(std::vector<int16_t>{-1, 3}).error().message, HasSubstr("from -1"));
    EXPECT_THAT(label(std::vector<float>{0, 1.5f}).error().message, HasSubstr("fractions"));
    EXPECT_THAT(label(std::vector<float>{0, NAN}).error().message, HasSubstr("not finite"));
}

TEST(Narrow, ComponentsMustAgree) {
    const auto grey = narrowed<uint8_t>({5, 5, 5, 9, 9, 9}, VolumeKind::values, {}, 3);
    ASSERT_TRUE(grey);
    EXPECT_EQ(grey->volume.value({1, 0, 0}), 9.0f);
    EXPECT_THAT(grey->warnings, ElementsAre(HasSubstr("3 components")));
    EXPECT_THAT(narrowed<uint8_t>({5, 5, 5, 9, 8, 9}, VolumeKind::values, {}, 3).error().message,
                HasSubstr("3 components"));
}

TEST(Narrow, HoldsEverySampleOfAnOddSize) {
    VoxelClaim claim{.size = {70, 33, 65}, .type = ComponentType::i32};
    Decoded decoded;
    decoded.grid = make_grid(claim.size, {0.5, 0.5, 3});
    std::vector<int32_t> values(sample_count(decoded.grid));
    for (size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<int32_t>(i * 2654435761u % 60000) - 30000;
    const auto loaded =
        narrow("f", decoded, claim, std::as_bytes(std::span(values)), VolumeKind::values, 1 << 30);
    ASSERT_TRUE(loaded);
    EXPECT_EQ(loaded->volume.type(), ScalarType::i16);
    size_t i = 0;
    for (uint32_t z = 0; z < 65; ++z)
        for (uint32_t y = 0; y < 33; ++y)
            for (uint32_t x = 0; x < 70; ++x)
                ASSERT_EQ(loaded->volume.value({x, y, z}), values[i++]);
}

} // namespace
} // namespace palpate::io
