// Commands on inputs made after what users of other programs reported: results that the README of
// shared/data/reported states. What files are read as is checked in tests/unit/io_shared and
// io_formats.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <nlohmann/json.hpp>

#include "engine/image/image.h"
#include "engine/image/png.h"
#include "engine/io/volume_io.h"
#include "engine/volume/grid.h"
#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

const std::string kReported = std::string(kSharedData) + "/reported";

class ReportedShared : public ProgramTest {
 protected:
    void SetUp() override {
        if (!std::filesystem::is_directory(kReported))
            GTEST_SKIP() << "the folder of shared data is absent: " << kReported;
    }
    std::string path(const std::string& name) const { return file(name).string(); }
    void expect_done(const std::vector<std::string>& arguments) const {
        const ProgramRun ran = run(arguments);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    }
    // Dice of label 1 of a result and of the samples of a volume between two values.
    double dice_of_values(const std::string& result, const std::string& volume, const char* low,
                          const char* high) const {
        expect_done({"segment", volume, "--method", "threshold", "--low", low, "--high", high, "-o",
                     path("truth.nii.gz")});
        return dice(result, path("truth.nii.gz"));
    }
    double dice(const std::string& result, const std::string& truth) const {
        const ProgramRun ran = run({"compare", result, truth, "--labels", "--share", "1"});
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return ran.exit_code == 0
                   ? nlohmann::json::parse(ran.output)["overall"]["dice"].get<double>()
                   : 0.0;
    }
};

TEST_F(ReportedShared, AStrokeDrawsALabelBeyondTheMapsType) {
    expect_done({"edit", kReported + "/labels/u16_max200.nii.gz", kReported + "/labels/l300.jsonl",
                 "-o", path("out.nii.gz")});
    const Result<LoadedVolume> labels = load_labels(file("out.nii.gz"));
    ASSERT_TRUE(labels) << labels.error().message;
    EXPECT_EQ(labels->volume.range().max, 300.0f);
}

// A bright background is not what one looks for: by default the ball (600) and its core (300) are
// seen beside it and beside each other, in a slice and in a MIP. A window of all values, 300 to
// 3000, sets them a ninth of the grey levels apart, so that they lie in different sixteenths.
TEST_F(ReportedShared, TheBallInABrightBackgroundIsSeenByDefault) {
    for (const std::string name : {"bright_outside", "bright_outside_noise"})
        for (const auto& view : {std::vector<std::string>{"--slice", "axial"},
                                 std::vector<std::string>{"--mode", "mip", "--view", "top"}}) {
            SCOPED_TRACE(name + " " + view[0]);
            std::vector<std::string> all{
                "render", kReported + "/default_window/" + name + ".nii.gz",
                "--size", "128,128",
                "-o",     path("v.png")};
            all.insert(all.end(), view.begin(), view.end());
            expect_done(all);
            const Result<Image> picture = load_png(file("v.png"));
            ASSERT_TRUE(picture) << picture.error().message;
            std::vector<int> counts(16, 0); // pixels of each sixteenth of the grey levels
            for (uint32_t y = 0; y < 128; ++y)
                for (uint32_t x = 0; x < 128; ++x)
                    ++counts[std::min(15u, static_cast<uint32_t>(16.0f * picture->at(x, y, 0)))];
            EXPECT_GE(std::count_if(counts.begin(), counts.end(), [](int n) { return n > 163; }),
                      3) // 1 %
                << ::testing::PrintToString(counts);
        }
}

TEST_F(ReportedShared, FastMarchingTakesTheWholeBallFromAnySeed) {
    const std::string ball = kReported + "/seeds/n0.nii.gz";
    for (const char* seeds : {"s3", "s1"}) {
        expect_done({"segment", ball, "--method", "fast-marching", "--seeds",
                     kReported + "/seeds/" + seeds + ".json", "-o", path("out.nii.gz")});
        EXPECT_GE(dice_of_values(path("out.nii.gz"), ball, "100", "300"), 0.95) << seeds;
    }
}

TEST_F(ReportedShared, ALiveWireFollowsAStepEdge) {
    expect_done({"segment", kReported + "/live_wire_step/ball.nii.gz", "--method",
                 "live-wire-surface", "--seeds", kReported + "/live_wire_step/circles.json", "-o",
                 path("out.nii.gz")});
    EXPECT_GE(dice(path("out.nii.gz"), kReported + "/live_wire_step/ball_truth.nii.gz"), 0.97);
}

// The ball's edge (100 of 0 to 200) lies 14 mm from (11.5, -40.25, 77.125): least squares of the
// places where values pass 100 on the lines between samples, which miss it by 0.012 mm at most.
TEST_F(ReportedShared, DistancesOfALevelSetAreRight) {
    expect_done({"segment", kReported + "/level_set_distance/edge.nii.gz", "--method", "level-set",
                 "--low", "100", "--high", "300", "--seeds",
                 kReported + "/level_set_distance/ball.json", "--distance", path("d.nrrd"), "-o",
                 path("out.nii.gz")});
    const Result<LoadedVolume> distance = load_volume(file("d.nrrd"));
    ASSERT_TRUE(distance) << distance.error().message;
    const Volume& d = distance->volume;
    double squares = 0.0, count = 0.0;
    for (uint32_t z = 0; z < d.size().z; ++z)
        for (uint32_t y = 0; y < d.size().y; ++y)
            for (uint32_t x = 0; x < d.size().x; ++x) {
                const glm::dvec3 at = world_point(d.grid(), {x, y, z});
                const double expected = glm::distance(at, {11.5, -40.25, 77.125}) - 14.0;
                if (std::abs(expected) > 1.9) // told to two of the smallest spacings, 2 mm
                    continue;
                const double off = d.value({x, y, z}) - expected;
                squares += off * off, ++count;
            }
    EXPECT_GT(count, 1000.0);
    EXPECT_LE(std::sqrt(squares / count), 0.1);
}

TEST_F(ReportedShared, AnAreaOfALabelOneSampleThickHasANote) {
    const ProgramRun ran = run(
        {"measure", kReported + "/other/vol.nii.gz", "--labels", kReported + "/other/lab.nii.gz"});
    EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.output, ::testing::HasSubstr("one sample thick"));
    EXPECT_THAT(ran.output, ::testing::Not(::testing::HasSubstr("nan")));
}

} // namespace
} // namespace palpate
