#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/volume/grid.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const std::string kText = "1 2 3\n4 5 6\n7,8,9\n+10 11 12\n";

class Nrrd : public testing::Test {
 protected:
    Result<DecodedHere> decode(const std::string& bytes, std::optional<uint32_t> frame = {}) const {
        return decode_here(folder_.write("v.nrrd", bytes), frame);
    }
    std::string refusal(const std::string& bytes) const {
        const Result<DecodedHere> result = decode(bytes);
        return result ? "not refused" : result.error().message;
    }
    // A header of these lines before twelve raw shorts.
    static std::string raw(const std::string& lines) {
        return "NRRD0005\n" + lines + "\n" + twelve_shorts();
    }
    TemporaryFolder folder_;
};

const std::string kShort3d =
    "type: short\ndimension: 3\nsizes: 3 2 2\nencoding: raw\nendian: little\n";

TEST_F(Nrrd, EveryEncodingGivesTheSameVolume) {
    const std::string files[] = {
        nrrd_header() + "\n" + twelve_shorts(),
        nrrd_header("encoding: raw\nendian: big\n") + "\n" + twelve_shorts(true),
        nrrd_header("encoding: gzip\nendian: little\n") + "\n" + deflated(twelve_shorts()),
        nrrd_header("encoding: gz\nendian: big\n") + "\n" + deflated(twelve_shorts(true)),
        nrrd_header("encoding: ascii\n") + "\n" + kText,
        nrrd_header("encoding: text\n") + "\n" + kText,
        nrrd_header("encoding: raw\nendian: little\nbyte skip: 3\n") + "\nabc" + twelve_shorts(),
        nrrd_header("encoding: raw\nendian: little\nbyteskip: -1\n") + "\nabcde" + twelve_shorts(),
        nrrd_header("encoding: raw\nendian: little\nline skip: 2\nbyte skip: 1\n") + "\na\n\nb" +
            twelve_shorts(),
        nrrd_header("encoding: gzip\nendian: little\nline skip: 1\n") + "\nskipped\n" +
            deflated(twelve_shorts()),
        nrrd_header("encoding: gzip\nendian: little\nbyte skip: 2\n") + "\n" +
            deflated("ab" + twelve_shorts()),
        nrrd_header("encoding: gzip\nendian: little\nbyte skip: -1\n") + "\n" +
            deflated("abc" + twelve_shorts()),
        nrrd_header("encoding: raw\nendian: little\nbyte skip:= -1\n") + "\n" + twelve_shorts(),
    };
    for (const std::string& bytes : files) {
        const auto result = decode(bytes);
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->values, kOneToTwelve);
        EXPECT_EQ(world_point(result->decoded.grid, {1, 1, 1}), glm::dvec3(12, 23, 34));
        EXPECT_THAT(result->decoded.warnings, IsEmpty());
    }
}

TEST_F(Nrrd, LinesMayEndInCarriageReturns) {
    std::string header = nrrd_header() + "\n", with_returns;
    for (const char c : header)
        with_returns += c == '\n' ? "\r\n" : std::string(1, c);
    EXPECT_EQ(decode(with_returns + twelve_shorts())->values, kOneToTwelve);
}

TEST_F(Nrrd, VoxelsMayBeSpreadOverNumberedFiles) {
    const std::string bytes = twelve_shorts();
    folder_.write("s1.raw", bytes.substr(0, 8));
    folder_.write("s3.raw", bytes.substr(8, 8));
    folder_.write("s5.raw", bytes.substr(16));
    const auto read = [&](const std::string& list) {
        return decode_here(folder_.write(
            "v.nhdr", nrrd_header("encoding: raw\nendian: little\ndata file: " + list + "\n")));
    };
    const auto result = read("s%d.raw 1 5 2");
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->values, kOneToTwelve);
    folder_.write("s5.raw", bytes.substr(17));
    EXPECT_THAT(read("s%d.raw 1 5 2").error().message, HasSubstr("expected 8 bytes"));
    EXPECT_THAT(read("s%d.raw 1 3 2").error().message, HasSubstr("expected 12 bytes"));
}

