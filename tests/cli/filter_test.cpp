// palpate filter.

#include <gmock/gmock.h>

#include "engine/io/brick_file.h"
#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "engine/volume/grid.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

class FilterCommand : public ProgramTest {
 protected:
    FilterCommand() {
        EXPECT_TRUE(save_volume(
            file("v.nrrd"),
            make_volume(make_grid({40, 20, 9}, {1, 1, 2}), ScalarType::i16,
                        [](glm::uvec3 i) { return 3.0 * i.x + (i.y >= 10 ? 100.0 : -300.0); })));
    }
    ProgramRun filter(std::vector<std::string> more) const {
        more.insert(more.begin(), {"filter", file("v.nrrd").string()});
        return run(more);
    }
    Volume result(const char* name) const { return load_volume(file(name)).value().volume; }
};

TEST_F(FilterCommand, FiltersInTheOrderGiven) {
    // The derivative of the smoothed ramp is 3; smoothing the derivative keeps that.
    ProgramRun ran = filter({"--gaussian", "1.5", "--derivative", "left,0", "--gaussian", "2", "-o",
                             file("o.nrrd").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_EQ(ran.output, "");
    const Volume out = result("o.nrrd");
    EXPECT_EQ(out.type(), ScalarType::f32);
    EXPECT_NEAR(out.value({20, 4, 4}), 3.0, 1e-4);
    // The other order: the derivative, then a sum of constants.
    ran =
        filter({"--derivative", "left,0", "--derivative", "left,0", "-o", file("p.nrrd").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_NEAR(result("p.nrrd").value({20, 4, 4}), 0.0, 1e-4);
}

TEST_F(FilterCommand, TypesAreKeptOnDemandAndLossesSaid) {
    ProgramRun ran = filter({"--gaussian", "1", "--type", "keep", "-o", file("o.nrrd").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_EQ(result("o.nrrd").type(), ScalarType::i16);
    EXPECT_EQ(result("o.nrrd").value({20, 2, 4}), -240.0f);
    ran = filter({"--type", "i8", "-o", file("p.nrrd").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.messages,
                HasSubstr("--type i8: values -300 .. 217 are limited to -128 .. 127"));
}

TEST_F(FilterCommand, BrickFilesGiveTheSameAsOthersAndLeaveNothingBehind) {
    ASSERT_EQ(run({"convert", file("v.nrrd").string(), file("v.pbv").string()}).exit_code, 0);
    const std::vector<std::string> steps{"--gaussian", "1.5", "--gradient-magnitude", "1", "-o"};
    std::vector<std::string> flat{"filter", file("v.nrrd").string()},
        bricks{"filter", file("v.pbv").string()};
    flat.insert(flat.end(), steps.begin(), steps.end());
    bricks.insert(bricks.end(), steps.begin(), steps.end());
    flat.push_back(file("a.pbv").string());
    bricks.push_back(file("b.pbv").string());
    ASSERT_EQ(run(flat).exit_code, 0);
    const ProgramRun ran = run(bricks);
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_EQ(bytes_of("a.pbv"), bytes_of("b.pbv"));
    for (const auto& entry : std::filesystem::directory_iterator(file("")))
        EXPECT_THAT(entry.path().filename().string(), ::testing::Not(HasSubstr(".step")));
}

TEST_F(FilterCommand, OtherVolumesByNameAndOtherGrids) {
    const std::string with = "b=" + file("v.nrrd").string();
    ProgramRun ran = filter({"--with", with, "--expression", "a == b && a > -1000", "--crop",
                             "0,0,0,9,4,3", "-o", file("o.nrrd").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_EQ(result("o.nrrd").size(), glm::uvec3(10, 5, 4));
    EXPECT_EQ(result("o.nrrd").range(), (ValueRange{1, 1}));
    ran = filter({"--resample", "2", "--flip", "x", "-o", file("p.nrrd").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_EQ(result("p.nrrd").size(), glm::uvec3(20, 10, 9));
    ran = filter({"--with", with, "--expression", "a + c", "-o", file("q.nrrd").string()});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages,
                HasSubstr("--expression: column 5: expected a volume (a, b), found 'c'"));
}

// Two boxes, one with a hole, and an island: from grey values to labels to a distance. Where the
// first filter takes labels, V is read as a label map, and values that are none are refused.
TEST_F(FilterCommand, LabelMaps) {
    const auto inside = [](glm::uvec3 i, glm::uvec3 low, glm::uvec3 high) {
        return glm::all(glm::greaterThanEqual(i, low)) && glm::all(glm::lessThan(i, high));
    };
    ASSERT_TRUE(save_volume(
        file("l.nrrd"),
        make_volume(make_grid({40, 20, 9}, {1, 1, 2}), ScalarType::u8, [&](glm::uvec3 i) {
            if (i == glm::uvec3(6, 6, 4))
                return 0.0;
            return inside(i, {2, 2, 1}, {12, 12, 8})    ? 3.0
                   : inside(i, {20, 2, 1}, {30, 12, 8}) ? 5.0
                   : i == glm::uvec3(36, 17, 4)         ? 5.0
                                                        : 0.0;
        })));
    const auto labels = [&](std::vector<std::string> steps, const char* out) {
        steps.insert(steps.begin(), {"filter", file("l.nrrd").string()});
        steps.insert(steps.end(), {"-o", file(out).string()});
        const ProgramRun ran = run(steps);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return result(out);
    };
    const Volume clean = labels({"--holes", "6", "--islands", "0.01"}, "clean.nrrd");
    EXPECT_EQ(clean.type(), ScalarType::u8);
    EXPECT_EQ(clean.value({6, 6, 4}), 3.0f);
    EXPECT_EQ(clean.value({36, 17, 4}), 0.0f);
    EXPECT_EQ(clean.value({25, 6, 4}), 5.0f);
    const Volume pieces = labels({"--components", "26"}, "pieces.nrrd");
    EXPECT_EQ(pieces.range(), (ValueRange{0, 3}));
    EXPECT_EQ(pieces.value({25, 6, 4}), 1.0f); // whole: a sample more than the other box
    const Volume grown = labels({"--dilate", "ball,2,label=5"}, "grown.nrrd");
    EXPECT_EQ(grown.value({31, 6, 4}), 5.0f);
    EXPECT_EQ(grown.value({32, 6, 4}), 0.0f);
    EXPECT_EQ(grown.value({12, 6, 4}), 0.0f);
    const Volume away =
        labels({"--largest", "6,label=5", "--signed-distance", "label,5"}, "d.nrrd");
    EXPECT_EQ(away.type(), ScalarType::f32);
    EXPECT_EQ(away.value({33, 6, 4}), 4.0f);
    EXPECT_EQ(away.value({20, 6, 4}), -1.0f);
    EXPECT_EQ(labels({"--smooth-joint", "1"}, "s.nrrd").value({36, 17, 4}), 0.0f);

    const Volume wider = labels({"--margin", "1,3", "--hollow", "2,outside,5"}, "wider.nrrd");
    EXPECT_EQ(wider.value({12, 6, 4}), 3.0f);
    EXPECT_EQ(wider.value({13, 6, 4}), 0.0f);
    EXPECT_EQ(wider.value({31, 6, 4}), 5.0f);
    EXPECT_EQ(wider.value({25, 6, 4}), 0.0f);
    const Volume kept = labels({"--margin", "-1", "--locked", "5"}, "kept.nrrd");
    EXPECT_EQ(kept.value({2, 6, 4}), 0.0f);
    EXPECT_EQ(kept.value({36, 17, 4}), 5.0f);
    const Volume joined = labels({"--logic", "add,3,5", "--split", "3"}, "joined.nrrd");
    EXPECT_EQ(joined.value({25, 6, 4}), 3.0f); // a sample more than the box with a hole
    EXPECT_EQ(joined.value({2, 6, 4}), 1.0f);
    EXPECT_EQ(joined.value({36, 17, 4}), 2.0f);

    std::ofstream(file("cut.json")) << R"({"scissors": 1, "units": "mm", "action": "erase-inside",
        "label": 5, "outline_mm": [[-500, -500, 0], [500, -500, 0], [500, 500, 0], [-500, 500, 0]],
        "towards": [0, 0, 1]})";
    const Volume cut = labels({"--scissors", file("cut.json").string()}, "cut.nrrd");
    EXPECT_EQ(cut.value({36, 17, 4}), 0.0f);
    EXPECT_EQ(cut.value({2, 6, 4}), 3.0f);

    ProgramRun ran = filter({"--threshold", "150", "--locked", "5", "-o", file("x.nrrd").string()});
    EXPECT_NE(ran.exit_code, 0);
    EXPECT_THAT(ran.messages, HasSubstr("--threshold: expected a filter that changes a label map"));
    ran = filter({"--threshold", "150", "--erode", "6,2", "-o", file("e.pbv").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_TRUE(open_brick_file(file("e.pbv"))->labels);
    ran = filter({"--erode", "6", "-o", file("x.nrrd").string()});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("labels"));
    EXPECT_FALSE(std::filesystem::exists(file("x.nrrd")));
}

TEST_F(FilterCommand, ListAndHelpComeFromTheTable) {
    const ProgramRun list = run({"filter", "--list"}), help = run({"filter", "--help"});
    EXPECT_EQ(list.exit_code, 0) << list.messages;
    EXPECT_THAT(list.output, HasSubstr("--gaussian SIGMA\n    Smooth with a Gaussian\n    sigma: 0 "
                                       ".. 1000 mm\n    result: f32; memory beside"));
    EXPECT_THAT(help.output, HasSubstr("--gradient-magnitude SIGMA"));
}

TEST_F(FilterCommand, FailuresAreOneSentence) {
    const auto expect = [&](int code, std::vector<std::string> words, const char* sentence) {
        words.insert(words.end(), {"-o", file("o.nrrd").string()});
        const ProgramRun ran = filter(std::move(words));
        EXPECT_EQ(ran.exit_code, code) << ran.messages;
        EXPECT_THAT(ran.messages, HasSubstr(sentence));
        EXPECT_FALSE(std::filesystem::exists(file("o.nrrd")));
    };
    expect(2, {}, "expected a filter, such as --gaussian 1.5; --list names them");
    expect(2, {"--gaussian", "x"}, "--gaussian: sigma: expected a number 0 .. 1000 mm, found 'x'");
    expect(1, {"--gaussian", "900"}, "--gaussian: sigma: expected 0 .. 32 mm, which is 32 samples");
    expect(2, {"--gaussian", "1", "--with", "b"}, "--with: expected NAME=FILE, found 'b'");
    expect(1, {"--gaussian", "1", "--with", "b=absent.nii"}, "absent.nii");
    EXPECT_EQ(run({"filter", "--gaussian", "1"}).exit_code, 2);
    EXPECT_EQ(run({"filter", file("v.nrrd").string(), "--gaussian", "1"}).exit_code, 2);
}

} // namespace
} // namespace palpate
