// NRRD: units of length, frames along any axis, lists of files, layers of segmentations.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "engine/decode/length_units.h"
#include "engine/decode/volume_files.h"
#include "engine/volume/grid.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/generated_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kEncodings[] = {"raw", "gzip", "ascii"};

// A header whose axes are those of `order`; its spacing is 1, 2 and 3.
std::string header_of(const Sizes& sizes, const std::string& order, const NumberType& type,
                      bool big_endian, Written as, const std::string& list_kind,
                      const std::string& more = "") {
    std::string size_words, kinds, directions;
    for (const char axis : order) {
        size_words += " " + std::to_string(sizes.of(axis));
        kinds += axis == 't' ? " " + list_kind : " domain";
        directions += axis == 'x'   ? " (1,0,0)"
                      : axis == 'y' ? " (0,2,0)"
                      : axis == 'z' ? " (0,0,3)"
                                    : " none";
    }
    return "NRRD0005\ntype: " + std::string(type.nrrd) +
           "\ndimension: " + std::to_string(order.size()) + "\nsizes:" + size_words +
           "\nspace: LPS\nkinds:" + kinds + "\nspace directions:" + directions +
           "\nendian: " + (big_endian ? "big" : "little") +
           "\nencoding: " + kEncodings[static_cast<int>(as)] + "\n" + more;
}

