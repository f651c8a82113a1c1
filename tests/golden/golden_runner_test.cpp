#include <sys/wait.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "engine/image/exr.h"
#include "tests/support/paths.h"
#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// Runs the golden runner on a doctored copy of a real case.
class GoldenRunner : public TemporaryFolder {
 protected:
    GoldenRunner() {
        fs::copy(kSourceDir + std::string("/golden/mip"), file("case"));
        fs::copy(kSourceDir + std::string("/golden/driver.json"), file("driver.json"));
    }
    int run(const std::string& mode) const {
        const std::string command = fmt::format(
            "'{}' {} '{}' '{}' >'{}' 2>'{}'", PALPATE_GOLDEN_TEST, mode, file("case").string(),
            file("work").string(), file("stdout").string(), file("stderr").string());
        return WEXITSTATUS(std::system(command.c_str()));
    }
    void change_case(const std::string& key, const Json& value) const {
        Json json = Json::parse(bytes_of("case/case.json"));
        json[key] = value;
        write("case/case.json", json.dump());
    }
    // Makes one row of the expected picture white.
    void damage_expected() const {
        Result<ExrFile> expected = load_exr(file("case/expected.exr"));
        ASSERT_TRUE(expected) << expected.error().message;
        for (uint32_t x = 0; x < expected->image.size_px.x; ++x)
            for (size_t c = 0; c < 3; ++c)
                expected->image.at(x, 1, c) = 1.0f;
        ASSERT_TRUE(save_exr(file("case/expected.exr"), expected->image, ExrPrecision::half_float,
                             expected->metadata));
    }
};

TEST_F(GoldenRunner, PassesTheCaseAsItIs) {
    EXPECT_EQ(run("check"), 0) << bytes_of("stderr");
}

TEST_F(GoldenRunner, FailsOnAChangedPictureAndLeavesTheEvidence) {
    damage_expected();
    EXPECT_EQ(run("check"), 1);
    EXPECT_NE(bytes_of("stderr").find("of the pixels differ"), std::string::npos);
    for (const char* name : {"expected.exr", "actual.exr", "difference.png"})
        EXPECT_TRUE(fs::exists(file("work") / name)) << name;
    const Json numbers = Json::parse(bytes_of("work/numbers.json"));
    EXPECT_GT(numbers["differing_share"], numbers["max_differing_share"]);
    EXPECT_GT(numbers["channel_difference"], numbers["max_channel_difference"]);
}

TEST_F(GoldenRunner, FailsOnAPictureThatIsFartherFromTruthThanStated) {
    change_case("stated_error", 1e-9);
    EXPECT_EQ(run("check"), 1);
    EXPECT_NE(bytes_of("stderr").find("from grid truth"), std::string::npos);
    fs::remove(file("case/expected.exr"));
    EXPECT_EQ(run("bless"), 1);
    EXPECT_FALSE(fs::exists(file("case/expected.exr")));
}

TEST_F(GoldenRunner, FailsWhereNothingIsBlessed) {
    fs::remove(file("case/expected.exr"));
    EXPECT_EQ(run("check"), 1);
    EXPECT_NE(bytes_of("stderr").find("expected.exr"), std::string::npos);
}

TEST_F(GoldenRunner, BlessesOnTheRecordedDriverOnly) {
    damage_expected();
    write("driver.json", R"({"device": "another", "driver": "one"})");
    EXPECT_EQ(run("bless"), 1);
    EXPECT_NE(bytes_of("stderr").find("another, one only"), std::string::npos);
    fs::copy(kSourceDir + std::string("/golden/driver.json"), file("driver.json"),
             fs::copy_options::overwrite_existing);
    EXPECT_EQ(run("bless"), 0) << bytes_of("stderr");
    EXPECT_EQ(run("check"), 0) << bytes_of("stderr");
}

} // namespace
} // namespace palpate
