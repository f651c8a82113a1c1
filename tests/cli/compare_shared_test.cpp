#include <nlohmann/json.hpp>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;

const std::string kData = kSharedData;
const std::string kHippocampus = kData + "/mr_hippocampus_labels/hippocampus_001_";

class CompareShared : public ProgramTest {
 protected:
    void SetUp() override {
        if (!std::filesystem::is_directory(kData))
            GTEST_SKIP() << "the folder of real data is absent: " << kData;
    }
};

TEST_F(CompareShared, LabelMapAgreesWithItself) {
    const std::string labels = kHippocampus + "label.nii.gz";
    const ProgramRun same = run({"compare", labels, labels, "--labels"});
    EXPECT_EQ(same.exit_code, 0) << same.messages;
    const json said = json::parse(same.output);
    EXPECT_EQ(said["kind"], "labels");
    EXPECT_EQ(said["size"], json({35, 51, 35}));
    EXPECT_EQ(said["labels"].size(), 2u); // anterior and posterior hippocampus
    EXPECT_EQ(said["least_dice"], 1.0);
    EXPECT_TRUE(said["pass"]);
}

TEST_F(CompareShared, GreyValuesDifferFromTheirLabels) {
    const ProgramRun differing =
        run({"compare", kHippocampus + "image.nii.gz", kHippocampus + "label.nii.gz"});
    EXPECT_EQ(differing.exit_code, 1);
    const json said = json::parse(differing.output);
    EXPECT_EQ(said["kind"], "volume");
    EXPECT_EQ(said["geometry_mm"], 0.0);
    EXPECT_GT(said["max"], 0.0);
    EXPECT_FALSE(said["pass"]);
}

TEST_F(CompareShared, RefusesOtherSizes) {
    const ProgramRun refused =
        run({"compare", kHippocampus + "image.nii.gz", kData + "/mr_small/mr_trunk_slab.nii.gz"});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.messages.find("differ in size"), std::string::npos) << refused.messages;
}

} // namespace
} // namespace palpate