TEST(LengthUnits, AreKnownByEveryNameOfTheirs) {
    const std::pair<double, std::vector<const char*>> units[] = {
        {1e-6, {"nm", "nanometer", "Nanometers", "nanometre"}},
        {1e-3,
         {"um", "micron", "microns", "Micrometer", "micrometers", "micrometre", "\xc2\xb5m",
          "\xce\xbcm", "\xb5m", "\\u00B5m"}},
        {1, {"mm", "millimeter", "millimeters", "millimetres", "MM", " mm "}},
        {10, {"cm", "centimeter", "centimeters", "centimetre"}},
        {1000, {"m", "meter", "meters", "metre", "metres"}},
        {25.4, {"in", "inch", "inches", "Inch"}},
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
            header_of(sizes, order, type, big, as, below(random, 2) == 1 ? "list" : "time") + "\n" +
            written(numbers, 0, numbers.size(), type, big, as);
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

// Runs of more than 4 KiB are read one by one, shorter ones out of blocks of 1 MiB.
TEST(NrrdFrames, OfManyNumbersAreReadInBlocks) {
    const TemporaryFolder folder;
    const NumberType type = number_type<int32_t>("int", "");
    for (const char* order : {"txyz", "xtyz", "xytz"}) {
        const Sizes sizes{100, 40, 30, 3};
        const std::vector<int> numbers = numbers_of(sizes, order);
        const auto path = folder.write(
            "v.nrrd", header_of(sizes, order, type, false, Written::raw, "list") + "\n" +
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
        return folder_.write(
            "v.nhdr", header_of(sizes, order, type, big, as, "list", "data file: " + field + "\n") +
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
            folder_.write("v.nhdr", header_of(sizes, "xyz", type, false, Written::raw, "list",
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

// Segments in layers, as 3D Slicer writes them.
struct Segment {
    std::string name;
    int layer = 0, value = 1;
};

std::string keys_of(const std::vector<Segment>& segments, bool old) {
    std::string keys;
    for (size_t i = 0; i < segments.size(); ++i) {
        const std::string key = fmt::format("Segment{}_", i);
        keys += key + fmt::format("ID:=Segment_{}\n", i + 1) + key + "Name:=" + segments[i].name +
                "\n" + key + "Color:=0.5 0.25 1\n";
        if (!old)
            keys += key + fmt::format("Layer:={}\n", segments[i].layer) + key +
                    fmt::format("LabelValue:={}\n", segments[i].value);
    }
    return keys;
}

TEST(NrrdLayers, BecomeOneLabelMapWithItsOverlapsNamed) {
    const TemporaryFolder folder;
    std::mt19937 random(3);
    const std::vector<NumberType> types = number_types();
    for (int i = 0; i < 40; ++i) {
        const int layers = 1 + below(random, 4);
        const bool old = i % 4 == 3, distinct = i % 4 == 1; // files of Slicer before 4.11
        std::vector<Segment> segments;
        std::vector<int> values_in(static_cast<size_t>(layers), 0); // so far
        const int count = old ? layers : 1 + below(random, 6);
        for (int s = 0; s < count; ++s) {
            const int layer = old ? s : below(random, layers);
            const int value = old        ? 1
                              : distinct ? 10 * s + 3
                                         : ++values_in[static_cast<size_t>(layer)];
            segments.push_back({fmt::format("part {}", s), layer, value});
        }
        const std::string order = std::array{"txyz", "xyzt", "xytz"}[static_cast<size_t>(i % 3)];
        const Sizes sizes{5, 4, 3, layers};
        // Any of the values of each layer, and at times one that no segment has.
        std::vector<std::vector<int>> choices(static_cast<size_t>(layers), {0, 0, 100});
        for (const Segment& segment : segments)
            choices[static_cast<size_t>(segment.layer)].push_back(segment.value);
        std::map<std::array<int, 4>, int> stored;
        std::vector<int> numbers = numbers_of(sizes, order);
        for (size_t at = 0; at < numbers.size(); ++at) {
            size_t rest = at;
            std::array<int, 4> place{};
            for (const char axis : order) {
                const auto size = static_cast<size_t>(sizes.of(axis));
                place[static_cast<size_t>(std::string("xyzt").find(axis))] =
                    static_cast<int>(rest % size);
                rest /= size;
            }
            const std::vector<int>& choice = choices[static_cast<size_t>(place[3])];
            numbers[at] = choice[static_cast<size_t>(below(random, int(choice.size())))];
            stored[place] = numbers[at];
        }
        // The answer by brute force.
        std::set<int> used;
        for (const Segment& segment : segments)
            used.insert(segment.value);
        const bool keep = used.size() == segments.size();
        std::vector<double> expected;
        std::map<std::pair<int, int>, int> overlaps;
        int unnamed = 0;
        for (int z = 0; z < sizes.z; ++z)
            for (int y = 0; y < sizes.y; ++y)
                for (int x = 0; x < sizes.x; ++x) {
                    std::set<int> labels;
                    for (int t = 0; t < layers; ++t) {
                        const int value = stored[{x, y, z, t}];
                        bool named = value == 0;
                        for (size_t s = 0; s < segments.size(); ++s)
                            if (segments[s].layer == t && segments[s].value == value) {
                                labels.insert(keep ? value : int(s) + 1);
                                named = true;
                            }
                        unnamed += !named;
                    }
                    for (const int a : labels)
                        for (const int b : labels)
                            if (a < b)
                                ++overlaps[{a, b}];
                    expected.push_back(labels.empty() ? 0 : *labels.rbegin());
                }
        const NumberType& type = types[static_cast<size_t>(below(random, 7))];
        const auto as = static_cast<Written>(below(random, 3));
        const bool big = below(random, 2) == 1;
        const auto result = decode_here(folder.write(
            "v.seg.nrrd", header_of(sizes, order, type, big, as, "list", keys_of(segments, old)) +
                              "\n" + written(numbers, 0, numbers.size(), type, big, as)));
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->values, expected) << i;
        EXPECT_EQ(result->decoded.labels.size(), segments.size());
        EXPECT_EQ(result->decoded.labels[0].color, glm::dvec3(0.5, 0.25, 1));
        std::string all;
        for (const std::string& warning : result->decoded.warnings)
            all += warning + "\n";
        if (unnamed > 0) {
            EXPECT_THAT(all, HasSubstr(fmt::format("{} samples of its layers", unnamed)));
        }
        EXPECT_EQ(all.find("overlap") != std::string::npos, !overlaps.empty());
        if (overlaps.size() > 8) // others are counted, not named
            continue;
        for (const auto& [pair, samples] : overlaps)
            EXPECT_THAT(all, testing::ContainsRegex(
                                 fmt::format("{} 'part [0-9]+' .[0-9]+ samples. and {} 'part "
                                             "[0-9]+' .[0-9]+ samples. in {} samples",
                                             pair.first, pair.second, samples)));
    }
}

TEST(NrrdLayers, HostileOnesAreRefused) {
    const TemporaryFolder folder;
    const Sizes sizes{3, 2, 1, 2};
    const NumberType type = number_type<int16_t>("short", "");
    const auto refusal = [&](const std::vector<Segment>& segments) {
        const auto result = decode_here(folder.write(
            "v.seg.nrrd",
            header_of(sizes, "txyz", type, false, Written::raw, "list", keys_of(segments, false)) +
                "\n" + twelve_shorts()));
        return result ? "not refused" : result.error().message;
    };
    EXPECT_EQ(refusal({{"a", 0, 1}, {"b", 1, 1}}), "not refused");
    EXPECT_THAT(refusal({{"a", 0, 1}, {"b", 2, 1}}), HasSubstr("layers 0 .. 1, found 2"));
    EXPECT_THAT(refusal({{"a", -1, 1}}), HasSubstr("layers 0 .. 1, found -1"));
    EXPECT_THAT(refusal({{"a", 1, 5}, {"b", 1, 5}}), HasSubstr("several of value 5 in layer 1"));
}

} // namespace
} // namespace palpate::io
