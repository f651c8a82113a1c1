// NRRD: units of length, frames along any axis, lists of files.

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>

#include "engine/decode/length_units.h"
#include "engine/decode/volume_files.h"
#include "engine/volume/grid.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/generated_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(LengthUnits, AreKnownByEveryNameOfTheirs) {
    const std::pair<double, std::vector<const char*>> units[] = {
        {1e-12, {"fm", "femtometer"}},
        {1e-7, {"\xc3\x85", "\xe2\x84\xab", "angstrom", "angstroms"}},
        {1e-6, {"nm", "nanometer", "Nanometers", "nanometre"}},
        {1e-3,
         {"um", "micron", "microns", "Micrometer", "micrometers", "micrometre", "\xc2\xb5m",
          "\xce\xbcm", "\xb5m", "\\u00B5m"}},
        {1, {"mm", "millimeter", "millimeters", "millimetres", "MM", " mm "}},
        {10, {"cm", "centimeter", "centimeters", "centimetre"}},
        {1000, {"m", "meter", "meters", "metre", "metres"}},
        {1e4, {"dam", "decameter"}},
        {1e5, {"hm", "hectometers"}},
        {0.0254, {"thou", "mil", "mils"}},
        {25.4 / 72, {"pt", "point", "points"}},
        {25.4 / 12, {"li", "line", "lines"}},
        {25.4, {"in", "inch", "inches", "Inch"}},
        {304.8, {"ft", "foot", "feet"}},
        {914.4, {"yd", "yard", "yards"}},
        {1609344, {"mi", "mile", "miles"}},
    };
    for (const auto& [mm, names] : units)
        for (const char* name : names)
            EXPECT_EQ(length_in_mm(name), mm) << name;
    for (const char* name : {"", "s", "ms", "furlong", "pixel", "u", "meterss", "minch"})
        EXPECT_FALSE(length_in_mm(name)) << name;
}

TEST(NrrdUnits, ScaleStepsAndOrigin) {
    const TemporaryFolder folder;
    const std::pair<const char*, double> units[] = {
        {"microns", 1e-3}, {"micrometers", 1e-3}, {"nm", 1e-6}, {"meters", 1000},
        {"inch", 25.4},    {"centimeters", 10},   {"mm", 1},    {"\xc2\xb5m", 1e-3}};
    const std::string shorts = twelve_shorts();
    for (const auto& [unit, mm] : units)
        for (const bool quoted : {true, false})
            for (const bool by_axis : {true, false})
                for (const bool directions : {true, false}) {
                    const std::string one = quoted ? "\"" + std::string(unit) + "\"" : unit;
                    const std::string text =
                        "NRRD0005\ntype: short\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n"
                        "endian: little\nspace: LPS\n" +
                        std::string(directions ? "space directions: (2,0,0) (0,3,0) (0,0,4)\n"
                                               : "spacings: 2 3 4\n") +
                        "space origin: (10,20,30)\n" + (by_axis ? "units: " : "space units: ") +
                        one + " " + one + " " + one + "\n\n" + shorts;
                    const auto result = decode_here(folder.write("v.nrrd", text));
                    ASSERT_TRUE(result) << result.error().message;
                    EXPECT_THAT(result->decoded.warnings, IsEmpty());
                    const glm::dmat4& m = result->decoded.grid.world_from_index;
                    EXPECT_EQ(m[0], glm::dvec4(2 * mm, 0, 0, 0)) << text;
                    EXPECT_EQ(m[1], glm::dvec4(0, 3 * mm, 0, 0));
                    EXPECT_EQ(m[2], glm::dvec4(0, 0, 4 * mm, 0));
                    EXPECT_EQ(m[3], glm::dvec4(10 * mm, 20 * mm, 30 * mm, 1));
                }
}

TEST(NrrdFrames, LieAlongAnyAxis) {
    const TemporaryFolder folder;
    std::mt19937 random(1);
    const std::vector<NumberType> types = number_types();
    for (int i = 0; i < 60; ++i) {
        const std::string order =
            std::array{"txyz", "xtyz", "xytz", "xyzt"}[static_cast<size_t>(i % 4)];
        const Sizes sizes{2 + below(random, 4), 1 + below(random, 4), 1 + below(random, 4),
                          1 + below(random, 5)};
        const NumberType& type = types[static_cast<size_t>(below(random, int(types.size())))];
        const bool big = below(random, 2) == 1;
        const auto as = static_cast<Written>(below(random, 3));
        const std::vector<int> numbers = numbers_of(sizes, order);
        const std::string bytes =
            nrrd_header_of(sizes, order, type, big, as, below(random, 2) == 1 ? "list" : "time") +
            "\n" + written(numbers, 0, numbers.size(), type, big, as);
        const auto path = folder.write("v.nrrd", bytes);
        for (int t = 0; t < sizes.t; ++t) {
            const auto result = decode_here(path, static_cast<uint32_t>(t));
            ASSERT_TRUE(result) << bytes << result.error().message;
            EXPECT_EQ(result->values, frame_of(sizes, t)) << bytes;
            EXPECT_EQ(result->decoded.grid.size, glm::uvec3(sizes.x, sizes.y, sizes.z));
            EXPECT_EQ(world_point(result->decoded.grid, {1, 1, 1}), glm::dvec3(1, 2, 3));
        }
        const auto first = decode_here(path);
        ASSERT_TRUE(first);
        EXPECT_EQ(first->decoded.warnings.size(), sizes.t > 1 ? 1u : 0u);
        EXPECT_THAT(decode_here(path, static_cast<uint32_t>(sizes.t)).error().message,
                    HasSubstr("no frame"));
    }
}

