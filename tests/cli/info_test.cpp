#include <algorithm>

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// ramp.nrrd: 5 x 4 x 3 at 0.5 x 1 x 2 mm, value -10 + index, x pointing right.
class InfoCommand : public ProgramTest {
 protected:
    InfoCommand() {
        Grid grid = make_grid({5, 4, 3}, {0.5, 1, 2}, {1, 2, 3});
        grid.world_from_index[0] = glm::dvec4(-0.5, 0, 0, 0);
        const Volume ramp = make_volume(grid, ScalarType::i16, [](glm::uvec3 i) {
            return -10.0 + i.x + 5.0 * (i.y + 4.0 * i.z);
        });
        EXPECT_TRUE(save_volume(file("ramp.nrrd"), ramp));
    }
    ProgramRun info(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), "info");
        return run(arguments);
    }
};

TEST_F(InfoCommand, JsonHasTheKeysProgramsRelyOn) {
    const ProgramRun ran = info({file("ramp.nrrd").string(), "--json"});
    EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    const json said = json::parse(ran.output);
    EXPECT_EQ(said["size"], json({5, 4, 3}));
    EXPECT_EQ(said["spacing_mm"], json({0.5, 1.0, 2.0}));
    EXPECT_EQ(said["world_from_index"], json({-0.5, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0,
                                              2.0, 3.0, 0.0, 0.0, 0.0, 1.0}));
    EXPECT_EQ(said["type"], "i8");
    EXPECT_EQ(said["range"], json({-10.0, 49.0}));
    EXPECT_EQ(said["no_data_count"], 0);
    EXPECT_EQ(said["corners_mm"]["lps"], json({{1.0, 2.0, 3.0}, {-1.0, 5.0, 7.0}}));
    EXPECT_EQ(said["corners_mm"]["ras"], json({{-1.0, -2.0, 3.0}, {1.0, -5.0, 7.0}}));
    EXPECT_EQ(said["warnings"], json::array());
    EXPECT_FALSE(said.contains("modality"));
}

TEST_F(InfoCommand, TextNamesTheSidesOfThePatient) {
    const ProgramRun ran = info({file("ramp.nrrd").string()});
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_THAT(ran.output, AllOf(HasSubstr("5 x 4 x 3"), HasSubstr("0.5 x 1 x 2 mm"),
                                  HasSubstr("x towards  right"), HasSubstr("y towards  posterior"),
                                  HasSubstr("-10 .. 49")));
    EXPECT_THAT(ran.output, HasSubstr("first at   1, 2, 3 mm LPS (left, posterior, superior); "
                                      "-1, -2, 3 RAS\n"
                                      "last at    -1, 5, 7 mm LPS (left, posterior, superior); "
                                      "1, -5, 7 RAS\n"));
}

TEST_F(InfoCommand, SaysThatACtLacksItsOffset) {
    const std::string header =
        "ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementSpacing = 1 1 1\n"
        "ElementType = MET_SHORT\nModality = MET_MOD_CT\n"
        "ElementDataFile = LOCAL\n";
    const auto told = [&](int16_t air, int16_t tissue) {
        std::string samples;
        for (int i = 0; i < 64; ++i) {
            const int16_t value = i < 32 ? air : tissue;
            samples.append(reinterpret_cast<const char*>(&value), sizeof value);
        }
        write("ct.mha", header + samples);
        return info({file("ct.mha").string()}).messages;
    };
    EXPECT_THAT(told(24, 1064), HasSubstr("bone at 300 HU is at 1324 here"));
    EXPECT_EQ(told(-1000, 40), "");
}

TEST_F(InfoCommand, RefusesWithOneSentence) {
    write("cut.nrrd", bytes_of("ramp.nrrd").substr(0, bytes_of("ramp.nrrd").size() - 20));
    write("noise.bin", "neither this nor that");
    for (const std::string name : {"absent.nii", "cut.nrrd", "noise.bin"}) {
        const ProgramRun ran = info({file(name).string()});
        EXPECT_EQ(ran.exit_code, 1) << name;
        EXPECT_EQ(ran.output, "");
        EXPECT_THAT(ran.messages, AllOf(HasSubstr("error"), HasSubstr(name)));
        EXPECT_EQ(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 1) << ran.messages;
    }
    EXPECT_THAT(info({file("ramp.nrrd").string(), "--labels"}).messages, HasSubstr("from -10"));
    EXPECT_THAT(info({file("ramp.nrrd").string(), "--frame", "1"}).messages,
                HasSubstr("no frame 1"));
    EXPECT_THAT(info({file("ramp.nrrd").string(), "--max-memory", "0.0001"}).messages,
                AllOf(HasSubstr("limit of 104"), HasSubstr("5 x 4 x 3")));
}

TEST_F(InfoCommand, WrongUsageIsTwo) {
    EXPECT_EQ(info({}).exit_code, 2);
    EXPECT_EQ(info({"a", "--frame", "-1"}).exit_code, 2);
    EXPECT_EQ(info({"a", "--max-memory", "0"}).exit_code, 2);
    EXPECT_EQ(info({"a", "--nonsense"}).exit_code, 2);
    const ProgramRun help = info({"--help"});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_THAT(help.output, AllOf(HasSubstr("--max-memory"), HasSubstr("default")));
}

} // namespace
} // namespace palpate
