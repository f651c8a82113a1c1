// DICOM values without data, values shown inverted, floating-point pixels, and pixel spacings
// stated elsewhere than in Pixel Spacing.

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <random>

#include "engine/io/volume_io.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/unit/io/sample_files.h"

namespace palpate {
namespace {

using test::DicomData;
using test::Folder;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kColumns = 6, kRows = 5;

LoadedVolume loaded(const std::filesystem::path& path, bool labels = false,
                    const ReadOptions& options = {}) {
    Result<LoadedVolume> result = labels ? load_labels(path, options) : load_volume(path, options);
    if (!result)
        throw std::runtime_error(result.error().message);
    return std::move(*result);
}

// An image of one series at a height, without pixels and without a pixel spacing.
DicomData image_at(double z_mm, uint16_t allocated, uint16_t stored, bool is_signed) {
    DicomData data = test::samples(kColumns, kRows, allocated, stored, is_signed);
    data.put(8, 0x60, "CS", "OT").put(0x20, 0x0e, "UI", "1.2").put(0x20, 0x13, "IS", "1");
    data.put(0x20, 0x32, "DS", fmt::format("0\\0\\{}", z_mm));
    return data.put(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0");
}

DicomData with_spacing(DicomData data) {
    return data.put(0x28, 0x30, "DS", "1\\1");
}

std::string file_of(const DicomData& data, int number) {
    return data.file(test::kCtClass, fmt::format("1.2.{}", number));
}

std::string bytes_of(const std::vector<int64_t>& values, int bytes) {
    std::string text;
    for (const int64_t value : values)
        text += test::little(static_cast<uint64_t>(value), bytes);
    return text;
}

// Files are written in the four encodings in turn.
class DicomValues : public testing::Test {
 protected:
    ~DicomValues() override { test::default_encoding = {}; }
    static void encode(int number) {
        test::default_encoding = {.implicit = number % 2 != 0, .delimited = number / 2 % 2 != 0};
    }
};
using DicomPadding = DicomValues;
using DicomFloats = DicomValues;
using DicomSpacing = DicomValues;

// ---- padding

TEST_F(DicomPadding, HoldsNoDataWhateverItsSignOrderAndType) {
    for (int seed = 0; seed < 24; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937_64 random(static_cast<uint64_t>(seed));
        const auto below = [&](int64_t end) {
            return static_cast<int64_t>(random() % static_cast<uint64_t>(end));
        };
        encode(seed / 3);
        constexpr int kAllocated[] = {8, 16, 16, 32};
        const int allocated = kAllocated[seed % 4];
        const int stored = allocated == 16 && seed % 8 == 1 ? 12 : allocated;
        const bool is_signed = seed / 4 % 2 == 0;
        // Padding is a word of 16 bits, also where samples have 8 or 32.
        const int bits = std::min(stored, 16);
        const int64_t least = is_signed ? -(int64_t{1} << (bits - 1)) : 0;
        const int64_t most = least + (int64_t{1} << bits) - 1;
        const double slope = seed % 3 == 0 ? 1 : 2, intercept = seed % 3 == 0 ? 0 : -1000;

        const Folder folder("padding");
        std::vector<std::vector<int64_t>> slices;
        std::vector<std::pair<int64_t, int64_t>> ranges;
        for (int z = 0; z < 3; ++z) {
            const int64_t first = seed % 5 == 0 ? least : least + below(most - least - 20);
            // One value; or a range whose limit is below or above it. The last slice may have none.
            int64_t limit = seed % 2 == 0 ? first : first + 10;
            const bool none = seed % 7 == 6 && z == 2;
            ranges.emplace_back(first, limit);
            std::vector<int64_t>& values = slices.emplace_back();
            for (int i = 0; i < kColumns * kRows; ++i) // the ends, beside them, and any
                values.push_back(std::clamp(i == 0   ? first
                                            : i == 1 ? limit
                                            : i == 2 ? first - 1
                                            : i == 3 ? limit + 1
                                            : i == 4 ? (first + limit) / 2
                                                     : least + below(most - least),
                                            least, most));
            DicomData data = with_spacing(image_at(2.0 * z, static_cast<uint16_t>(allocated),
                                                   static_cast<uint16_t>(stored), is_signed));
            data.put(0x28, 0x1052, "DS", std::to_string(intercept));
            data.put(0x28, 0x1053, "DS", std::to_string(slope));
            const bool turned = seed % 4 >= 2;
            const char* vr = is_signed ? "SS" : "US";
            // Some write the stored bits alone.
            const int64_t mask = seed % 16 == 1 ? 0xfff : 0xffff;
            if (!none) {
                data.put(0x28, 0x120, vr, bytes_of({(turned ? limit : first) & mask}, 2));
                if (limit != first)
                    data.put(0x28, 0x121, vr, bytes_of({(turned ? first : limit) & mask}, 2));
            } else {
                ranges.back() = {1, 0};
            }
            data.put(0x7fe0, 0x10, allocated == 8 ? "OB" : "OW", bytes_of(values, allocated / 8));
            test::write(folder / fmt::format("{}.dcm", z), file_of(data, z));
        }
        const LoadedVolume padded = loaded(folder.path());
        uint64_t none = 0;
        for (uint32_t z = 0; z < 3; ++z)
            for (uint32_t i = 0; i < kColumns * kRows; ++i) {
                const int64_t value = slices[z][i];
                const float found = padded.volume.value({i % kColumns, i / kColumns, z});
                if (value >= ranges[z].first && value <= ranges[z].second) {
                    EXPECT_TRUE(std::isnan(found)) << value;
                    ++none;
                } else {
                    EXPECT_EQ(found,
                              static_cast<float>(slope * static_cast<double>(value) + intercept));
                }
            }
        EXPECT_EQ(padded.volume.no_data_count(), none);
        EXPECT_THAT(padded.notes,
                    Contains(HasSubstr(fmt::format("{} of 90 samples are padding", none))));
        EXPECT_THAT(padded.warnings, IsEmpty());
    }
}

TEST_F(DicomPadding, ThatNoSampleHasChangesNothing) {
    const Folder folder("padding_none");
    DicomData data = with_spacing(image_at(0, 16, 16, true));
    data.put(0x28, 0x120, "SS", bytes_of({-2000}, 2));
    data.put(0x7fe0, 0x10, "OW", test::words_16(std::vector<int>(kColumns * kRows, -300)));
    test::write(folder / "a.dcm", file_of(data, 0));
    EXPECT_EQ(loaded(folder / "a.dcm").volume.type(), ScalarType::i16);
}

TEST_F(DicomPadding, OfLabelsIsTheirBackground) {
    const Folder folder("padding_labels");
    DicomData data = with_spacing(image_at(0, 16, 16, false));
    std::vector<int> labels(kColumns * kRows, 0);
    labels[7] = 3;
    data.put(0x28, 0x120, "US", bytes_of({0}, 2));
    data.put(0x7fe0, 0x10, "OW", test::words_16(labels));
    test::write(folder / "a.dcm", file_of(data, 0));
    const LoadedVolume map = loaded(folder / "a.dcm", true);
    EXPECT_EQ(map.volume.value({1, 1, 0}), 3.0f);
    EXPECT_EQ(map.volume.no_data_count(), 0u);
}

TEST_F(DicomPadding, IsNotInterpolated) {
    const Folder folder("padding_resampled");
    for (const int z : {0, 2, 3}) {
        DicomData data = with_spacing(image_at(2.0 * z, 16, 16, true));
        std::vector<int> values(kColumns * kRows, 100);
        values[0] = -2000;
        data.put(0x28, 0x120, "SS", bytes_of({-2000}, 2));
        data.put(0x7fe0, 0x10, "OW", test::words_16(values));
        test::write(folder / fmt::format("{}.dcm", z), file_of(data, z));
    }
    const LoadedVolume whole = loaded(folder.path(), false, {.resample_slices = true});
    for (uint32_t z = 0; z < whole.volume.size().z; ++z) {
        EXPECT_TRUE(std::isnan(whole.volume.value({0, 0, z})));
        EXPECT_EQ(whole.volume.value({1, 0, z}), 100.0f);
    }
}

// ---- which values are bright

TEST(DicomMonochrome, IsToldWhereSmallValuesAreBright) {
    const Folder folder("monochrome");
    for (const char* words : {"MONOCHROME1", "MONOCHROME2"}) {
        DicomData data = with_spacing(image_at(0, 16, 16, false));
        data.put(0x28, 4, "CS", words);
        std::vector<int> values(kColumns * kRows, 7);
        values[1] = 90;
        data.put(0x7fe0, 0x10, "OW", test::words_16(values));
        test::write(folder / words, file_of(data, 0));
        const LoadedVolume image = loaded(folder / words);
        EXPECT_EQ(image.inverted, words == std::string("MONOCHROME1"));
        EXPECT_EQ(image.volume.value({0, 0, 0}), 7.0f);
        EXPECT_EQ(image.volume.value({1, 0, 0}), 90.0f);
    }
}

// ---- floating-point pixels

template <class T>
std::string float_bytes(const std::vector<T>& values) {
    using Bits = std::conditional_t<sizeof(T) == 4, uint32_t, uint64_t>;
    std::string text;
    for (const T value : values)
        text += test::little(std::bit_cast<Bits>(value), sizeof(T));
    return text;
}

// Values of any size and sign; the first two are padding, the third is none.
template <class T>
void expect_floats(int seed) {
    const bool doubles = sizeof(T) == 8;
    std::mt19937_64 random(static_cast<uint64_t>(seed));
    std::vector<T> values;
    for (int i = 0; i < kColumns * kRows; ++i)
        values.push_back(std::ldexp(static_cast<T>(static_cast<int>(random() % 2001) - 1000),
                                    static_cast<int>(random() % 21) - 10));
    values[0] = T(-9999.5);
    values[1] = T(-9000);
    values[2] = std::numeric_limits<T>::quiet_NaN();
    DicomData data = with_spacing(image_at(0, doubles ? 64 : 32, 16, false));
    data.erase(0x28, 0x101).erase(0x28, 0x102).erase(0x28, 0x103);
    const char* const vr = doubles ? "FD" : "FL";
    const uint16_t last = doubles ? 1 : 0;
    data.put(0x28, 0x122 + last, vr, float_bytes<T>({T(-9999.5)}));
    data.put(0x28, 0x124 + last, vr, float_bytes<T>({T(-9000)}));
    data.put(0x7fe0, 8 + last, doubles ? "OD" : "OF", float_bytes(values));
    const Folder folder("floats");
    test::write(folder / "a.dcm", file_of(data, 0));
    const LoadedVolume image = loaded(folder / "a.dcm");
    EXPECT_EQ(image.volume.no_data_count(), 3u);
    for (uint32_t i = 3; i < values.size(); ++i)
        EXPECT_EQ(image.volume.value({i % kColumns, i / kColumns, 0}),
                  static_cast<float>(values[i]));
    // Cut off, and of other bits than it says.
    const std::string whole = file_of(data, 0);
    test::write(folder / "cut.dcm", whole.substr(0, whole.size() - 5));
    const Result<LoadedVolume> cut = load_volume(folder / "cut.dcm");
    ASSERT_FALSE(cut);
    EXPECT_THAT(cut.error().message, AllOf(HasSubstr("cut.dcm"), HasSubstr("cut off")));
    data.put_words(0x28, 0x100, {16});
    test::write(folder / "bits.dcm", file_of(data, 0));
    const Result<LoadedVolume> bits = load_volume(folder / "bits.dcm");
    ASSERT_FALSE(bits);
    EXPECT_THAT(bits.error().message, HasSubstr("floating-point samples of 16 bits"));
}

TEST_F(DicomFloats, AreReadWithTheirPadding) {
    for (int seed = 0; seed < 4; ++seed) {
        encode(seed);
        expect_floats<float>(seed);
        expect_floats<double>(seed);
    }
}

TEST_F(DicomFloats, BesideWholeNumbersAreOneVolume) {
    const Folder folder("mixed");
    for (int z = 0; z < 4; ++z) {
        DicomData data = with_spacing(image_at(z, z % 2 ? 32 : 16, 16, false));
        if (z % 2)
            data.put(0x7fe0, 8, "OF", float_bytes(std::vector<float>(kColumns * kRows, 0.5f + z)));
        else
            data.put(0x7fe0, 0x10, "OW", test::words_16(std::vector<int>(kColumns * kRows, z)));
        test::write(folder / fmt::format("{}.dcm", z), file_of(data, z));
    }
    const LoadedVolume mixed = loaded(folder.path());
    for (uint32_t z = 0; z < 4; ++z)
        EXPECT_EQ(mixed.volume.value({3, 3, z}), z % 2 ? 0.5f + static_cast<float>(z) : z);
}

// ---- pixel spacings

std::string doubles(double value) {
    return float_bytes<double>({value});
}

// A region of an ultrasound image: unit 3 is cm, 4 is s.
DicomData region(double dx, double dy, uint16_t unit_x = 3, uint16_t unit_y = 3) {
    DicomData data;
    data.put_words(0x18, 0x6012, {1}).put_words(0x18, 0x6014, {1});
    data.put_words(0x18, 0x6024, {unit_x}).put_words(0x18, 0x6026, {unit_y});
    return data.put(0x18, 0x602c, "FD", doubles(dx)).put(0x18, 0x602e, "FD", doubles(dy));
}

LoadedVolume plain_image(DicomData data) {
    data.put(0x7fe0, 0x10, "OW", test::words_16(std::vector<int>(kColumns * kRows, 5)));
    const Folder folder("spacing");
    test::write(folder / "a.dcm", file_of(data, 0));
    return loaded(folder / "a.dcm");
}

TEST_F(DicomSpacing, OfUltrasoundIsThatOfItsRegions) {
    std::mt19937_64 random(1);
    for (int seed = 0; seed < 8; ++seed) {
        encode(seed);
        const double x = 0.01 + 0.001 * static_cast<double>(random() % 100);
        const double y = 0.01 + 0.001 * static_cast<double>(random() % 100);
        const double sign = seed % 2 ? -1 : 1; // from the other end
        std::vector<DicomData> regions(1 + static_cast<size_t>(seed) % 3, region(sign * x, y));
        if (seed >= 3)
            regions.insert(regions.begin(), region(0.002, 0.5, 4, 7)); // a spectrum: s, cm/s
        DicomData data = image_at(0, 16, 16, false);
        const LoadedVolume image = plain_image(data.put_items(0x18, 0x6011, regions));
        const glm::dvec3 spacing = spacing_mm(image.volume.grid());
        EXPECT_NEAR(spacing.x, 10 * x, 1e-12);
        EXPECT_NEAR(spacing.y, 10 * y, 1e-12);
        EXPECT_THAT(image.warnings, Not(Contains(HasSubstr("pixel spacing (1 mm)"))));
        if (seed >= 3)
            EXPECT_THAT(image.warnings, Contains(HasSubstr("1 more of its regions")));
        else
            EXPECT_THAT(image.warnings, Not(Contains(HasSubstr("region"))));
    }
}

TEST_F(DicomSpacing, OfUltrasoundRegionsThatDifferIsNotTaken) {
    DicomData data = image_at(0, 16, 16, false);
    data.put_items(0x18, 0x6011, {region(0.02, 0.02), region(0.03, 0.02)});
    const LoadedVolume several = plain_image(data);
    EXPECT_EQ(spacing_mm(several.volume.grid()).x, 1.0);
    EXPECT_THAT(several.warnings, AllOf(Contains(HasSubstr("0.2 x 0.2 and 0.3 x 0.2 mm")),
                                        Contains(HasSubstr("pixel spacing (1 mm)"))));
    data.put_items(0x18, 0x6011, {region(0.02, 0.02, 4, 7)});
    EXPECT_THAT(plain_image(data).warnings, Contains(HasSubstr("state no lengths in centimetres")));
    data.put(0x28, 0x30, "DS", "0.7\\0.5"); // Pixel Spacing goes first
    const LoadedVolume stated = plain_image(data);
    EXPECT_NEAR(spacing_mm(stated.volume.grid()).x, 0.5, 1e-12);
    EXPECT_THAT(stated.warnings, Not(Contains(HasSubstr("region"))));
}

TEST_F(DicomSpacing, AtTheDetectorOrOnTheFilmIsTakenWithAWarning) {
    const std::pair<uint16_t, const char*> elements[] = {{0x1164, "at the detector"},
                                                         {0x2010, "of the film"}};
    for (const auto& [number, words] : elements) {
        DicomData data = image_at(0, 16, 16, false);
        data.put(0x18, number, "DS", "0.2\\0.1");
        const LoadedVolume image = plain_image(data);
        EXPECT_NEAR(spacing_mm(image.volume.grid()).x, 0.1, 1e-12);
        EXPECT_NEAR(spacing_mm(image.volume.grid()).y, 0.2, 1e-12);
        EXPECT_THAT(image.warnings, Contains(HasSubstr(words)));
        const LoadedVolume both = plain_image(with_spacing(data));
        EXPECT_EQ(spacing_mm(both.volume.grid()).x, 1.0);
        EXPECT_THAT(both.warnings, Not(Contains(HasSubstr(words))));
    }
}

} // namespace
} // namespace palpate
