// palpate render --error: a setting that errs less, or the best there is.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

class ErrorOption : public ProgramTest {
 protected:
    ProgramRun render(const std::vector<std::string>& more) const {
        std::vector<std::string> all{
            "render", "synthetic:phantom?size=40", "--size", "64,48", "--stats", "-",
            "-o",     file("picture.exr").string()};
        all.insert(all.end(), more.begin(), more.end());
        return run(all);
    }
};

TEST_F(ErrorOption, PicksASettingThatErrsLessAndSaysWhich) {
    double finer = 1.0;
    for (const double wanted : {0.1, 0.02, 0.004}) {
        const ProgramRun ran = render({"--mode", "alpha", "--error", std::to_string(wanted)});
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        const double expected = nlohmann::json::parse(ran.output)["error_estimate"];
        EXPECT_GT(expected, 0.0);
        EXPECT_LE(expected, wanted);
        EXPECT_LE(expected, finer); // never worse for less
        finer = expected;
        EXPECT_THAT(ran.messages, HasSubstr("an RMSE of colour of"));
    }
}

TEST_F(ErrorOption, RefusesWhatCannotBeHadAndNamesTheBest) {
    const ProgramRun ran = render({"--mode", "alpha", "--error", "1e-9"});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("the best that can be had for this scene (by exact"));
    EXPECT_THAT(ran.messages, HasSubstr("found 1e-09"));
    EXPECT_FALSE(std::filesystem::exists(file("picture.exr")));
}

TEST_F(ErrorOption, NeedsRayCasting) {
    const ProgramRun ran = render({"--slice", "axial", "--error", "0.01"});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("expected a scene with ray casting, found slices alone"));
}

TEST_F(ErrorOption, IsNotToldTheSettingToo) {
    EXPECT_EQ(render({"--error", "0.01", "--step", "1"}).exit_code, 2);
    EXPECT_EQ(render({"--error", "0.01", "--integrator", "fast"}).exit_code, 2);
}

} // namespace
} // namespace palpate
