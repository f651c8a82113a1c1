// Segmentations of 3D Slicer: NRRD files whose segments lie in layers.

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/generated_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;

// Segments in layers, as 3D Slicer writes them.
struct Segment {
    std::string name;
    int layer = 0, value = 1;
};

// Segments are numbered in steps of `step`: those that were deleted leave gaps.
std::string keys_of(const std::vector<Segment>& segments, bool old, size_t step = 1) {
    std::string keys;
    for (size_t i = 0; i < segments.size(); ++i) {
        const std::string key = fmt::format("Segment{}_", i * step);
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
            "v.seg.nrrd", nrrd_header_of(sizes, order, type, big, as, "list",
                                         keys_of(segments, old, old ? 1 : 1 + i % 3)) +
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
        const auto result = decode_here(
            folder.write("v.seg.nrrd", nrrd_header_of(sizes, "txyz", type, false, Written::raw,
                                                      "list", keys_of(segments, false)) +
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