TEST_F(Nrrd, DetachedDataLieInTheHeadersFolder) {
    folder_.write("v.raw", twelve_shorts());
    std::filesystem::create_directory(folder_.path() / "below");
    folder_.write("below/v.raw", twelve_shorts());
    for (const char* file : {"v.raw", "./v.raw", "below/v.raw"})
        for (const char* end : {"\n", "\n\n", ""}) {
            const std::string header =
                nrrd_header("encoding: raw\nendian: little\ndata file: ") + file + end;
            const auto result = decode_here(folder_.write("v.nhdr", header));
            ASSERT_TRUE(result) << result.error().message;
            EXPECT_EQ(result->values, kOneToTwelve);
        }
    const auto refused = [&](const std::string& file) {
        const auto result =
            decode(nrrd_header("encoding: raw\nendian: little\ndata file: " + file + "\n\n"));
        return result ? "not refused" : result.error().message;
    };
    EXPECT_THAT(refused("/etc/passwd"), HasSubstr("outside"));
    EXPECT_THAT(refused("../v.raw"), HasSubstr("outside"));
    EXPECT_THAT(refused("below/../../v.raw"), HasSubstr("outside"));
    EXPECT_THAT(refused("missing.raw"), HasSubstr("no such file"));
    EXPECT_THAT(refused("LIST"), HasSubstr("list of them"));
    EXPECT_THAT(refused("s%03d.raw 1 4 1 2"), HasSubstr("list of them"));
    EXPECT_THAT(refused("s%s.raw 1 4 1"), HasSubstr("list of them"));
    EXPECT_THAT(refused("s%03d.raw 1 4 0"), HasSubstr("range of"));
    EXPECT_THAT(refused("s%03d.raw 1 4 1"), HasSubstr("no such file"));
    EXPECT_THAT(refused("../s%03d.raw 1 4 1"), HasSubstr("outside"));
    std::filesystem::create_symlink("/etc/passwd", folder_.path() / "link.raw");
    EXPECT_THAT(refused("link.raw"), HasSubstr("outside"));
    std::filesystem::create_directory(folder_.path() / "folder.raw");
    EXPECT_THAT(refused("folder.raw"), HasSubstr("regular file"));
}

TEST_F(Nrrd, SpacesTurnIntoLps) {
    const auto corner = [&](const std::string& space) {
        const auto result = decode(raw(kShort3d + "space: " + space +
                                       "\nspace directions: (2,0,0) (0,3,0) (0.5,0,4)\n"
                                       "space origin: (10,20,30)\n"));
        EXPECT_TRUE(result) << result.error().message;
        return world_point(result->decoded.grid, {1, 1, 1});
    };
    EXPECT_EQ(corner("left-posterior-superior"), glm::dvec3(12.5, 23, 34));
    EXPECT_EQ(corner("LPS"), glm::dvec3(12.5, 23, 34));
    EXPECT_EQ(corner("right-anterior-superior"), glm::dvec3(-12.5, -23, 34));
    EXPECT_EQ(corner("RAS"), glm::dvec3(-12.5, -23, 34));
    EXPECT_EQ(corner("left-anterior-superior"), glm::dvec3(12.5, -23, 34));
    EXPECT_EQ(corner("scanner-xyz"), glm::dvec3(12.5, 23, 34));
}

TEST_F(Nrrd, WithoutSpaceLpsIsTakenWithAWarning) {
    const auto result = decode(raw(kShort3d + "spacings: 2 3 4\n"));
    ASSERT_TRUE(result);
    EXPECT_EQ(world_point(result->decoded.grid, {1, 1, 1}), glm::dvec3(2, 3, 4));
    ASSERT_EQ(result->decoded.warnings.size(), 1u);
    EXPECT_THAT(result->decoded.warnings[0], HasSubstr("names no space"));
    const auto plain = decode(raw(kShort3d + "spacings: nan 3 4\naxis mins: 0 0 0\n"));
    EXPECT_EQ(world_point(plain->decoded.grid, {1, 1, 1}), glm::dvec3(1, 3, 4));
    EXPECT_EQ(plain->decoded.warnings.size(), 2u);
}

