#include <gtest/gtest.h>

#include "tests/support/kill.h"
#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

class BrickFileCommands : public ProgramTest {
 protected:
    const std::string phantom_ = "synthetic:phantom?size=96,80,70&type=u16";
};

TEST_F(BrickFileCommands, ConvertThereAndBackKeepsEverySample) {
    ASSERT_EQ(run({"convert", phantom_, file("v.pbv")}).exit_code, 0);
    ASSERT_EQ(run({"convert", file("v.pbv"), file("back.nrrd")}).exit_code, 0);
    ASSERT_EQ(run({"convert", phantom_, file("direct.nrrd")}).exit_code, 0);
    EXPECT_EQ(bytes_of("back.nrrd"), bytes_of("direct.nrrd"));
    ASSERT_EQ(run({"convert", file("back.nrrd"), file("again.pbv")}).exit_code, 0);
    const ProgramRun same = run({"compare", file("v.pbv"), file("again.pbv")});
    EXPECT_EQ(same.exit_code, 0) << same.output << same.messages;
    const ProgramRun info = run({"info", file("v.pbv")});
    EXPECT_NE(info.output.find("96 x 80 x 70"), std::string::npos) << info.output;
    EXPECT_NE(info.output.find("u16"), std::string::npos) << info.output;
}

TEST_F(BrickFileCommands, ADamagedBrickEndsARunWithOneSentence) {
    ASSERT_EQ(run({"convert", phantom_, file("v.pbv")}).exit_code, 0);
    std::string bytes = bytes_of("v.pbv");
    bytes[300] = static_cast<char>(bytes[300] ^ 4);
    write("v.pbv", bytes);
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"convert", file("v.pbv"), file("out.nrrd")},
          {"convert", file("v.pbv"), file("out.pbv")},
          {"render", file("v.pbv"), "--size", "32", "32", "-o", file("out.png")}}) {
        const ProgramRun broken = run(arguments);
        EXPECT_EQ(broken.exit_code, 1) << broken.messages;
        EXPECT_NE(broken.messages.find("v.pbv: brick (0, 0, 0) of level 0 is damaged: expected"),
                  std::string::npos)
            << broken.messages;
    }
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(file("").parent_path()), {}),
              3); // v.pbv, and what the last run said
}

TEST_F(BrickFileCommands, KilledAtAnyMomentLeavesAWholeFileOrNone) {
    const std::string out = file("v.pbv");
    kill_at_many_moments(
        10,
        [&] {
            ::execl(kProgram, "palpate", "convert", phantom_.c_str(), out.c_str(), nullptr);
            return 127;
        },
        [&] {
            if (std::filesystem::exists(out)) {
                EXPECT_EQ(run({"info", out}).exit_code, 0);
            }
            std::filesystem::remove(out);
        });
}

} // namespace
} // namespace palpate