long most_kib() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

// 1: other values than expected; 2: more than 32 MiB of memory; 0: none.
int problem_of_reading(const std::filesystem::path& path, uint32_t frame,
                       const std::vector<double>& expected) {
    const long before = most_kib();
    const auto found = decode_here(path, frame);
    return !found || found->values != expected ? 1 : most_kib() - before < 32 << 10 ? 0 : 2;
}

// A packed file of 200 KB may claim frames by the hundred million: one voxel's numbers of all
// frames would take 100 MB.
TEST(NrrdFrames, OfAnyNumberTakeNoMemory) {
    const TemporaryFolder folder;
    constexpr size_t kFrames = 100'000'000, kPart = 1'000'000;
    const std::string part = deflated(std::string(kPart, '\0'));
    std::string text = fmt::format(
        "NRRD0005\ntype: uchar\ndimension: 4\nsizes: {} 2 1 1\nspace: LPS\nkinds: list domain "
        "domain domain\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nencoding: gzip\n\n",
        kFrames);
    for (size_t i = 0; i < 2 * kFrames / kPart - 1; ++i)
        text += part; // members of one file
    std::string last(kPart, '\0');
    last[kPart - 3] = 7;
    const auto path = folder.write("v.nrrd", text + deflated(last));
    const std::vector<double> expected{0, 7};
    EXPECT_EXIT(std::_Exit(problem_of_reading(path, uint32_t{kFrames} - 3, expected)),
                testing::ExitedWithCode(0), "");
}

// Runs of more than 4 KiB are read one by one, shorter ones out of blocks of 1 MiB.
TEST(NrrdFrames, OfManyNumbersAreReadInBlocks) {
    const TemporaryFolder folder;
    const NumberType type = number_type<int32_t>("int", "");
    for (const char* order : {"txyz", "xtyz", "xytz"}) {
        const Sizes sizes{100, 40, 30, 3};
        const std::vector<int> numbers = numbers_of(sizes, order);
        const auto path = folder.write(
            "v.nrrd", nrrd_header_of(sizes, order, type, false, Written::raw, "list") + "\n" +
                          written(numbers, 0, numbers.size(), type, false, Written::raw));
        const auto result = decode_here(path, 1);
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->values, frame_of(sizes, 1));
    }
}

TEST(NrrdFrames, OnSeveralAxesFollowOneAnother) {
    const TemporaryFolder folder;
    const auto decode = [&](const std::string& sizes, const std::string& kinds,
                            const std::string& directions, std::optional<uint32_t> frame) {
        return decode_here(
            folder.write("v.nrrd",
                         "NRRD0005\ntype: short\ndimension: 4\nsizes: " + sizes +
                             "\nencoding: raw\nendian: little\nspace: LPS\nkinds: " + kinds +
                             "\nspace directions: " + directions + "\n\n" + twelve_shorts()),
            frame);
    };
    const auto two = decode("2 3 1 2", "list time domain domain", "none none (1,0,0) (0,1,0)", 5);
    ASSERT_TRUE(two) << two.error().message;
    EXPECT_EQ(two->values, (std::vector<double>{6, 12}));
    EXPECT_THAT(decode("2 3 1 2", "list domain domain list", "none (1,0,0) (0,1,0) none", 0)
                    .error()
                    .message,
                HasSubstr("follow one another"));
    // A vector's components are no frames.
    EXPECT_EQ(decode("2 3 1 2", "vector domain domain domain", "none (1,0,0) (0,1,0) (0,0,1)", 0)
                  ->claim.components,
              2u);
}

// A header and its list of data files, cut into `parts` files of equal parts.
class NrrdLists : public testing::Test {
 protected:
    std::filesystem::path write(const Sizes& sizes, const std::string& order,
                                const NumberType& type, bool big, Written as, size_t parts,
                                const std::string& field) {
        const std::vector<int> numbers = numbers_of(sizes, order);
        std::string names;
        for (size_t i = 0; i < parts; ++i) {
            const std::string name = fmt::format("s{:03}.raw", 2 * i + 1);
            folder_.write(name, written(numbers, i * numbers.size() / parts, numbers.size() / parts,
                                        type, big, as));
            names += name + "\n";
        }
        return folder_.write("v.nhdr", nrrd_header_of(sizes, order, type, big, as, "list",
                                                      "data file: " + field + "\n") +
                                           (field.starts_with("LIST") ? names : ""));
    }
    TemporaryFolder folder_;
};

