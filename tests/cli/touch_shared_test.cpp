#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

class TouchShared : public ProgramTest {
 protected:
    void SetUp() override {
        if (!std::filesystem::is_directory(kSharedData))
            GTEST_SKIP() << "the folder of shared data is absent: " << kSharedData;
    }
};

// A ball touches labels of which one alone states T0, 2 N; its centre stays in the air.
TEST_F(TouchShared, YieldsAtTheT0OfALabel) {
    const std::string labels = std::string(kSharedData) + "/reported/touch_label_yield/half.nrrd";
    const ProgramRun ran = run({"touch",
                                labels,
                                "--source",
                                "labels",
                                "--algorithm",
                                "swept-tool",
                                "--radius",
                                "1.5",
                                "--label-feel",
                                "1,500,0,2",
                                "--trajectory",
                                "press",
                                "--at",
                                "0",
                                "0",
                                "0",
                                "--depth",
                                "14",
                                "--distance",
                                "10",
                                "--speed",
                                "30",
                                "--grip",
                                "3",
                                "--device",
                                "omega"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const auto summary = nlohmann::json::parse(ran.output);
    EXPECT_LE(summary["most_force_n"], 2.0 * 1.03);
    EXPECT_GE(summary["most_force_n"], 2.0 * 0.97);
}

} // namespace
} // namespace palpate
