#include "engine/io/brick_file.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <set>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "engine/volume/changes.h"
#include "engine/volume/compare.h"
#include "engine/volume/edit.h"
#include "engine/volume/sample.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/brick_file/coarser.h"

namespace palpate {
namespace {

double hashed(glm::uvec3 i) {
    return static_cast<double>((i.x * 73856093u ^ i.y * 19349663u ^ i.z * 83492791u) % 251) - 100.0;
}

// Noise, one constant brick, and a gap in the data where the type has one.
Volume odd_volume(ScalarType type) {
    glm::dmat4 oblique(1);
    oblique[0] = glm::dvec4(0.4, 0.3, 0.0, 0.0);
    oblique[1] = glm::dvec4(-0.3, 0.4, 0.1, 0.0);
    oblique[2] = glm::dvec4(0.0, -0.2, -3.0, 0.0);
    oblique[3] = glm::dvec4(1e6, -7.0, 3.0, 1.0);
    return make_volume(Grid{{150, 70, 66}, oblique}, type, [&](glm::uvec3 i) {
        if (i.x >= 64 && i.x < 96 && i.y < 32 && i.z < 32)
            return 42.0;
        if (type == ScalarType::f32 && i.x == 5)
            return static_cast<double>(NAN);
        return hashed(i);
    });
}

class BrickFileTest : public TemporaryFolder {
 protected:
    static void expect_same(const Volume& a, const Volume& b) {
        ASSERT_EQ(a.grid(), b.grid());
        ASSERT_EQ(a.type(), b.type());
        EXPECT_EQ(a.range(), b.range());
        EXPECT_EQ(a.no_data_count(), b.no_data_count());
        EXPECT_TRUE(changed_bricks(a, b).empty()); // padding, too
        for_each_brick(a, [&](glm::uvec3 p) {
            ASSERT_EQ(a.brick(p).range(), b.brick(p).range());
            ASSERT_EQ(a.brick(p).is_constant(), b.brick(p).is_constant());
            for (uint32_t block = 0; block < kBlocksPerBrick; ++block)
                ASSERT_EQ(a.brick(p).block_range(block), b.brick(p).block_range(block));
        });
    }
};

TEST_F(BrickFileTest, HoldsEveryTypeBitForBit) {
    for (const ScalarType type :
         {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16, ScalarType::f32}) {
        SCOPED_TRACE(name_of(type));
        const Volume volume = odd_volume(type);
        BrickStream stream = stream_of(volume);
        stream.modality = "CT";
        ASSERT_TRUE(save_brick_file(file("v.pbv"), stream));
        const Result<BrickFile> read = open_brick_file(file("v.pbv"));
        ASSERT_TRUE(read) << read.error().message;
        expect_same(volume, read->volume);
        EXPECT_EQ(read->modality, "CT");
        EXPECT_FALSE(read->labels);
    }
}

TEST_F(BrickFileTest, LevelsAreThoseOfThePyramid) {
    Volume level = odd_volume(ScalarType::i16);
    for (const bool labels : {false, true}) {
        BrickStream stream = stream_of(level);
        stream.labels = labels;
        ASSERT_TRUE(save_brick_file(file("v.pbv"), stream));
        const Result<BrickFile> read = open_brick_file(file("v.pbv"));
        ASSERT_TRUE(read) << read.error().message;
        ASSERT_EQ(read->coarser.size() + 1, level_count(level.size()));
        Volume expected = level;
        for (const Volume& coarse : read->coarser) {
            expected = coarser_volume(expected, labels ? Reduction::first : Reduction::mean);
            expect_same(expected, coarse);
        }
        EXPECT_EQ(read->labels, labels);
    }
}

TEST_F(BrickFileTest, OpeningReadsNoSamplesAndReadingKeepsToItsBudget) {
    const Volume volume = odd_volume(ScalarType::i16);
    ASSERT_TRUE(save_brick_file(file("v.pbv"), stream_of(volume)));
    const uint64_t budget = 4 * kBrickSamples * 2;
    const Result<BrickFile> read = open_brick_file(file("v.pbv"), budget);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->volume.range(), volume.range());
    EXPECT_EQ(read->cache().misses, 0u);
    EXPECT_TRUE(compare_volumes(volume, read->volume, 0.0)->max_abs == 0.0);
    EXPECT_LE(read->cache().held_bytes, budget);
    EXPECT_GT(read->cache().dropped, 0u);
    EXPECT_LT(read->volume.bytes(), sample_count(volume.grid()) / 4);
}

TEST_F(BrickFileTest, EveryReaderGetsTheSameSamples) {
    const Volume volume = odd_volume(ScalarType::u16);
    ASSERT_TRUE(save_brick_file(file("v.pbv"), stream_of(volume)));
    const Result<BrickFile> read = open_brick_file(file("v.pbv"), 0); // one brick at a time
    ASSERT_TRUE(read) << read.error().message;
    SampleCursor a(volume), b(read->volume);
    for (uint32_t i = 0; i < 2000; ++i) {
        const glm::dvec3 p(i * 37 % 149 + 0.25, i * 11 % 69 + 0.5, i * 7 % 65 + 0.75);
        ASSERT_EQ(a.value(p), b.value(p));
        ASSERT_EQ(a.gradient(p), b.gradient(p));
        ASSERT_EQ(volume.value(glm::uvec3(p)), read->volume.value(glm::uvec3(p)));
    }
}

TEST_F(BrickFileTest, AnEditSharesWhatStaysInTheFile) {
    const Volume volume = odd_volume(ScalarType::i16);
    ASSERT_TRUE(save_brick_file(file("v.pbv"), stream_of(volume)));
    const Result<BrickFile> read = open_brick_file(file("v.pbv"));
    ASSERT_TRUE(read) << read.error().message;
    VolumeEdit edit(read->volume);
    edit.set({40, 3, 64}, 3000.0);
    const Volume after = edit.commit();
    EXPECT_EQ(after.value({40, 3, 64}), 3000.0f);
    EXPECT_EQ(after.value({41, 3, 64}), volume.value({41, 3, 64}));
    EXPECT_EQ(changed_bricks(read->volume, after).size(), 1u);
    EXPECT_TRUE(after.brick({0, 0, 0}).is_in_source());
    EXPECT_FALSE(after.brick({1, 0, 2}).is_in_source());
}

TEST_F(BrickFileTest, TheSameSamplesGiveTheSameFile) {
    const Volume volume = odd_volume(ScalarType::i16);
    ASSERT_TRUE(save_brick_file(file("a.pbv"), stream_of(volume)));
    ASSERT_TRUE(save_volume(file("b.pbv"), volume));
    EXPECT_EQ(bytes_of("a.pbv"), bytes_of("b.pbv"));
    const Result<LoadedVolume> read = load_volume(file("a.pbv"));
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_TRUE(save_volume(file("c.pbv"), read->volume)); // from the file itself
    EXPECT_EQ(bytes_of("a.pbv"), bytes_of("c.pbv"));
}

TEST_F(BrickFileTest, AsksForEachBrickOnceAndSaysHowFarItIs) {
    const Volume volume = odd_volume(ScalarType::i16);
    std::array<std::atomic<int>, 5 * 3 * 3> asked{};
    BrickStream stream = stream_of(volume);
    stream.brick = [&](glm::uvec3 p) {
        ++asked[p.x + 5 * (p.y + 3 * p.z)];
        return volume.brick_ptr(p);
    };
    double last = 0;
    ASSERT_TRUE(save_brick_file(file("v.pbv"), stream, {{}, [&](double share) {
                                                            EXPECT_GT(share, last);
                                                            last = share;
                                                        }}));
    EXPECT_EQ(last, 1.0);
    for (const auto& count : asked)
        EXPECT_EQ(count, 1);
}

TEST_F(BrickFileTest, StoppedLeavesNothing) {
    const Volume volume = odd_volume(ScalarType::i16);
    std::stop_source stop;
    BrickStream stream = stream_of(volume);
    stream.brick = [&](glm::uvec3 p) {
        stop.request_stop();
        return volume.brick_ptr(p);
    };
    const Result<void> saved = save_brick_file(file("v.pbv"), stream, {stop.get_token(), {}});
    ASSERT_FALSE(saved);
    EXPECT_NE(saved.error().message.find("stopped"), std::string::npos);
    EXPECT_TRUE(std::filesystem::is_empty(file("").parent_path()));
}

TEST_F(BrickFileTest, LabelsMustBeOfALabelType) {
    ASSERT_TRUE(save_volume(file("v.pbv"), odd_volume(ScalarType::i16)));
    const Result<LoadedVolume> refused = load_labels(file("v.pbv"));
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("expected labels of type u8 or u16, found i16"),
              std::string::npos);
    ASSERT_TRUE(save_volume(file("l.pbv"), odd_volume(ScalarType::u8)));
    EXPECT_TRUE(load_labels(file("l.pbv")));
}

} // namespace
} // namespace palpate