TEST_F(Nrrd, UnitsOfLengthBecomeMillimetres) {
    const auto step = [&](const std::string& units) {
        return decode(raw(kShort3d +
                          "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
                          "space units: " +
                          units + "\n"));
    };
    const auto x_of = [](const Result<DecodedHere>& result) {
        return world_point(result->decoded.grid, {1, 0, 0}).x;
    };
    EXPECT_EQ(x_of(step(R"("mm" "mm" "mm")")), 1);
    EXPECT_EQ(x_of(step(R"("cm" "cm" "cm")")), 10);
    EXPECT_EQ(x_of(step(R"("um" "um" "um")")), 0.001);
    const auto odd = step(R"("furlong" "mm" "mm")");
    EXPECT_EQ(x_of(odd), 1);
    EXPECT_THAT(odd->decoded.warnings[0], HasSubstr("furlong"));
    const auto mixed = step(R"("mm" "cm" "um")"); // each along its axis of the space
    ASSERT_TRUE(mixed) << mixed.error().message;
    EXPECT_EQ(world_point(mixed->decoded.grid, {1, 1, 1}), glm::dvec3(1, 10, 0.001));
}

TEST_F(Nrrd, FramesComponentsAndFewerAxesAreTold) {
    const std::string four =
        "type: short\ndimension: 4\nencoding: raw\nendian: little\nspace: "
        "LPS\n";
    const std::string frames =
        raw(four +
            "sizes: 3 2 1 2\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n"
            "kinds: domain domain domain list\n");
    EXPECT_EQ(decode(frames, 1)->values, (std::vector<double>{7, 8, 9, 10, 11, 12}));
    EXPECT_THAT(decode(frames)->decoded.warnings[0], HasSubstr("2 frames"));
    EXPECT_THAT(decode(frames, 2).error().message, HasSubstr("no frame 2"));

    const auto components =
        decode(raw(four + "sizes: 3 2 1 2\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"
                          "kinds: vector domain domain domain\n"));
    ASSERT_TRUE(components);
    EXPECT_EQ(components->claim.components, 3u);
    EXPECT_EQ(components->decoded.grid.size, glm::uvec3(2, 1, 2));

    const auto between =
        decode(raw(four + "sizes: 3 2 2 1\nspace directions: (1,0,0) none (0,1,0) (0,0,1)\n"));
    EXPECT_THAT(between.error().message, HasSubstr("between"));

    const auto line = decode(
        raw("type: short\ndimension: 1\nsizes: 12\nspacings: 2\nencoding: raw\nendian: little\n"));
    EXPECT_EQ(line->decoded.grid.size, glm::uvec3(12, 1, 1));
    const auto plane =
        decode(raw("type: short\ndimension: 2\nsizes: 6 2\nspace dimension: 2\n"
                   "space directions: (0,1) (2,0)\nencoding: raw\n"
                   "endian: little\n"));
    ASSERT_TRUE(plane) << plane.error().message;
    EXPECT_EQ(world_point(plane->decoded.grid, {1, 1, 0}), glm::dvec3(2, 1, 0));
}

TEST_F(Nrrd, LongerPayloadIsAWarningWithBothNumbers) {
    for (const auto& [encoding, payload] :
         {std::pair<std::string, std::string>{"raw", twelve_shorts() + "abc"},
          {"gzip", deflated(twelve_shorts() + "abc")},
          {"ascii", kText + " 13 14 15"}}) {
        const auto result =
            decode(nrrd_header("encoding: " + encoding + "\nendian: little\n") + "\n" + payload);
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->values, kOneToTwelve);
        ASSERT_EQ(result->decoded.warnings.size(), 1u);
        EXPECT_THAT(result->decoded.warnings[0],
                    testing::ContainsRegex(encoding == "ascii" ? "15 .* 12" : "27 .* 24"));
    }
}

TEST_F(Nrrd, TextMustBeNumbersOfTheType) {
    const auto sentence = [&](const std::string& type, const std::string& text) {
        return refusal("NRRD0004\ntype: " + type + "\ndimension: 1\nsizes: 2\nencoding: ascii\n\n" +
                       text);
    };
    EXPECT_THAT(sentence("uchar", "1 256"), HasSubstr("256"));
    EXPECT_THAT(sentence("uchar", "-1 2"), HasSubstr("-1"));
    EXPECT_THAT(sentence("short", "1.5 2"), HasSubstr("1.5"));
    EXPECT_THAT(sentence("float", "1 spam"), HasSubstr("spam"));
    EXPECT_THAT(sentence("float", "1"), HasSubstr("expected 2 numbers, found 1"));
    const auto good =
        decode("NRRD0004\ntype: float\ndimension: 1\nsizes: 3\nencoding: ascii\n\n-1.5e3 nan inf");
    ASSERT_TRUE(good);
    EXPECT_EQ(good->values[0], -1500);
    EXPECT_TRUE(std::isnan(good->values[1]));
}