TEST_F(NrrdLists, HoldSlicesFramesOrSlabs) {
    std::mt19937 random(2);
    const std::vector<NumberType> types = number_types();
    const Sizes sizes{4, 3, 6, 2};
    struct Case {
        const char* order;
        size_t parts;
        const char* dimensions; // of a file; empty: left out
    };
    const Case cases[] = {{"xyz", 6, ""},  {"xyz", 6, "2"},  {"xyz", 3, "3"},  {"xyz", 18, "1"},
                          {"xyz", 1, "3"}, {"xyzt", 2, ""},  {"xyzt", 2, "3"}, {"xyzt", 12, "2"},
                          {"txyz", 6, ""}, {"txyz", 6, "3"}, {"txyz", 2, "4"}, {"txyz", 18, "2"}};
    for (const Case& c : cases)
        for (const Written as : {Written::raw, Written::packed, Written::text})
            for (const bool pattern : {false, true}) {
                const bool big = below(random, 2) == 1;
                const NumberType& type = types[static_cast<size_t>(below(random, 7))];
                const std::string field =
                    pattern ? fmt::format("s%03d.raw 1 {} 2 {}", 2 * c.parts - 1, c.dimensions)
                            : fmt::format("LIST {}", c.dimensions);
                const auto path = write(sizes, c.order, type, big, as, c.parts, field);
                EXPECT_EQ(volume_files(path).size(), c.parts + 1);
                const bool has_frames = std::string(c.order).find('t') != std::string::npos;
                for (int t = 0; t < (has_frames ? sizes.t : 1); ++t) {
                    const auto result = decode_here(path, static_cast<uint32_t>(t));
                    ASSERT_TRUE(result) << field << result.error().message;
                    EXPECT_EQ(result->values, frame_of(sizes, t)) << field << c.order;
                    EXPECT_THAT(result->decoded.warnings, IsEmpty());
                }
            }
}

TEST_F(NrrdLists, ThatDoNotFitAreRefusedByCause) {
    const Sizes sizes{4, 3, 6, 1};
    const NumberType type = number_type<int16_t>("short", "");
    const auto refusal = [&](const std::string& field, const std::string& names,
                             const std::string& more = "") {
        write(sizes, "xyz", type, false, Written::raw, 6, "LIST");
        const auto result = decode_here(
            folder_.write("v.nhdr", nrrd_header_of(sizes, "xyz", type, false, Written::raw, "list",
                                                   more + "data file: " + field + "\n" + names)));
        return result ? "not refused" : result.error().message;
    };
    const std::string all = "s001.raw\ns003.raw\ns005.raw\ns007.raw\ns009.raw\ns011.raw\n";
    EXPECT_EQ(refusal("LIST", all), "not refused");
    EXPECT_EQ(refusal("LIST 2", all + "\n\n"), "not refused");
    EXPECT_THAT(refusal("LIST", ""), HasSubstr("list of them"));
    EXPECT_THAT(refusal("LIST 2", all + "s011.raw\n"), HasSubstr("expected 6 data files of 2"));
    EXPECT_THAT(refusal("LIST", all + "s011.raw\n"), HasSubstr("share evenly"));
    EXPECT_THAT(refusal("LIST 9", all), HasSubstr("1 to 3 dimensions"));
    EXPECT_THAT(refusal("LIST 0", all), HasSubstr("1 to 3 dimensions"));
    EXPECT_THAT(refusal("LIST -1", all), HasSubstr("1 to 3 dimensions"));
    EXPECT_THAT(refusal("LIST", all.substr(9) + "none.raw\n"), HasSubstr("no such file"));
    EXPECT_THAT(refusal("LIST", all.substr(9) + "/etc/passwd\n"), HasSubstr("outside"));
    EXPECT_THAT(refusal("LIST", all.substr(9) + "../s001.raw\n"), HasSubstr("outside"));
    EXPECT_THAT(refusal("LIST", all, "line skip: 1\n"), HasSubstr("line skip"));
    EXPECT_THAT(refusal("LIST", all, "byte skip: 2\n"), HasSubstr("expected 24 bytes"));
    EXPECT_THAT(refusal("s%03d.raw 1 2147483647 1", ""), HasSubstr("range of"));
    EXPECT_THAT(refusal("s%03d.raw 1 -9223372036854775808 1", ""), HasSubstr("range of"));
    EXPECT_THAT(refusal("s%03d.raw 1 11 -2", ""), HasSubstr("range of"));
    EXPECT_THAT(refusal("s%s.raw 1 11 2", ""), HasSubstr("list of them"));
    EXPECT_THAT(refusal("s%03d%d.raw 1 11 2", ""), HasSubstr("list of them"));
}

} // namespace
} // namespace palpate::io
