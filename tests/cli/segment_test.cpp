#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "engine/io/volume_io.h"
#include "engine/segment/methods.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

// A ball of 15 mm and value 100 in the middle of air of 0.
class SegmentCommand : public ProgramTest {
 protected:
    SegmentCommand() {
        const Grid grid = make_grid({40, 40, 20}, {1, 1, 2}, {-19.5, -19.5, -19});
        const Volume ball = synthetic::sample(synthetic::sphere({}, 15.0, 0.5, 100.0, 0.0), grid,
                                              ScalarType::i16, 3.0);
        EXPECT_TRUE(save_volume(file("v.nrrd"), ball));
        write("in.json", R"({"seeds": 1, "units": "mm",
            "balls": [{"label": 3, "center_mm": [0, 0, 0], "radius_mm": 5}]})");
    }
    std::string path(const std::string& name) const { return file(name).string(); }
    ProgramRun segment(std::vector<std::string> more) const {
        more.insert(more.begin(), {"segment", path("v.nrrd")});
        return run(more);
    }
    double volume_mm3(const std::string& name, uint16_t label) const {
        const Result<LoadedVolume> labels = load_labels(file(name));
        EXPECT_TRUE(labels);
        for (const LabelCount& count : label_counts(labels->volume))
            if (count.label == label)
                return 2.0 * double(count.count);
        return 0.0;
    }
};

constexpr double kBall_mm3 = 4.0 / 3.0 * 3.14159265 * 15 * 15 * 15;

TEST_F(SegmentCommand, FindsABallFromSeedsInAFileFromStrokesAndFromAResult) {
    const ProgramRun grown = segment({"--method", "region-growing", "--deviations", "6", "--seeds",
                                      path("in.json"), "-o", path("a.nii.gz")});
    ASSERT_EQ(grown.exit_code, 0) << grown.messages;
    EXPECT_EQ(grown.output, "");
    EXPECT_THAT(grown.messages, HasSubstr("label 3: values"));
    EXPECT_NEAR(volume_mm3("a.nii.gz", 3), kBall_mm3, 0.1 * kBall_mm3);

    write("s.jsonl",
          "{\"stroke\": 1, \"units\": \"mm\", \"shape\": {\"kind\": \"ball\", \"radius_mm\": 5}, "
          "\"operation\": {\"kind\": \"draw\", \"label\": 2}}\n"
          "{\"t_s\": 0, \"p_mm\": [0, 0, 0]}\n{\"t_s\": 1, \"p_mm\": [4, 0, 0]}\n");
    const ProgramRun stroked = segment({"--method", "region-growing", "--deviations", "6",
                                        "--seeds", path("s.jsonl"), "-o", path("b.nii.gz")});
    ASSERT_EQ(stroked.exit_code, 0) << stroked.messages;
    EXPECT_NEAR(volume_mm3("b.nii.gz", 2), kBall_mm3, 0.1 * kBall_mm3);

    const ProgramRun from = segment({"--method", "fuzzy-connectedness", "--start", path("a.nii.gz"),
                                     "-o", path("c.nii.gz"), "--arrival", path("c_f.nii.gz")});
    ASSERT_EQ(from.exit_code, 0) << from.messages;
    EXPECT_NEAR(volume_mm3("c.nii.gz", 3), kBall_mm3, 0.15 * kBall_mm3);
    const Result<LoadedVolume> strength = load_volume(file("c_f.nii.gz"));
    ASSERT_TRUE(strength);
    EXPECT_EQ(strength->volume.range().max, 1.0f);
}

TEST_F(SegmentCommand, AThresholdOfTheArrivalIsTheResult) {
    const ProgramRun ran =
        segment({"--method", "fast-marching", "--threshold", "2", "--seeds", path("in.json"), "-o",
                 path("a.nrrd"), "--arrival", path("t.nrrd"), "--cost", path("c.nrrd")});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const Result<LoadedVolume> labels = load_labels(file("a.nrrd"));
    const Result<LoadedVolume> times = load_volume(file("t.nrrd"));
    const Result<LoadedVolume> cost = load_volume(file("c.nrrd"));
    ASSERT_TRUE(labels && times && cost);
    EXPECT_GE(cost->volume.range().min, 0.01f);
    size_t inside = 0;
    for (uint32_t z = 0; z < 20; ++z)
        for (uint32_t y = 0; y < 40; ++y)
            for (uint32_t x = 0; x < 40; ++x) {
                const bool is_in = times->volume.value({x, y, z}) <= 2.0f;
                ASSERT_EQ(labels->volume.value({x, y, z}), is_in ? 3.0f : 0.0f);
                inside += is_in;
            }
    EXPECT_GT(inside, 100u);
    EXPECT_LT(inside, 40u * 40 * 20);
}