TEST_F(Nrrd, HostileHeadersAreRefusedByField) {
    const auto with = [&](const std::string& lines) { return refusal(raw(lines)); };
    const std::string rest = "encoding: raw\nendian: little\n";
    EXPECT_THAT(with("type: block\ndimension: 3\nsizes: 3 2 2\n" + rest), HasSubstr("\"block\""));
    EXPECT_THAT(with("dimension: 3\nsizes: 3 2 2\n" + rest), HasSubstr("expected a type"));
    EXPECT_THAT(with("type: short\ndimension: 0\nsizes:\n" + rest), HasSubstr("1 to 16"));
    EXPECT_THAT(with("type: short\ndimension: 99\nsizes: 1\n" + rest), HasSubstr("\"99\""));
    EXPECT_THAT(with("type: short\ndimension: 3\nsizes: 3 2\n" + rest), HasSubstr("3 sizes"));
    EXPECT_THAT(with("type: short\ndimension: 3\nsizes: 3 -2 2\n" + rest), HasSubstr("found -2"));
    EXPECT_THAT(with("type: short\ndimension: 3\nsizes: 3 0 2\n" + rest), HasSubstr("found 0"));
    const std::string big = "2147483647 2147483647 2147483647";
    EXPECT_THAT(with("type: short\ndimension: 3\nsizes: " + big + "\n" + rest),
                HasSubstr("not a possible size"));
    EXPECT_THAT(with("type: short\ndimension: 3\nsizes: 9999999999999999999 1 1\n" + rest),
                HasSubstr("3 sizes"));
    EXPECT_THAT(with("type: short\ndimension: 3\nsizes: 2000 2000 2000\n" + rest),
                HasSubstr("24 bytes"));
    EXPECT_THAT(with(kShort3d + "encoding: raw\n"), HasSubstr("two fields \"encoding\""));
    EXPECT_THAT(with("type: short\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n"),
                HasSubstr("endian"));
    for (const char* encoding : {"bzip2", "hex", "zrl"})
        EXPECT_THAT(with("type: short\ndimension: 3\nsizes: 3 2 2\nendian: little\nencoding: " +
                         std::string(encoding) + "\n"),
                    HasSubstr(encoding));
    EXPECT_THAT(with(kShort3d + "byte skip: -5\n"), HasSubstr("-1 or more, found \"-5\""));
    EXPECT_THAT(with(kShort3d + "byte skip: 25\n"), HasSubstr("holds 0 bytes"));
    EXPECT_THAT(with(kShort3d + "line skip: -1\n"), HasSubstr("line skip"));
    EXPECT_THAT(with(kShort3d + "line skip: 100\n"), HasSubstr("100 lines"));
    EXPECT_THAT(with(kShort3d + "a line without a colon\n"), HasSubstr("field: value"));
    const auto directions = [&](const std::string& vectors) {
        return with(kShort3d + "space: LPS\nspace directions: " + vectors + "\n");
    };
    EXPECT_THAT(directions("(1,0,0) (0,1,0)"), HasSubstr("3 space directions"));
    EXPECT_THAT(directions("(1,0,0) (0,1,0) (0,0"), HasSubstr("3 space directions"));
    EXPECT_THAT(directions("(1,0,0) (0,1,0) (0,0,x)"), HasSubstr("3 space directions"));
    EXPECT_THAT(directions("(1,0,0) (0,1,0) (0,0,nan)"), HasSubstr("not finite"));
    EXPECT_THAT(directions("(1,0,0) (0,1,0) (1,1,0)"), HasSubstr("one plane"));
    EXPECT_THAT(directions("(1,0,0) (0,1,0) (0,0,0)"), HasSubstr("above 0 mm"));
    EXPECT_THAT(with(kShort3d + "space origin: (1)\n"), HasSubstr("space origin"));
    EXPECT_THAT(with(kShort3d + "kinds: domain\n"), HasSubstr("3 kinds"));
    EXPECT_THAT(with(kShort3d + "kinds: list list list\n"), HasSubstr("axis in space"));
    EXPECT_THAT(refusal("NRRD0004\n" + std::string(2 << 20, '#')), HasSubstr("empty line"));
    EXPECT_THAT(refusal("not a nrrd"), HasSubstr("NRRD000x"));
}

} // namespace
} // namespace palpate::io
