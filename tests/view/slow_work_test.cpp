// Work that takes long: how long it still takes, in words, and work on a part of the samples.

#include "apps/view/document/label_export.h"
#include "apps/view/document/segmentation.h"
#include "apps/view/panels/panels.h"
#include "apps/view/tools/clip_tool.h"
#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/task_session.h"

namespace palpate::view {
namespace {

TEST(TimeLeft, IsTheRestAtTheRateUntilNow) {
    EXPECT_EQ(time_left_text(0.5, 10.0), "about 10 s left");
    EXPECT_EQ(time_left_text(0.2, 10.0), "about 40 s left");
    EXPECT_EQ(time_left_text(0.1, 30.0), "about 5 min left"); // 270 s
    EXPECT_EQ(time_left_text(0.02, 600.0), "about 8 h left"); // 8.2 h
    EXPECT_EQ(time_left_text(0.999, 10.0), "about 1 s left");
}

TEST(TimeLeft, IsNotToldBeforeARateIsKnownAndAtTheEnd) {
    EXPECT_EQ(time_left_text(0.0, 100.0), "");
    EXPECT_EQ(time_left_text(0.01, 100.0), "");
    EXPECT_EQ(time_left_text(0.5, 1.0), "");
    EXPECT_EQ(time_left_text(1.0, 100.0), "");
}

class Region : public Task {
 protected:
    const Volume volume_ = skull(41, 2.0);
};

// A crop box begins a tenth in from each face: samples 4 .. 36 of 41.
TEST_F(Region, OfACropBoxIsItsSamples) {
    ViewState state;
    set_crop_box(state, volume_.grid());
    const auto kept = kept_samples(volume_.grid(), state.notes.clip_planes);
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->low, glm::ivec3(4));
    EXPECT_EQ(kept->high, glm::ivec3(36));
}

// One plane across x, of which the side of larger x is kept.
TEST_F(Region, OfOnePlaneReachesToTheFaces) {
    const std::vector<ClipPlane> planes{{world_point(volume_.grid(), {20.5, 7, 9}), {1, 0, 0}}};
    const auto kept = kept_samples(volume_.grid(), planes);
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->low, glm::ivec3(21, 0, 0));
    EXPECT_EQ(kept->high, glm::ivec3(40));
    const std::vector<ClipPlane> none{{world_point(volume_.grid(), {50, 7, 9}), {1, 0, 0}}};
    EXPECT_FALSE(kept_samples(volume_.grid(), none));
}

// A method that looks at each sample alone finds in the region what it finds in all, and nothing
// outside; a strength has the grid of all.
TEST_F(Region, HasTheResultOfTheMethodAndNothingLiesOutside) {
    const glm::ivec3 low(3, 8, 11), high(22, 40, 33);
    SegmentJob job{.method = find_segment_method("threshold"),
                   .given = {{"low", 300.0}},
                   .volume = volume_,
                   .labels = label_map(volume_, [](glm::uvec3) { return 0; })};
    job.region = {low, high};
    SegmentRun run(job, false);
    const auto done = run.take();
    ASSERT_TRUE(done && *done);
    const Volume& labels = (*done)->labels;
    ASSERT_EQ(labels.grid(), volume_.grid());
    size_t found = 0;
    for (uint32_t z = 0; z < 41; ++z)
        for (uint32_t y = 0; y < 41; ++y)
            for (uint32_t x = 0; x < 41; ++x) {
                const glm::ivec3 at(x, y, z);
                const bool inside = glm::all(glm::greaterThanEqual(at, low)) &&
                                    glm::all(glm::lessThanEqual(at, high));
                const bool is_bone = volume_.value(glm::uvec3(at)) >= 300.0f;
                EXPECT_EQ(labels.value(glm::uvec3(at)), inside && is_bone ? 1.0f : 0.0f);
                found += inside && is_bone;
            }
    EXPECT_GT(found, 1000u);
}

TEST_F(Region, KeepsAStrengthOnTheGridOfAll) {
    const auto seeds = label_map(volume_, [](glm::uvec3 at) { return at == glm::uvec3(20); });
    SegmentJob job{.method = find_segment_method("fuzzy-connectedness"),
                   .given = {{"threshold", 0.5}, {"homogeneity", 30.0}},
                   .volume = volume_,
                   .labels = label_map(volume_, [](glm::uvec3) { return 0; }),
                   .seeds = seeds,
                   .label = 1};
    job.region = {glm::ivec3(10), glm::ivec3(30)};
    SegmentRun run(job, false);
    const auto done = run.take();
    ASSERT_TRUE(done);
    ASSERT_TRUE(*done) << done->error().message;
    ASSERT_TRUE((*done)->strength);
    EXPECT_EQ((*done)->strength->volume.grid(), volume_.grid());
    EXPECT_EQ((*done)->labels.value(glm::uvec3(20)), 1.0f);
    EXPECT_EQ((*done)->labels.value(glm::uvec3(5)), 0.0f);
}

class EachLabel : public TemporaryFolder {};

// Two balls, whose files hold their own volumes: a surface lies within half a sample of each.
TEST_F(EachLabel, HasItsSurfaceInAFileOfItsOwn) {
    const Grid grid = make_grid(glm::uvec3(40, 24, 24), glm::dvec3(1.0));
    const Volume labels = make_volume(grid, ScalarType::u8, [](glm::uvec3 at) {
        return glm::distance(glm::dvec3(at), glm::dvec3(10, 12, 12)) <= 7.0   ? 1.0
               : glm::distance(glm::dvec3(at), glm::dvec3(28, 12, 12)) <= 9.0 ? 4.0
                                                                              : 0.0;
    });
    const Result<std::string> told =
        export_each_label(labels, file("organs.stl"), {}, {{1, "left/kidney", {}}});
    ASSERT_TRUE(told) << told.error().message;
    const std::pair<const char*, double> files[] = {{"organs-left_kidney.stl", 7.0},
                                                    {"organs-4.stl", 9.0}};
    for (const auto& [name, radius_mm] : files) {
        const Result<LoadedMesh> read = load_mesh(file(name));
        ASSERT_TRUE(read) << read.error().message;
        const MeshTopology found = topology(read->mesh);
        EXPECT_TRUE(found.closed);
        EXPECT_GT(found.volume_mm3, 4.0 / 3.0 * M_PI * std::pow(radius_mm - 0.5, 3));
        EXPECT_LT(found.volume_mm3, 4.0 / 3.0 * M_PI * std::pow(radius_mm + 0.5, 3));
    }
    EXPECT_FALSE(export_each_label(labels, file("organs.nii.gz"), {}));
}

} // namespace
} // namespace palpate::view
