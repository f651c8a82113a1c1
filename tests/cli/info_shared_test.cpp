#include <algorithm>

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class InfoShared : public ProgramTest {
 protected:
    void SetUp() override {
        if (!std::filesystem::is_directory(kSharedData))
            GTEST_SKIP() << "the folder of real data is absent: " << kSharedData;
    }
};

TEST_F(InfoShared, ListsTheSeriesOfAFolder) {
    const ProgramRun ran = run({"info", std::string(kSharedData) + "/mr_t1gd_dicom_512", "--json"});
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_THAT(ran.messages, HasSubstr("series 1 of 1: MR 't1_mpr_tra_gk_v4', 40 images"));
    EXPECT_EQ(json::parse(ran.output)["modality"], "MR");
    const ProgramRun other = run(
        {"info", std::string(kSharedData) + "/mr_t1gd_dicom_512", "--series", "no such series"});
    EXPECT_EQ(other.exit_code, 1);
    EXPECT_THAT(other.messages, HasSubstr("t1_mpr_tra_gk_v4"));
}

TEST_F(InfoShared, KeepsTheReadersQuiet) {
    // ITK, GDCM and their like print about this file; the one line is ours.
    const ProgramRun ran = run({"info", std::string(kSharedData) + "/dicom_small/no_meta.dcm"});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_EQ(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 1) << ran.messages;
}

} // namespace
} // namespace palpate
