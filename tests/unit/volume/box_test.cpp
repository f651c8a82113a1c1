#include "engine/volume/box.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/volume/builder.h"

namespace palpate {
namespace {

// Constant bricks, bricks of many values, padding on two axes, and gaps in floats.
Volume sample_volume(ScalarType type) {
    const Grid grid = make_grid({71, 40, 64}, {0.5, 0.5, 3.0});
    return make_volume(grid, type, [&](glm::uvec3 i) {
        if (i.x >= 32 && i.x < 64)
            return 7.0;
        if (type == ScalarType::f32 && i.y == 33)
            return double{NAN};
        return double((i.x + 3 * i.y + 7 * i.z) % 101);
    });
}

bool is_same(double a, double b) {
    return a == b || (std::isnan(a) && std::isnan(b));
}

template <class Out>
void expect_nearest(const Volume& volume, glm::ivec3 first, glm::ivec3 size, BoxStrides strides) {
    constexpr Out kUntouched{99};
    std::vector<Out> out(size_t(size.z) * strides.plane + 9, kUntouched);
    read_box(volume, first, size, strides, out.data());
    std::vector<Out> wanted(out.size(), kUntouched);
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) {
                const glm::ivec3 at = glm::clamp(first + glm::ivec3(x, y, z), glm::ivec3(0),
                                                 glm::ivec3(volume.size()) - 1);
                wanted[size_t(x) + strides.row * size_t(y) + strides.plane * size_t(z)] =
                    static_cast<Out>(volume.value(glm::uvec3(at)));
            }
    for (size_t i = 0; i < out.size(); ++i)
        ASSERT_TRUE(is_same(double(out[i]), double(wanted[i])))
            << i << ": " << double(out[i]) << ", wanted " << double(wanted[i]);
}

TEST(ReadBox, GivesTheNearestSampleWithinTheVolumeAndNothingBetweenRows) {
    std::mt19937 random(21);
    std::uniform_int_distribution<int> start(-90, 90), length(0, 70), gap(0, 5);
    for (const ScalarType type : {ScalarType::u8, ScalarType::i16, ScalarType::f32}) {
        const Volume volume = sample_volume(type);
        for (int round = 0; round < 40; ++round) {
            const glm::ivec3 first(start(random), start(random), start(random));
            const glm::ivec3 size(length(random), length(random) / 4, length(random) / 8);
            const size_t row = size_t(size.x + gap(random));
            const BoxStrides strides{row, row * size_t(size.y) + size_t(gap(random))};
            expect_nearest<float>(volume, first, size, strides);
            expect_nearest<double>(volume, first, size, strides);
            if (type != ScalarType::f32)
                expect_nearest<int32_t>(volume, first, size, strides);
        }
    }
}

TEST(CopyBox, OutAndInAgainIsTheSameBox) {
    const Volume volume = sample_volume(ScalarType::i16);
    const glm::uvec3 first(20, 5, 30), size(47, 35, 5);
    const BoxStrides strides{50, 50 * 36 + 3};
    std::vector<int16_t> samples(strides.plane * 5, -5);
    ASSERT_TRUE(copy_out(volume, first, size, strides, std::span(samples)));
    EXPECT_EQ(samples[46 + 50 * 34 + strides.plane * 4], volume.value({66, 39, 34}));
    EXPECT_EQ(samples[47], -5); // between rows
    VolumeEdit edit(
        make_volume(volume.grid(), ScalarType::i16, [](glm::uvec3) { return -1000.0; }));
    const Volume empty = edit.base();
    ASSERT_TRUE(copy_in(edit, first, size, strides, std::span<const int16_t>(samples)));
    const Volume filled = edit.commit();
    for (uint32_t z = 28; z < 37; ++z)
        for (uint32_t y = 0; y < 40; ++y)
            for (uint32_t x = 0; x < 71; ++x) {
                const glm::uvec3 at(x, y, z);
                const bool inside = glm::all(glm::greaterThanEqual(at, first)) &&
                                    glm::all(glm::lessThan(at, first + size));
                ASSERT_EQ(filled.value(at), inside ? volume.value(at) : -1000.0f);
            }
    EXPECT_NE(filled.brick_ptr({0, 0, 0}), empty.brick_ptr({0, 0, 0}));
    EXPECT_EQ(filled.valid_in_brick({2, 1, 1}), glm::uvec3(7, 8, 32));
}

TEST(CopyBox, OfAPlaneSharesAllOtherBricks) {
    const Volume volume = sample_volume(ScalarType::u8);
    VolumeEdit edit(volume);
    const std::vector<uint8_t> plane(71 * 40, 200);
    ASSERT_TRUE(copy_in(edit, {0, 0, 63}, {71, 40, 1}, {71, 0}, std::span(plane)));
    const Volume after = edit.commit();
    EXPECT_EQ(after.brick_ptr({1, 0, 0}), volume.brick_ptr({1, 0, 0}));
    EXPECT_EQ(after.value({70, 39, 63}), 200.0f);
    EXPECT_EQ(after.value({70, 39, 62}), volume.value({70, 39, 62}));
}

TEST(CopyBox, SaysWhatDoesNotFit) {
    const Volume volume = sample_volume(ScalarType::i16);
    std::vector<int16_t> samples(1000);
    std::vector<float> floats(1000);
    const auto why = [](const Result<void>& result) {
        return result ? std::string() : result.error().message;
    };
    EXPECT_EQ(why(copy_out(volume, {0, 0, 0}, {1, 1, 1}, {}, std::span(floats))),
              "expected samples of the volume's type i16, found f32");
    EXPECT_EQ(why(copy_out(volume, {0, 0, 60}, {1, 1, 5}, {1, 1}, std::span(samples))),
              "expected a box within 0 .. 63 on axis 2, found 5 samples from 60");
    EXPECT_NE(why(copy_out(volume, {0, 40, 0}, {1, 1, 1}, {}, std::span(samples))), "");
    EXPECT_NE(why(copy_out(volume, {0, 0, 0}, {1, ~0u, 1}, {}, std::span(samples))), "");
    EXPECT_NE(why(copy_out(volume, {0, 0, 0}, {0, 1, 1}, {}, std::span(samples))), "");
    EXPECT_EQ(why(copy_out(volume, {0, 0, 0}, {10, 10, 10}, {10, 100}, std::span(samples))), "");
    EXPECT_EQ(why(copy_out(volume, {0, 0, 0}, {10, 10, 10}, {10, 101}, std::span(samples))),
              "expected an array that holds 10 x 10 x 10 samples with 10 from row to row and 101 "
              "from plane to plane, found 1000 elements");
    EXPECT_NE(why(copy_out(volume, {0, 0, 0}, {1, 3, 1}, {SIZE_MAX / 2, 0}, std::span(samples))),
              "");
}

TEST(VolumeOfArray, HasItsSamplesOrSaysWhatDoesNotFit) {
    std::vector<uint16_t> samples(40 * 3 * 2);
    for (size_t i = 0; i < samples.size(); ++i)
        samples[i] = static_cast<uint16_t>(3 * i);
    const std::span<const uint16_t> array(samples);
    const Grid grid = make_grid({35, 3, 2}, {0.5, 0.5, 3.0});
    const auto made = volume_of_array(grid, {40, 120}, array);
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(made->type(), ScalarType::u16);
    EXPECT_EQ(made->value({34, 2, 1}), 3.0f * (34 + 80 + 120));
    EXPECT_EQ(made->range().max, 3.0f * (34 + 80 + 120));
    EXPECT_FALSE(volume_of_array(grid, {40, 130}, array));
    EXPECT_FALSE(volume_of_array(make_grid({0, 3, 2}, glm::dvec3(1.0)), {40, 120}, array));
    EXPECT_FALSE(volume_of_array(make_grid({35, 3, 2}, {1.0, 0.0, 1.0}), {40, 120}, array));
    EXPECT_FALSE(volume_of_array(make_grid({35, 3, 2}, {1.0, NAN, 1.0}), {40, 120}, array));
}

} // namespace
} // namespace palpate
