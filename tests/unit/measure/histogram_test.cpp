#include "engine/measure/histogram.h"

#include <gtest/gtest.h>

#include "engine/volume/edit.h"
#include "tests/unit/measure/grids.h"

namespace palpate {
namespace {

std::vector<uint64_t> counted(const Volume& volume, double low, double high, size_t bins) {
    std::vector<uint64_t> counts(bins);
    for_each_sample(volume.grid(), [&](glm::uvec3 at) {
        const double v = double{volume.value(at)};
        if (std::isnan(v))
            return;
        double bin = std::floor((v - low) / ((high - low) / static_cast<double>(bins)));
        bin = std::min(std::max(bin, 0.0), static_cast<double>(bins) - 1.0);
        ++counts[static_cast<size_t>(bin)];
    });
    return counts;
}

TEST(Histogram, CountsEverySampleOnce) {
    const Volume volume = noise_volume(make_grid({70, 40, 33}, glm::dvec3(1)));
    Histogram histogram(-500.0, 1500.0, 100); // values reach beyond both ends
    ASSERT_TRUE(histogram.count(volume));
    EXPECT_EQ(histogram.counts(), counted(volume, -500.0, 1500.0, 100));
    const Volume gaps = make_volume(make_grid({40, 3, 3}, glm::dvec3(1)), ScalarType::f32,
                                    [](glm::uvec3 i) { return i.x % 2 ? i.x : std::nan(""); });
    ASSERT_TRUE(histogram.count(gaps));
    EXPECT_EQ(histogram.counts(), counted(gaps, -500.0, 1500.0, 100));
}

TEST(Histogram, FollowsEditsByTheBricksThatChanged) {
    Volume volume = make_volume(make_grid({100, 100, 100}, glm::dvec3(1)), ScalarType::u8,
                                [](glm::uvec3 i) { return (i.x / 7 + i.y / 5 + i.z) % 9; });
    Histogram labels = Histogram::of_labels();
    ASSERT_TRUE(labels.count(volume));
    EXPECT_EQ(labels.counts().size(), 65536u);
    EXPECT_EQ(labels.bin_of(7.0), 7u);
    std::mt19937 random(7);
    for (int i = 0; i < 20; ++i) {
        VolumeEdit edit(volume);
        for (int k = 0; k < 50; ++k)
            edit.set({random() % 100, random() % 100, 40 + random() % 8},
                     static_cast<float>(random() % 12));
        volume = edit.commit();
        const uint64_t before = labels.bricks_read();
        ASSERT_TRUE(labels.count(volume));
        EXPECT_LE(labels.bricks_read() - before, 2u * 16u); // of 64: one layer, before and after
    }
    Histogram fresh = Histogram::of_labels();
    ASSERT_TRUE(fresh.count(volume));
    EXPECT_EQ(labels.counts(), fresh.counts());
    EXPECT_EQ(labels.counts(), counted(volume, -0.5, 65535.5, 65536));
}

TEST(Histogram, BeginsAnewAfterItWasStopped) {
    const Volume volume = noise_volume(make_grid({70, 40, 33}, glm::dvec3(1)));
    Histogram histogram(-1000.0, 3000.0, 10);
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(histogram.count(volume, stop.get_token()));
    ASSERT_TRUE(histogram.count(volume));
    EXPECT_EQ(histogram.counts(), counted(volume, -1000.0, 3000.0, 10));
}

} // namespace
} // namespace palpate
