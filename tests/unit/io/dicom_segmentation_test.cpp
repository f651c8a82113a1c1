// Segmentations (SEG), made byte by byte: each kind, placed by hand.

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <random>

#include "engine/io/volume_io.h"
#include "tests/unit/io/dicom_bytes.h"

namespace palpate {
namespace {

using test::DicomData;
using test::Folder;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Segmentation : public test::InEveryEncoding {};
INSTANTIATE_TEST_SUITE_P(Each, Segmentation, test::every_encoding(), test::encoding_name);

// 5 x 3 samples a frame, so that the bits of frames do not end at bytes.
constexpr int kColumns = 5, kRows = 3, kSamples = kColumns * kRows;

struct Frame {
    uint16_t segment;
    double z_mm;
    std::vector<int> values; // kSamples of them
};

// Samples that are `value` where set(x, y).
template <class Set>
std::vector<int> where(int value, const Set& set) {
    std::vector<int> values;
    for (int y = 0; y < kRows; ++y)
        for (int x = 0; x < kColumns; ++x)
            values.push_back(set(x, y) ? value : 0);
    return values;
}
std::vector<int> all(int value) {
    return std::vector<int>(kSamples, value);
}

DicomData segmentation(const char* kind, uint16_t allocated, const std::vector<Frame>& frames,
                       const char* slice_spacing = "2") {
    DicomData data = test::samples(kColumns, kRows, allocated, allocated, false);
    data.put(8, 0x60, "CS", "SEG").put(8, 0x103e, "LO", "organs").put(0x20, 0x0e, "UI", "1.2.3.9");
    data.put(0x28, 8, "IS", std::to_string(frames.size())).put(0x62, 1, "CS", kind);
    std::vector<DicomData> segments(2), per_frame;
    segments[0].put_words(0x62, 4, {1}).put(0x62, 5, "LO", "liver");
    // CIELAB of sRGB's red, (54.29, 80.81, 69.89) at D50.
    segments[0].put_words(0x62, 0xd, {35580, 53662, 50857});
    segments[1].put_words(0x62, 4, {300}).put(0x62, 5, "LO", "tumour");
    data.put_items(0x62, 2, segments);
    DicomData axes, measures, shared;
    axes.put(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0");
    measures.put(0x28, 0x30, "DS", "1.5\\0.5");
    if (slice_spacing)
        measures.put(0x18, 0x88, "DS", slice_spacing);
    shared.put_items(0x20, 0x9116, {axes}).put_items(0x28, 0x9110, {measures});
    data.put_items(0x5200, 0x9229, {shared});
    std::string bytes;
    std::vector<int> bits;
    for (const Frame& frame : frames) {
        DicomData position, identification, groups;
        position.put(0x20, 0x32, "DS", fmt::format("10\\-20\\{}", frame.z_mm));
        identification.put_words(0x62, 0xb, {frame.segment});
        groups.put_items(0x20, 0x9113, {position});
        if (frame.segment > 0)
            groups.put_items(0x62, 0xa, {identification});
        per_frame.push_back(groups);
        for (const int value : frame.values)
            if (allocated == 1)
                bits.push_back(value);
            else
                bytes += test::little(static_cast<uint64_t>(value), allocated / 8);
    }
    for (size_t i = 0; i < bits.size(); i += 8) {
        int byte = 0;
        for (size_t b = 0; b < 8 && i + b < bits.size(); ++b)
            byte |= bits[i + b] << b;
        bytes.push_back(static_cast<char>(byte));
    }
    data.put_items(0x5200, 0x9230, per_frame);
    return data.put(0x7fe0, 0x10, allocated == 16 ? "OW" : "OB", bytes);
}

Result<LoadedVolume> read(const DicomData& data, const char* class_uid = test::kSegClass,
                          const char* name = "seg.dcm") {
    const Folder folder("seg");
    test::write(folder / name, data.file(class_uid, "1.2.3.9.1"));
    return load_labels(folder / name);
}

// The labels of a slice, row by row.
std::vector<int> slice(const Volume& volume, uint32_t z) {
    std::vector<int> labels;
    for (uint32_t y = 0; y < volume.size().y; ++y)
        for (uint32_t x = 0; x < volume.size().x; ++x)
            labels.push_back(static_cast<int>(volume.value({x, y, z})));
    return labels;
}

const auto left = [](int x, int) { return x < 2; };
const auto right = [](int x, int) { return x >= 2; };
const auto upper = [](int, int y) { return y == 0; };

TEST_P(Segmentation, BinaryFramesLieWhereTheirGroupsPlaceThem) {
    // Stored from the top down, and sparse: nothing lies at 12 mm.
    const auto loaded = read(segmentation("BINARY", 1,
                                          {{1, 14, where(1, left)},
                                           {1, 10, where(1, upper)},
                                           {300, 14, where(1, right)},
                                           {300, 8, where(1, left)}}));
    ASSERT_TRUE(loaded) << loaded.error().message;
    const Volume& volume = loaded->volume;
    ASSERT_EQ(volume.size(), glm::uvec3(kColumns, kRows, 4));
    EXPECT_EQ(volume.type(), ScalarType::u16);
    EXPECT_EQ(slice(volume, 0), where(300, left));
    EXPECT_EQ(slice(volume, 1), where(1, upper));
    EXPECT_EQ(slice(volume, 2), all(0));
    std::vector<int> both = where(300, right);
    for (int i = 0; i < kSamples; ++i)
        both[static_cast<size_t>(i)] += where(1, left)[static_cast<size_t>(i)];
    EXPECT_EQ(slice(volume, 3), both);
    const glm::dmat4& m = volume.grid().world_from_index;
    EXPECT_EQ(m[0], glm::dvec4(0.5, 0, 0, 0));
    EXPECT_EQ(m[1], glm::dvec4(0, 1.5, 0, 0));
    EXPECT_EQ(m[2], glm::dvec4(0, 0, 2, 0));
    EXPECT_EQ(m[3], glm::dvec4(10, -20, 8, 1));
    EXPECT_THAT(loaded->warnings, IsEmpty());
    EXPECT_EQ(loaded->modality, "SEG");
}

TEST_P(Segmentation, StatedSpacingCountsWhereEverySecondSliceIsEmpty) {
    const auto loaded =
        read(segmentation("BINARY", 1, {{1, 0, all(1)}, {1, 4, all(1)}, {1, 8, all(1)}}));
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->volume.size().z, 5u);
    // The smallest gap is the step if none is stated.
    const auto unstated =
        read(segmentation("BINARY", 1, {{1, 0, all(1)}, {1, 4, all(1)}, {1, 12, all(1)}}, nullptr));
    ASSERT_TRUE(unstated) << unstated.error().message;
    EXPECT_EQ(unstated->volume.size().z, 4u);
}

TEST_P(Segmentation, NamesAndColoursAreKept) {
    const auto loaded = read(segmentation("BINARY", 1, {{1, 0, all(1)}}));
    ASSERT_TRUE(loaded) << loaded.error().message;
    ASSERT_EQ(loaded->labels.size(), 2u);
    EXPECT_EQ(loaded->labels[0].label, 1u);
    EXPECT_EQ(loaded->labels[0].name, "liver");
    ASSERT_TRUE(loaded->labels[0].color);
    // The figures above have four digits; a hundredth in a* is less than 1e-3 in sRGB.
    EXPECT_NEAR(loaded->labels[0].color->x, 1, 4e-3);
    EXPECT_NEAR(loaded->labels[0].color->y, 0, 4e-2); // steep near black
    EXPECT_NEAR(loaded->labels[0].color->z, 0, 4e-2);
    EXPECT_EQ(loaded->labels[1].label, 300u);
    EXPECT_FALSE(loaded->labels[1].color);
}

TEST_P(Segmentation, OverlapsGoToTheHigherNumberAndAreNamed) {
    const auto loaded = read(segmentation(
        "BINARY", 1, {{300, 0, where(1, upper)}, {1, 0, where(1, left)}, {1, 2, all(1)}}));
    ASSERT_TRUE(loaded) << loaded.error().message;
    std::vector<int> expected = where(1, left);
    for (int x = 0; x < kColumns; ++x)
        expected[static_cast<size_t>(x)] = 300;
    EXPECT_EQ(slice(loaded->volume, 0), expected);
    EXPECT_THAT(loaded->warnings,
                ElementsAre(AllOf(HasSubstr("1 'liver' and 300 'tumour' in 2 samples"),
                                  HasSubstr("higher number"))));
}

// Segments of chance, up to six at a sample, whose frames come in any order and more than once: of
// each pair the samples are counted that both have.
TEST_P(Segmentation, EveryPairOfSegmentsIsCountedWhereverMoreOverlap) {
    constexpr uint16_t kSegments[] = {1, 2, 3, 4, 5, 6};
    for (uint32_t seed = 0; seed < 6; ++seed) { // of each kind, in each encoding
        std::mt19937 random(seed);
        const bool fractional = seed % 3 == 2;
        const size_t segments = 2 + seed % 3; // six pairs at most, which are all in words
        const int per_cent = 20 + int(random() % 70);
        std::vector<Frame> frames;
        std::map<std::pair<int, std::pair<double, int>>, bool> has; // segment, z, sample
        for (size_t s = 0; s < segments; ++s)
            for (const double z : {0.0, 2.0, 4.0})
                for (uint32_t again = 0; again < 1 + random() % 2; ++again) {
                    Frame frame{kSegments[s], z, all(0)};
                    for (int i = 0; i < kSamples; ++i)
                        if (int(random() % 100) < per_cent) {
                            frame.values[size_t(i)] = fractional ? 100 + int(random() % 100) : 1;
                            has[{kSegments[s], {z, i}}] = true;
                        }
                    frames.push_back(std::move(frame));
                }
        std::shuffle(frames.begin(), frames.end(), random);
        DicomData data =
            segmentation(fractional ? "FRACTIONAL" : "BINARY", fractional ? 8 : 1, frames);
        if (fractional)
            data.put_words(0x62, 0xe, {200});
        const auto loaded = read(data);
        ASSERT_TRUE(loaded) << loaded.error().message;
        std::string expected;
        const auto words = [](int segment) {
            return segment == 1 ? std::string("1 'liver'") : std::to_string(segment);
        };
        for (size_t a = 0; a < segments; ++a)
            for (size_t b = a + 1; b < segments; ++b) {
                int both = 0;
                for (const double z : {0.0, 2.0, 4.0})
                    for (int i = 0; i < kSamples; ++i)
                        both += has.contains({kSegments[a], {z, i}}) &&
                                has.contains({kSegments[b], {z, i}});
                if (both > 0)
                    expected +=
                        fmt::format("{}{} and {} in {} samples", expected.empty() ? "" : ", ",
                                    words(kSegments[a]), words(kSegments[b]), both);
            }
        EXPECT_THAT(loaded->warnings, Contains(HasSubstr("segments overlap: " + expected + ";")))
            << "seed " << seed;
    }
}

TEST_P(Segmentation, FractionsOfAHalfOrMoreCarryTheLabel) {
    DicomData data = segmentation("FRACTIONAL", 8,
                                  {{1, 0, where(100, left)},
                                   {300, 0, where(99, upper)},
                                   {1, 2, where(199, left)},
                                   {300, 2, where(200, upper)}});
    data.put_words(0x62, 0xe, {200});
    const auto loaded = read(data);
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(slice(loaded->volume, 0), where(1, left));
    std::vector<int> expected = where(1, left);
    for (int x = 0; x < kColumns; ++x)
        expected[static_cast<size_t>(x)] = 300;
    EXPECT_EQ(slice(loaded->volume, 1), expected);
    EXPECT_THAT(loaded->warnings,
                AllOf(Contains(HasSubstr("100 of 200")), Contains(HasSubstr("in 2 samples"))));
}

TEST_P(Segmentation, LabelMapsHoldTheNumbersOfSegments) {
    for (const uint16_t bits : {8, 16}) {
        const int tumour = bits == 8 ? 200 : 300;
        const auto loaded = read(
            segmentation("LABELMAP", bits, {{0, 2, where(tumour, right)}, {0, 0, where(1, left)}}),
            test::kLabelMapClass);
        ASSERT_TRUE(loaded) << loaded.error().message;
        EXPECT_EQ(slice(loaded->volume, 0), where(1, left));
        EXPECT_EQ(slice(loaded->volume, 1), where(tumour, right));
        EXPECT_THAT(loaded->warnings, IsEmpty());
    }
}

TEST_P(Segmentation, IsRefusedWhereItCannotBePlaced) {
    const auto error_of = [](const DicomData& data) {
        const auto loaded = read(data);
        return loaded ? std::string("loaded") : loaded.error().message;
    };
    EXPECT_THAT(
        error_of(segmentation("BINARY", 1, {{1, 0, all(1)}, {1, 2, all(1)}, {1, 5.1, all(1)}})),
        HasSubstr("no even grid"));
    EXPECT_THAT(error_of(segmentation("BINARY", 1, {{0, 0, all(1)}})),
                HasSubstr("segment of frame"));
    EXPECT_THAT(error_of(segmentation("BINARY", 1, {{1, 0, all(1)}}).erase(0x5200, 0x9230)),
                HasSubstr("segment of frame 0"));
    EXPECT_THAT(error_of(segmentation("BINARY", 1, {{1, 0, all(1)}, {1, 1e7, all(1)}}, "1")),
                HasSubstr("10000001 slices"));
    EXPECT_THAT(error_of(segmentation("FRACTIONAL", 8, {{1, 0, all(1)}})),
                HasSubstr("largest value"));
    EXPECT_THAT(error_of(segmentation("SOME", 8, {{1, 0, all(1)}})), HasSubstr("'SOME'"));
}

TEST_P(Segmentation, BesideACtIsListedAndChosen) {
    const Folder folder("seg_beside");
    for (int z = 0; z < 3; ++z)
        test::write(folder / fmt::format("{}.dcm", z), test::dicom_slice(z));
    test::write(folder / "seg.dcm",
                segmentation("BINARY", 1, {{1, 0, all(1)}}).file(test::kSegClass, "1.2.3.9.1"));
    const auto ct = load_volume(folder.path());
    ASSERT_TRUE(ct) << ct.error().message;
    EXPECT_EQ(ct->volume.size(), glm::uvec3(8, 4, 3));
    EXPECT_THAT(ct->warnings, IsEmpty());
    ASSERT_EQ(ct->series.size(), 2u);
    EXPECT_TRUE(ct->series[0].is_read);
    EXPECT_EQ(ct->series[1].modality, "SEG");
    EXPECT_EQ(ct->series[1].description, "organs");
    EXPECT_THAT(ct->series[1].content, HasSubstr("segmentation, 1 image of 5 x 3"));
    const auto seg = load_labels(folder.path(), {.series = "organs"});
    ASSERT_TRUE(seg) << seg.error().message;
    EXPECT_EQ(slice(seg->volume, 0), all(1));
}

} // namespace
} // namespace palpate