TEST_F(SegmentCommand, ALevelSetGoesOnFromAResultAndTellsDistances) {
    const ProgramRun ran =
        segment({"--method", "level-set", "--low", "50", "--high", "150", "--seeds",
                 path("in.json"), "-o", path("a.nrrd"), "--distance", path("mm.nrrd")});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.messages, HasSubstr("label 3: values 50 .. 150"));
    EXPECT_NEAR(volume_mm3("a.nrrd", 3), kBall_mm3, 0.1 * kBall_mm3);
    const Result<LoadedVolume> labels = load_labels(file("a.nrrd"));
    const Result<LoadedVolume> mm = load_volume(file("mm.nrrd"));
    ASSERT_TRUE(labels && mm);
    for (uint32_t x = 0; x < 40; ++x)
        EXPECT_EQ(labels->volume.value({x, 20, 10}),
                  mm->volume.value({x, 20, 10}) < 0.0f ? 3.0f : 0.0f);
    const ProgramRun from =
        segment({"--method", "level-set-edges", "--start", path("a.nrrd"), "--propagation", "0",
                 "--iterations", "3", "-o", path("b.nrrd")});
    ASSERT_EQ(from.exit_code, 0) << from.messages;
    EXPECT_THAT(from.messages, HasSubstr("after 3 iterations"));
    EXPECT_NEAR(volume_mm3("b.nrrd", 3), kBall_mm3, 0.1 * kBall_mm3);
}

TEST_F(SegmentCommand, ListsWhatTheTableHas) {
    const ProgramRun list = run({"segment", "--list"});
    EXPECT_EQ(list.exit_code, 0);
    for (const SegmentMethod& method : segment_methods())
        EXPECT_THAT(list.output, HasSubstr(method.name));
    EXPECT_THAT(run({"segment", "--help"}).output, HasSubstr("--deviations"));
}

TEST_F(SegmentCommand, BadInputIsOneSentenceAndWritesNothing) {
    const auto fails = [&](std::vector<std::string> more, int code, const std::string& words) {
        more.insert(more.end(), {"-o", path("out.nii")});
        const ProgramRun ran = segment(more);
        EXPECT_EQ(ran.exit_code, code) << ran.messages;
        EXPECT_THAT(ran.messages, HasSubstr(words));
        EXPECT_FALSE(std::filesystem::exists(file("out.nii")));
    };
    fails({"--method", "magic"}, 2, "magic");
    fails({"--method", "watershed"}, 1, "--seeds FILE");
    fails({"--method", "watershed", "--seeds", path("none.json")}, 1, "none.json");
    write("away.json", R"({"seeds": 1, "units": "mm",
        "points": [{"label": 1, "at_mm": [500, 0, 0]}]})");
    fails({"--method", "watershed", "--seeds", path("away.json")}, 1, "outside the volume");
    EXPECT_TRUE(
        save_volume(file("other.nrrd"), make_volume(make_grid({9, 9, 9}, {1, 1, 1}), ScalarType::u8,
                                                    [](glm::uvec3) { return 1.0; })));
    fails({"--method", "watershed", "--seeds", path("other.nrrd")}, 1, "other.nrrd");
    fails({"--method", "fast-marching", "--order", "3", "--seeds", path("in.json")}, 1,
          "order: expected 1 .. 2, found 3");
    fails({"--method", "region-growing", "--arrival", path("t.nii"), "--seeds", path("in.json")}, 1,
          "--arrival");
    fails({"--method", "watershed", "--distance", path("mm.nii"), "--seeds", path("in.json")}, 1,
          "--distance");
    fails({"--method", "level-set-regions", "--seeds", path("in.json")}, 1,
          "expected seeds outside the object");
    const ProgramRun idle =
        segment({"--method", "threshold", "--low", "50", "--order", "2", "-o", path("fine.nii")});
    EXPECT_EQ(idle.exit_code, 0);
    EXPECT_THAT(idle.messages, HasSubstr("--order changes nothing"));
    EXPECT_EQ(segment({}).exit_code, 2);
}

