#include "engine/volume/edit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "engine/volume/builder.h"
#include "engine/volume/changes.h"

namespace palpate {
namespace {

// A volume as a flat array of floats: slow, and obviously right.
struct Flat {
    glm::uvec3 size;
    std::vector<float> samples;

    float& at(glm::uvec3 i) { return samples[i.x + size.x * (i.y + size_t{size.y} * i.z)]; }
};

uint32_t bits(float value) {
    return std::bit_cast<uint32_t>(value);
}

template <class Visit>
void for_each_sample(glm::uvec3 size, const Visit& visit) {
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                visit(glm::uvec3(x, y, z));
}

void expect_same(const Volume& volume, Flat& flat) {
    ValueRange range;
    uint64_t no_data = 0;
    for_each_sample(flat.size, [&](glm::uvec3 i) {
        const float expected = flat.at(i);
        ASSERT_EQ(bits(volume.value(i)), bits(expected)) << i.x << " " << i.y << " " << i.z;
        expected == expected ? range.include(expected) : void(++no_data);
    });
    EXPECT_EQ(volume.range(), range);
    EXPECT_EQ(volume.no_data_count(), no_data);
}

// Every sample of every brick, those beyond the volume repeating the outermost inside.
std::vector<ChangedBrick> changes_by_brute_force(Flat& before, Flat& after) {
    std::vector<ChangedBrick> changed;
    const glm::uvec3 bricks = (before.size + (kBrickSide - 1)) / kBrickSide;
    for_each_sample(bricks, [&](glm::uvec3 position) {
        uint64_t blocks = 0;
        for_each_sample(glm::uvec3(kBrickSide), [&](glm::uvec3 local) {
            const glm::uvec3 i = glm::min(position * kBrickSide + local, before.size - 1u);
            if (bits(before.at(i)) != bits(after.at(i)))
                blocks |= uint64_t{1} << block_of(local);
        });
        if (blocks)
            changed.push_back({position, blocks});
    });
    return changed;
}

// All samples of other values lie in the boxes, and on each of a box's six sides one of them does.
void expect_close(const std::vector<ChangedBox>& boxes, Flat& before, Flat& after) {
    size_t differing = 0, held = 0;
    const auto differs = [&](glm::uvec3 i) {
        const float a = before.at(i), b = after.at(i);
        return !(a == b || (std::isnan(a) && std::isnan(b)));
    };
    for_each_sample(before.size, [&](glm::uvec3 i) { differing += differs(i); });
    for (const ChangedBox& box : boxes) {
        glm::ivec3 low(std::numeric_limits<int>::max()), high(-1);
        for_each_sample(glm::uvec3(box.last - box.first + 1), [&](glm::uvec3 i) {
            if (!differs(glm::uvec3(box.first) + i))
                return;
            ++held;
            low = glm::min(low, box.first + glm::ivec3(i));
            high = glm::max(high, box.first + glm::ivec3(i));
        });
        EXPECT_EQ(low, box.first);
        EXPECT_EQ(high, box.last);
    }
    EXPECT_EQ(held, differing);
}

// The value that a type stores: rounded to nearest even, clamped; no data is one NaN.
float stored(ScalarType type, double value) {
    return visit_scalar(type, [&](auto t) {
        using T = decltype(t);
        if constexpr (std::is_same_v<T, float>) {
            const auto f = static_cast<float>(value);
            return std::isfinite(f) ? f : std::numeric_limits<float>::quiet_NaN();
        } else {
            const double low = std::numeric_limits<T>::min(), high = std::numeric_limits<T>::max();
            return static_cast<float>(static_cast<T>(std::clamp(std::nearbyint(value), low, high)));
        }
    });
}

struct Case {
    ScalarType type;
    glm::uvec3 size;
};

std::vector<Case> cases() {
    std::vector<Case> all;
    for (const ScalarType type :
         {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16, ScalarType::f32})
        for (const glm::uvec3 size : {glm::uvec3(1), glm::uvec3(1, 40, 1), glm::uvec3(33, 1, 65),
                                      glm::uvec3(37, 41, 33), glm::uvec3(161, 33, 3)})
            all.push_back({type, size});
    return all;
}

class RandomEdits : public testing::TestWithParam<size_t> {};

TEST_P(RandomEdits, EqualAFlatArray) {
    const Case test = cases()[GetParam()];
    std::mt19937_64 random(GetParam());
    const auto below = [&](uint32_t n) { return static_cast<uint32_t>(random() % n); };
    const auto any_index = [&] {
        return glm::uvec3(below(test.size.x), below(test.size.y), below(test.size.z));
    };
    const auto any_value = [&]() -> double {
        switch (below(12)) {
            case 0:
                return 1e6;
            case 1:
                return -1e6;
            case 2: // for integers, a half to round
                return test.type == ScalarType::f32 ? INFINITY : 2.5;
            case 3:
                return test.type == ScalarType::f32 ? -NAN : 3.5;
            default:
                return below(4000) * 0.125 - 200.0;
        }
    };
    Flat flat{test.size, std::vector<float>(size_t{test.size.x} * test.size.y * test.size.z)};
    for_each_sample(test.size,
                    [&](glm::uvec3 i) { flat.at(i) = stored(test.type, i.x + 2.0 * i.y); });
    const Volume first = make_volume(make_grid(test.size, {1, 1, 1}), test.type,
                                     [&](glm::uvec3 i) { return i.x + 2.0 * i.y; });
    Flat first_flat = flat;
    Volume volume = first;
    expect_same(volume, flat);

    for (int transaction = 0; transaction < 40; ++transaction) {
        Flat before = flat;
        VolumeEdit edit(volume);
        for (uint32_t writes = below(12); writes > 0; --writes) { // none, now and then
            const glm::uvec3 from = any_index();
            const glm::uvec3 to = below(4) ? from : glm::min(from + below(12), test.size - 1u);
            const double value = any_value();
            for_each_sample(to - from + 1u, [&](glm::uvec3 i) {
                edit.set(from + i, value);
                flat.at(from + i) = stored(test.type, value);
            });
        }
        const glm::uvec3 probe = any_index();
        ASSERT_EQ(std::isnan(edit.value(probe)), std::isnan(flat.at(probe)));
        const Volume after = edit.commit();
        expect_same(after, flat);
        if (HasFatalFailure())
            return;

        const std::vector<ChangedBrick> expected = changes_by_brute_force(before, flat);
        ASSERT_EQ(changed_bricks(volume, after), expected);
        ASSERT_EQ(changed_bricks(after, volume), expected);
        std::vector<ChangedBox> boxes;
        for (const ChangedBrick& brick : expected)
            for (const ChangedBox& box : changed_boxes(volume, after, brick))
                boxes.push_back(box);
        expect_close(boxes, before, flat);
        ASSERT_EQ(after.is_same_as(volume), expected.empty());
        ASSERT_EQ(after.version() > volume.version(), !expected.empty());
        for_each_brick(after, [&](glm::uvec3 p) {
            bool changed = false;
            for (const ChangedBrick& c : expected)
                changed = changed || c.position == p;
            ASSERT_EQ(after.brick_ptr(p) != volume.brick_ptr(p), changed);
        });
        volume = after;
    }
    expect_same(first, first_flat); // the first snapshot is as it was
}

INSTANTIATE_TEST_SUITE_P(AllTypesAndOddSizes, RandomEdits,
                         testing::Range(size_t{0}, cases().size()), [](const auto& test) {
                             const Case c = cases()[test.param];
                             return std::string(name_of(c.type)) + "_" + std::to_string(c.size.x) +
                                    "x" + std::to_string(c.size.y) + "x" + std::to_string(c.size.z);
                         });

// Stamps of blocks: kept where nothing changed, through any number of edits; never met again where
// something did, not even when the samples are what they once were.
TEST(VolumeEdit, BlocksKeepTheirStampsUntilTheyChange) {
    const Volume base =
        make_volume(make_grid(glm::uvec3(40), glm::dvec3(1.0)), ScalarType::i16,
                    [](glm::uvec3 i) { return static_cast<double>(i.x + 3 * i.y + 7 * i.z); });
    std::mt19937 random(3);
    Volume now = base;
    std::vector<Volume> kept{base};
    for (int round = 0; round < 40; ++round) {
        VolumeEdit edit(now);
        for (int i = 0; i < 5; ++i)
            edit.set({random() % 40, random() % 40, random() % 40},
                     round % 4 == 3 ? 0.0 : static_cast<double>(random() % 3));
        kept.push_back(now = edit.commit());
    }
    for (const Volume& a : kept)
        for (const Volume& b : kept)
            for_each_brick(a, [&](glm::uvec3 position) {
                const Brick& x = a.brick(position);
                const Brick& y = b.brick(position);
                const uint64_t changed = differing_blocks(x, y);
                for (uint32_t block = 0; block < kBlocksPerBrick; ++block) {
                    ASSERT_NE(x.block_stamp(block), 0u);
                    if (x.block_stamp(block) == y.block_stamp(block)) {
                        ASSERT_FALSE(changed >> block & 1);
                    }
                }
            });
    // One sample of one block: the 63 others of its brick, and all other bricks, keep theirs.
    VolumeEdit edit(now);
    edit.set({9, 17, 30}, 1234.0);
    const Volume next = edit.commit();
    int renewed = 0;
    for_each_brick(now, [&](glm::uvec3 position) {
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block)
            renewed +=
                now.brick(position).block_stamp(block) != next.brick(position).block_stamp(block);
    });
    EXPECT_EQ(renewed, 1);
}

TEST(VolumeEdit, WritesWholeBricksAndIgnoresWhatLiesBeyondTheVolume) {
    const Volume before = make_volume(make_grid({33, 2, 2}, {1, 1, 1}), ScalarType::i16,
                                      [](glm::uvec3) { return 5.0; });
    VolumeEdit edit(before);
    const std::span<int16_t> samples = edit.write_brick<int16_t>({1, 0, 0});
    ASSERT_EQ(samples.size(), kBrickSamples);
    for (size_t i = 0; i < samples.size(); ++i)
        if (i % kBrickSide != 0 || i / kBrickSide % kBrickSide > 1)
            samples[i] = 999; // outside
    EXPECT_TRUE(edit.commit().is_same_as(before));
    VolumeEdit second(before);
    second.write_brick<int16_t>({1, 0, 0})[offset_in_brick({0, 1, 1})] = -7;
    const Volume after = second.commit();
    EXPECT_EQ(after.value({32, 1, 1}), -7.0f);
    EXPECT_EQ(after.range(), (ValueRange{-7.0f, 5.0f}));
}

// Readers take the newest snapshot while a writer makes the next. Every snapshot is written as a
// whole: all samples of snapshot n are n, in bricks of several pages. Run it with preset tsan too.
TEST(VolumeEdit, ReadersSeeWholeSnapshotsWhileAnotherThreadEdits) {
    VolumeBuilder builder(make_grid({161, 3, 3}, {1, 1, 1}), ScalarType::u16);
    Volume newest = builder.finish();
    std::mutex mutex;
    std::atomic<bool> is_over{false};
    std::atomic<int> torn{0}, reads{0};
    const auto take = [&] {
        const std::lock_guard lock(mutex);
        return newest;
    };
    const auto reader = [&] {
        while (!is_over) {
            const Volume volume = take();
            const float expected = volume.range().max;
            for_each_brick(volume, [&](glm::uvec3 p) {
                torn += volume.brick(p).value(0) != expected;
                ++reads;
            });
        }
    };
    std::vector<std::thread> readers;
    for (int i = 0; i < 3; ++i)
        readers.emplace_back(reader);
    for (int n = 1; n <= 200 || reads < 1000; ++n) {
        VolumeEdit edit(take());
        for (uint32_t x = 0; x < 6; ++x)
            for (uint16_t& sample : edit.write_brick<uint16_t>({x, 0, 0}))
                sample = static_cast<uint16_t>(n);
        const Volume next = edit.commit();
        const std::lock_guard lock(mutex);
        newest = next;
    }
    is_over = true;
    for (std::thread& thread : readers)
        thread.join();
    EXPECT_EQ(torn, 0);
}

} // namespace
} // namespace palpate
