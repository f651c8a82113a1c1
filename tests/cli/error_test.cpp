// palpate render --error: a setting that errs less, or the best there is.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

// ErrorOption takes over 5 s of a processor: the program draws with one setting after another until
// it finds what errs little enough.
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

    const std::string before = "expected at least ";
    const size_t at = ran.messages.find(before);
    ASSERT_NE(at, std::string::npos) << ran.messages;
    const std::string best =
        ran.messages.substr(at + before.size(), ran.messages.find(',', at) - at - before.size());
    const ProgramRun again = render({"--mode", "alpha", "--error", best});
    EXPECT_EQ(again.exit_code, 0) << again.messages;
}

TEST_F(ErrorOption, NeedsRayCasting) {
    const ProgramRun ran = render({"--slice", "axial", "--error", "0.01"});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("expected a scene with ray casting, found slices alone"));
}

TEST_F(ErrorOption, IsNotToldTheSettingToo) {
    EXPECT_EQ(render({"--error", "0.01", "--step", "1"}).exit_code, 2);
    EXPECT_EQ(render({"--error", "0.01", "--integrator", "fast"}).exit_code, 2);
    EXPECT_EQ(render({"--error", "0.01", "--frame-ms", "20"}).exit_code, 2);
}

TEST_F(ErrorOption, IsMeasuredForAnySetting) {
    double before = 1.0;
    for (const char* step : {"50", "10", "2"}) {
        const ProgramRun ran = render({"--mode", "alpha", "--step", step});
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        const double error = nlohmann::json::parse(ran.output)["error_estimate"];
        EXPECT_GT(error, 0.0);
        EXPECT_LT(error, before);
        before = error;
    }
}

TEST_F(ErrorOption, IsThatOfThePictureAlsoOfAMovingOne) {
    const ProgramRun still = render({"--mode", "alpha", "--step", "5"});
    const ProgramRun moving = render({"--mode", "alpha", "--step", "5", "--frame-ms", "0.01"});
    const ProgramRun settled =
        render({"--mode", "alpha", "--step", "5", "--frame-ms", "0.01", "--settle"});
    ASSERT_EQ(still.exit_code + moving.exit_code + settled.exit_code, 0);
    const auto error = [](const ProgramRun& ran) {
        return nlohmann::json::parse(ran.output)["error_estimate"].get<double>();
    };
    EXPECT_GT(error(still), 0.0);
    EXPECT_GE(error(moving), error(still));
    EXPECT_EQ(error(settled), error(still));
}

// One sentence where no fewer rays are to be had, another where no frame came before.
TEST_F(ErrorOption, ABudgetThatIsNotMetIsSaid) {
    const ProgramRun missed =
        render({"--mode", "alpha", "--frame-ms", "0.0001", "--frames", "12", "--orbit-deg", "3"});
    ASSERT_EQ(missed.exit_code, 0) << missed.messages;
    EXPECT_THAT(missed.messages, HasSubstr("warning: --frame-ms 0.0001: half of the frames took"));
    EXPECT_THAT(missed.messages,
                HasSubstr("with the fewest rays there are, one in 16 x 16 pixels"));
    const auto interactive = nlohmann::json::parse(missed.output)["interactive"];
    EXPECT_EQ(interactive["px_per_ray"], 16);
    EXPECT_EQ(interactive["budget_met"], false);
    EXPECT_LT(interactive["traced_share"].get<double>(), 0.01);

    const ProgramRun once = render({"--mode", "alpha", "--frame-ms", "0.0001"});
    ASSERT_EQ(once.exit_code, 0) << once.messages;
    EXPECT_THAT(once.messages, HasSubstr("the frame took"));
    EXPECT_THAT(once.messages, HasSubstr("ask for --frames"));

    const ProgramRun met = render({"--mode", "alpha", "--frame-ms", "1e6"});
    ASSERT_EQ(met.exit_code, 0) << met.messages;
    EXPECT_THAT(met.messages, testing::Not(HasSubstr("--frame-ms")));
    EXPECT_EQ(nlohmann::json::parse(met.output)["interactive"]["budget_met"], true);
}

TEST_F(ErrorOption, FrameBudgetsRefuseWhatTheyWouldIgnore) {
    const ProgramRun slices = render({"--slice", "axial", "--frame-ms", "20"});
    EXPECT_EQ(slices.exit_code, 1);
    EXPECT_THAT(slices.messages, HasSubstr("found slices alone"));
    const ProgramRun values = render({"--values", "--frame-ms", "20"});
    EXPECT_EQ(values.exit_code, 1);
    EXPECT_THAT(values.messages, HasSubstr("leave out --values"));
    EXPECT_EQ(render({"--settle"}).exit_code, 2);
}

} // namespace
} // namespace palpate
