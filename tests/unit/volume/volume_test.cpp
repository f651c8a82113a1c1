#include "engine/volume/volume.h"

#include <gtest/gtest.h>

#include "engine/volume/builder.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"
#include "engine/volume/sample.h"

namespace palpate {
namespace {

double hashed(glm::uvec3 i) {
    return static_cast<double>((i.x * 73856093u ^ i.y * 19349663u ^ i.z * 83492791u) % 4001) -
           1000.0;
}

const Grid kOddGrid = make_grid({70, 33, 65}, {0.5, 0.5, 3.0}, {-10.0, 20.0, 5.0});

TEST(Volume, HoldsEverySampleOfAnOddSize) {
    const Volume volume = make_volume(kOddGrid, ScalarType::i16, hashed);
    EXPECT_EQ(volume.brick_count(), glm::uvec3(3, 2, 3));
    for (uint32_t z = 0; z < 65; ++z)
        for (uint32_t y = 0; y < 33; ++y)
            for (uint32_t x = 0; x < 70; ++x)
                ASSERT_EQ(volume.value({x, y, z}), hashed({x, y, z}));
}

TEST(Volume, EditSharesEveryBrickItDidNotTouch) {
    const Volume before = make_volume(kOddGrid, ScalarType::i16, hashed);
    VolumeEdit edit(before);
    edit.set({40, 3, 64}, 3000.0);
    const Volume after = edit.commit();
    EXPECT_GT(after.version(), before.version());
    EXPECT_EQ(after.value({40, 3, 64}), 3000.0f);
    EXPECT_EQ(before.value({40, 3, 64}), hashed({40, 3, 64}));
    const std::vector<ChangedBrick> expected{{{1, 0, 2}, uint64_t{1} << 1}};
    // Sample (8, 3, 0) of its brick lies in block 1; the padding above repeats it.
    const auto changed = changed_bricks(before, after);
    ASSERT_EQ(changed.size(), 1u);
    EXPECT_EQ(changed[0].position, glm::uvec3(1, 0, 2));
    EXPECT_TRUE(changed[0].blocks & expected[0].blocks);
    for_each_brick(before, [&](glm::uvec3 p) {
        EXPECT_EQ(before.brick_ptr(p) == after.brick_ptr(p), p != glm::uvec3(1, 0, 2));
    });
}

TEST(Volume, EditThatChangesNothingIsTheSameSnapshot) {
    const Volume before = make_volume(kOddGrid, ScalarType::i16, hashed);
    VolumeEdit edit(before);
    edit.set({1, 1, 1}, hashed({1, 1, 1}));
    EXPECT_TRUE(edit.commit().is_same_as(before));
}

TEST(Volume, ConstantBricksStoreOneValue) {
    const Volume volume = make_volume(make_grid({512, 512, 64}, {1, 1, 1}), ScalarType::u16,
                                      [](glm::uvec3) { return 7.0; });
    EXPECT_TRUE(volume.brick({3, 3, 1}).is_constant());
    EXPECT_LT(volume.bytes(), 512u * 512u * 64u * 2u / 100u);
    EXPECT_EQ(volume.range(), (ValueRange{7.0f, 7.0f}));
}

TEST(Sample, TrilinearReproducesALinearField) {
    const Volume volume = make_volume(kOddGrid, ScalarType::f32, [](glm::uvec3 i) {
        return 2.0 * i.x - 3.0 * i.y + 0.5 * i.z + 1.0;
    });
    SampleCursor cursor(volume);
    for (const glm::dvec3 p : {glm::dvec3(0), glm::dvec3(31.5, 31.25, 31.75),
                               glm::dvec3(69, 32, 64), glm::dvec3(63.5, 0, 32)}) {
        EXPECT_DOUBLE_EQ(trilinear(volume, p), 2.0 * p.x - 3.0 * p.y + 0.5 * p.z + 1.0);
        EXPECT_EQ(trilinear(volume, p), cursor.value(p));
    }
    EXPECT_EQ(central_gradient(volume, {31.5, 16.0, 32.0}), glm::dvec3(2.0, -3.0, 0.5));
}

} // namespace
} // namespace palpate
