#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/volume/grid.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;

class Invesalius : public testing::Test {
 protected:
    Result<DecodedHere> decode(const std::string& bytes) const {
        return decode_here(folder_.write("p.inv3", bytes));
    }
    std::string refusal(const std::string& bytes) const {
        const Result<DecodedHere> result = decode(bytes);
        return result ? "not refused" : result.error().message;
    }
    TemporaryFolder folder_;
};

TEST_F(Invesalius, TarAndPackedTarGiveTheSameVolume) {
    // The matrix may come before the list that describes it.
    const std::string reversed =
        tar({{"tmp/matrix.dat", twelve_shorts()}, {"tmp/main.plist", project_plist()}});
    for (const std::string& bytes : {project(), deflated(project()), reversed}) {
        const auto result = decode(bytes);
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->values, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
        EXPECT_EQ(result->decoded.grid.size, glm::uvec3(3, 2, 2));
        // x runs to the left, y to the front, z to the head.
        EXPECT_EQ(world_point(result->decoded.grid, {1, 1, 1}), glm::dvec3(2, -3, 4));
        EXPECT_EQ(result->decoded.modality, "CT");
    }
}

TEST_F(Invesalius, HostileProjectsAreRefused) {
    const std::string two("<integer>2</integer>");
    const auto shape = [&](const std::string& numbers) {
        return refusal(project(project_plist("matrix.dat", numbers)));
    };
    EXPECT_THAT(refusal("no archive at all"), HasSubstr("tar archive"));
    EXPECT_THAT(refusal(tar({{"tmp/matrix.dat", twelve_shorts()}})), HasSubstr("main.plist"));
    EXPECT_THAT(refusal(tar({{"main.plist", project_plist()}})), HasSubstr("matrix.dat"));
    EXPECT_THAT(refusal(tar({{"main.plist", "<plist"}})), HasSubstr("property list"));
    EXPECT_THAT(refusal(tar({{"main.plist", "<plist/>"}})), HasSubstr("plain name"));
    EXPECT_THAT(refusal(tar({{"main.plist", std::string(2 << 20, ' ')}})), HasSubstr("at most"));
    EXPECT_THAT(refusal(project(project_plist("../matrix.dat"))), HasSubstr("plain name"));
    EXPECT_THAT(refusal(project(project_plist("/etc/passwd"))), HasSubstr("plain name"));
    EXPECT_THAT(refusal(project(project_plist("matrix.dat", two + two + two, "complex64"))),
                HasSubstr("complex64"));
    EXPECT_THAT(refusal(project(project_plist("matrix.dat", two + two + two, "int\n6"))),
                HasSubstr("found \"int\\n6\"")); // one line
    EXPECT_THAT(shape(two + two), HasSubstr("3 numbers"));
    EXPECT_THAT(shape(two + two + "<integer>-2</integer>"), HasSubstr("1 or more"));
    EXPECT_THAT(shape(two + two + "<string>x</string>"), HasSubstr("1 or more"));
    EXPECT_THAT(shape(two + two + "<real>nan</real>"), HasSubstr("1 or more"));
    EXPECT_THAT(shape(two + two + "<integer>4</integer>"), HasSubstr("32 bytes"));
    const std::string big("<integer>2147483647</integer>");
    EXPECT_THAT(shape(big + big + big), HasSubstr("not a possible size"));
}

TEST_F(Invesalius, LongerMatrixIsAWarningWithBothNumbers) {
    const auto result =
        decode(tar({{"main.plist", project_plist()}, {"matrix.dat", twelve_shorts() + "abc"}}));
    ASSERT_TRUE(result);
    ASSERT_EQ(result->decoded.warnings.size(), 1u);
    EXPECT_THAT(result->decoded.warnings[0], testing::ContainsRegex("27 bytes .* 24"));
}

} // namespace
} // namespace palpate::io