TEST_F(SegmentCommand, SeedsOfAResultFindItAgain) {
    ASSERT_EQ(segment({"--method", "threshold", "--low", "50", "-o", path("t.nrrd")}).exit_code, 0);
    const ProgramRun placed =
        run({"seeds", path("t.nrrd"), "--count", "2", "--radius", "4", "-o", path("again.json")});
    ASSERT_EQ(placed.exit_code, 0) << placed.messages;
    const ProgramRun ran = segment({"--method", "region-growing", "--deviations", "6", "--seeds",
                                    path("again.json"), "-o", path("a.nrrd")});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_NEAR(volume_mm3("a.nrrd", 1), volume_mm3("t.nrrd", 1), 0.1 * kBall_mm3);
    const ProgramRun none = run({"seeds", path("t.nrrd"), "--label", "9"});
    EXPECT_EQ(none.exit_code, 1);
    EXPECT_THAT(none.messages, HasSubstr("label 9"));
    EXPECT_EQ(run({"seeds", path("t.nrrd"), "--background", "9"}).exit_code, 2);
}

// Three circles on the ball's surface that cross each other, of 24 points each.
TEST_F(SegmentCommand, ClosedCurvesEncloseABall) {
    std::string curves;
    for (int axis = 0; axis < 3; ++axis) {
        std::string points;
        for (int i = 0; i <= 24; ++i) {
            const double turn = 2.0 * 3.14159265 * (i % 24) / 24.0;
            double p[3] = {0.0, 0.0, 0.0};
            p[(axis + 1) % 3] = 15.0 * std::cos(turn);
            p[(axis + 2) % 3] = 15.0 * std::sin(turn);
            points += (i ? ", [" : "[") + std::to_string(p[0]) + ", " + std::to_string(p[1]) +
                      ", " + std::to_string(p[2]) + "]";
        }
        curves += std::string(axis ? ", " : "") + "{\"label\": 3, \"points_mm\": [" + points + "]}";
    }
    write("curves.json", "{\"seeds\": 1, \"units\": \"mm\", \"curves\": [" + curves + "]}");
    const ProgramRun ran = segment({"--method", "live-wire-surface", "--seeds", path("curves.json"),
                                    "--curves", path("along.json"), "-o", path("a.nrrd")});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    // The surface's own samples belong to the body: half a sample more or less on each side, of
    // 1 to 2 mm, is 20 % of a ball of 15 mm.
    EXPECT_NEAR(volume_mm3("a.nrrd", 3), kBall_mm3, 0.2 * kBall_mm3);

    // The same curves, with the live-wires between their points.
    const Result<SeedFile> along = parse_seeds(bytes_of("along.json"), "along.json");
    ASSERT_TRUE(along) << along.error().message;
    ASSERT_EQ(along->curves.size(), 3u);
    for (const WireCurve& curve : along->curves) {
        EXPECT_EQ(curve.label, 3);
        EXPECT_GT(curve.points_mm.size(), 25u);
        EXPECT_EQ(curve.points_mm.front(), curve.points_mm.back());
    }
    // Straight lines between them are the same surface.
    const ProgramRun again =
        segment({"--method", "live-wire-surface", "--seeds", path("along.json"), "--follow", "0",
                 "-o", path("again.nrrd")});
    ASSERT_EQ(again.exit_code, 0) << again.messages;
    EXPECT_EQ(volume_mm3("again.nrrd", 3), volume_mm3("a.nrrd", 3));
    EXPECT_EQ(segment({"--method", "threshold", "--low", "50", "--curves", path("c.json"), "-o",
                       path("b.nrrd")})
                  .exit_code,
              1);

    write("open.json", R"({"seeds": 1, "units": "mm", "curves": [
        {"label": 3, "points_mm": [[15, 0, 0], [0, 15, 0], [-15, 0, 0]]}]})");
    const ProgramRun open = segment(
        {"--method", "live-wire-surface", "--seeds", path("open.json"), "-o", path("b.nrrd")});
    EXPECT_EQ(open.exit_code, 1);
    EXPECT_FALSE(std::filesystem::exists(file("b.nrrd")));
    EXPECT_EQ(
        segment({"--method", "live-wire-surface", "--seeds", path("in.json"), "-o", path("b.nrrd")})
            .exit_code,
        1); // seeds, and no curves
}

} // namespace
} // namespace palpate
