// palpate measure.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// 20 x 20 x 20 at 1 x 1 x 2 mm, value x + 100 y; label 1 is x < 3, label 4 is x >= 18.
class MeasureCommand : public ProgramTest {
 protected:
    MeasureCommand() {
        const Grid grid = make_grid(glm::uvec3(20), {1, 1, 2});
        EXPECT_TRUE(save_volume(
            file("v.nrrd"),
            make_volume(grid, ScalarType::i16, [](glm::uvec3 i) { return i.x + 100.0 * i.y; })));
        EXPECT_TRUE(save_volume(file("l.nrrd"), make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
                                    return i.x < 3 ? 1.0 : i.x >= 18 ? 4.0 : 0.0;
                                })));
    }
    ProgramRun measure(std::vector<std::string> more) const {
        more.insert(more.begin(), {"measure", file("v.nrrd").string()});
        return run(more);
    }
};

TEST_F(MeasureCommand, LengthsAnglesAreasAndBalls) {
    const ProgramRun ran =
        measure({"--ruler", "0,0,0,3,4,0", "--ruler", "0,0,0,0,0,7", "--angle", "1,0,0,0,0,0,0,1,0",
                 "--polygon", "0.5,0.5,4,4.5,0.5,4,4.5,2.5,4,0.5,2.5,4", "--sphere", "10,10,20,1.5",
                 "--sphere", "500,0,0,3", "--json", "-"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json all = json::parse(ran.output)["measures"];
    ASSERT_EQ(all.size(), 6u);
    EXPECT_EQ(all[0]["length_mm"], 5.0);
    EXPECT_EQ(all[1]["length_mm"], 7.0);
    EXPECT_EQ(all[2]["angle_deg"], 90.0);
    EXPECT_EQ(all[3]["area_mm2"], 8.0);
    EXPECT_EQ(all[3]["values"]["count"], 8); // x 1 .. 4, y 1 .. 2
    EXPECT_EQ(all[3]["values"]["mean"], 152.5);
    EXPECT_NEAR(all[4]["volume_mm3"].get<double>(), 14.1371669411541, 1e-9);
    EXPECT_EQ(all[4]["values"]["count"], 9); // 3 x 3 of one slice
    EXPECT_EQ(all[4]["values"]["mean"], 1010.0);
    EXPECT_EQ(all[5]["values"]["count"], 0);
    EXPECT_FALSE(all[5]["values"].contains("mean"));
    EXPECT_EQ(all[5]["note"], "no sample lies inside");
}

TEST_F(MeasureCommand, LabelsAsTextTableAndJson) {
    const std::vector<std::string> labels{"--labels", file("l.nrrd").string()};
    const ProgramRun text = measure(labels);
    ASSERT_EQ(text.exit_code, 0) << text.messages;
    EXPECT_THAT(text.output, HasSubstr("label 1  2.4 ml, 1200 samples  951 +- "));
    EXPECT_THAT(text.output, HasSubstr("label 4  1.6 ml, 800 samples"));
    const ProgramRun table = measure({labels[0], labels[1], "--csv", "-"});
    EXPECT_THAT(table.output, StartsWith("kind,name,label,area_mm2,volume_mm3"));
    EXPECT_THAT(table.output, testing::ContainsRegex("label,,4,[0-9.]+,1600,1.6,800,968.5,"));
    const ProgramRun said = measure(
        {labels[0], labels[1], "--csv", file("t.csv").string(), "--json", file("t.json").string()});
    EXPECT_EQ(said.exit_code, 0) << said.messages;
    EXPECT_EQ(said.output, "");
    const json one = json::parse(bytes_of("t.json"))["labels"][0];
    EXPECT_EQ(one["low"], json({0.0, 0.0, 0.0}));
    EXPECT_EQ(one["high"], json({2.0, 19.0, 19.0}));
    EXPECT_EQ(one["centroid_mm"], json({1.0, 9.5, 19.0}));
    EXPECT_EQ(bytes_of("t.csv"), table.output);
}

TEST_F(MeasureCommand, MeasuresOfAProjectAreTaken) {
    const ProgramRun made = run({"project", file("p").string(), "--new", file("v.nrrd").string()});
    ASSERT_EQ(made.exit_code, 0) << made.messages;
    std::string text = bytes_of("p/project.json");
    const std::string kept =
        R"("measures": [{"kind": "ruler", "points_mm": [[0, 0, 0], [0, 3, 4]], "name": "neck"}],)";
    text.insert(text.find('{') + 1, kept);
    write("p/project.json", text);
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"measure", file("p").string()},
          {"measure", file("v.nrrd").string(), "--project", file("p").string()}}) {
        const ProgramRun ran = run(words);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_EQ(ran.output, "ruler neck  5 mm\n");
    }
    // A save keeps them.
    const ProgramRun saved = run({"project", file("p").string(), "--save"});
    EXPECT_EQ(saved.exit_code, 0) << saved.messages;
    EXPECT_EQ(run({"measure", file("p").string()}).output, "ruler neck  5 mm\n");
}

TEST_F(MeasureCommand, FailuresAreOneSentence) {
    const auto expect = [&](int code, std::vector<std::string> words, const char* sentence) {
        const ProgramRun ran = measure(std::move(words));
        EXPECT_EQ(ran.exit_code, code) << ran.messages;
        EXPECT_THAT(ran.messages, HasSubstr(sentence));
    };
    expect(2, {"--ruler", "1,2,3"}, "--ruler: ruler: expected 2 points, found 1");
    expect(2, {"--sphere", "1,2,3,0"}, "expected a radius above 0");
    expect(2, {"--polygon", "0,0,0,9,0,0,9,9,0,0,9,3"}, "expected corners in one plane");
    expect(2, {"--angle", "a"}, "--angle: expected X,Y,Z of each point, found 'a'");
    expect(1, {"--project", file("v.nrrd").string()}, "expected the folder of a project");
    EXPECT_EQ(measure({}).output, "nothing to measure: no label, and no measure was named\n");
}

} // namespace
} // namespace palpate
