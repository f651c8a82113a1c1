#include <nlohmann/json.hpp>

#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using Json = nlohmann::json;

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
    const Json json = Json::parse(same.output);
    EXPECT_EQ(json["kind"], "labels");
    EXPECT_EQ(json["size"], Json({35, 51, 35}));
    EXPECT_EQ(json["labels"].size(), 2u); // anterior and posterior hippocampus
    EXPECT_EQ(json["least_dice"], 1.0);
    EXPECT_TRUE(json["pass"]);
}

TEST_F(CompareShared, GreyValuesDifferFromTheirLabels) {
    const ProgramRun differing =
        run({"compare", kHippocampus + "image.nii.gz", kHippocampus + "label.nii.gz"});
    EXPECT_EQ(differing.exit_code, 1);
    const Json json = Json::parse(differing.output);
    EXPECT_EQ(json["kind"], "volume");
    EXPECT_EQ(json["geometry_mm"], 0.0);
    EXPECT_GT(json["max"], 0.0);
    EXPECT_FALSE(json["pass"]);
}

TEST_F(CompareShared, RefusesOtherSizes) {
    const ProgramRun refused =
        run({"compare", kHippocampus + "image.nii.gz", kData + "/mr_small/mr_trunk_slab.nii.gz"});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.messages.find("differ in size"), std::string::npos) << refused.messages;
}

} // namespace
} // namespace palpate
