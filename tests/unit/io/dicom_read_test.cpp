// DICOM files and folders as scanners and archives write them, made byte by byte.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "engine/io/volume_io.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/unit/io/dicom_codec.h"
#include "tests/unit/io/loaded.h"
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

constexpr const char* kAxial = "1\\0\\0\\0\\1\\0";

class DicomPreview : public test::InEveryEncoding {};
class Mosaic : public test::InEveryEncoding {};
class DicomFolders : public test::InEveryEncoding {};
class Dicomdir : public test::InEveryEncoding {};
INSTANTIATE_TEST_SUITE_P(Each, DicomPreview, test::every_encoding(), test::encoding_name);
INSTANTIATE_TEST_SUITE_P(Each, Mosaic, test::every_encoding(), test::encoding_name);
INSTANTIATE_TEST_SUITE_P(Each, DicomFolders, test::every_encoding(), test::encoding_name);
INSTANTIATE_TEST_SUITE_P(Each, Dicomdir, test::every_encoding(), test::encoding_name);

// ---- previews and progress

TEST_P(DicomPreview, IsTheMiddleImageOfTheSeries) {
    const Folder folder("middle");
    for (const int z : {0, 1, 2, 3, 4, 5, 6}) // names are in another order
        test::write(folder / fmt::format("{}.dcm", z * 3 % 7), test::dicom_slice(z));
    const LoadedVolume all = loaded(folder.path());
    ReadOptions middle;
    middle.middle_image = true;
    const LoadedVolume one = loaded(folder.path(), middle);
    ASSERT_EQ(all.volume.size(), glm::uvec3(8, 4, 7));
    ASSERT_EQ(one.volume.size(), glm::uvec3(8, 4, 1));
    for (uint32_t y = 0; y < 4; ++y)
        for (uint32_t x = 0; x < 8; ++x)
            EXPECT_EQ(one.volume.value({x, y, 0}), all.volume.value({x, y, 3}));
    EXPECT_EQ(one.modality, "CT");
    EXPECT_EQ(one.notes, all.notes);
    EXPECT_EQ(one.series, all.series);
}

TEST(DicomProgress, IsTheShareOfVoxelsThatAreWritten) {
    const Folder folder("progress");
    for (int z = 0; z < 24; ++z)
        test::write(folder / fmt::format("{:02}.dcm", z), test::dicom_slice(z, 2.5, 256, 256));
    std::vector<double> shares;
    ReadOptions options;
    options.progress = [&](double share) { shares.push_back(share); };
    EXPECT_EQ(loaded(folder.path(), options).volume.size(), glm::uvec3(256, 256, 24));
    ASSERT_FALSE(shares.empty());
    EXPECT_GE(shares.front(), 0.0);
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
    EXPECT_EQ(shares.back(), 1.0);
}

// ---- signed samples

// 8 x 8 samples, which codecs need as a least size.
constexpr int kSide = 8;

DicomData image_of(const std::vector<int>& values, uint16_t stored, bool is_signed) {
    DicomData data = test::samples(kSide, kSide, 16, stored, is_signed);
    data.put(8, 0x60, "CS", "CT").put(0x20, 0x0e, "UI", "1.2").put(0x20, 0x13, "IS", "1");
    test::place(data, "0\\0\\0", kAxial, "1\\1");
    return data.put(0x7fe0, 0x10, "OW", test::words_16(values));
}

// Negative and positive values that fit in `bits`, the extremes among them.
std::vector<int> signed_values(int bits) {
    std::vector<int> values;
    const int half = 1 << (bits - 1);
    for (int i = 0; i < kSide * kSide; ++i)
        values.push_back(-half + i * (2 * half - 1) / (kSide * kSide - 1));
    return values;
}

void expect_values(const std::string& file, const std::vector<int>& values) {
    ASSERT_FALSE(file.empty());
    const Folder folder("signed");
    test::write(folder / "a.dcm", file);
    const Volume volume = loaded(folder / "a.dcm").volume;
    ASSERT_EQ(volume.size(), glm::uvec3(kSide, kSide, 1));
    for (size_t i = 0; i < values.size(); ++i)
        EXPECT_EQ(volume.value({i % kSide, i / kSide, 0}), static_cast<float>(values[i])) << i;
}

// Says that the samples of a file are signed, whatever its codestream says.
std::string called_signed(std::string file) {
    const std::string element = test::little(0x28, 2) + test::little(0x103, 2) + "US";
    const size_t at = file.find(element + test::little(2, 2) + test::little(0, 2));
    EXPECT_NE(at, std::string::npos);
    if (at != std::string::npos)
        file[at + 8] = 1;
    return file;
}

TEST(SignedDicom, UnsignedCodestreamsAreExtendedFromTheStoredBits) {
    for (const int bits : {12, 13, 14})
        for (const char* syntax : {test::kJpeg2000Lossless, test::kJpegLsLossless}) {
            SCOPED_TRACE(fmt::format("{} bits, {}", bits, syntax));
            std::vector<int> stored;
            for (const int value : signed_values(bits))
                stored.push_back(value & ((1 << bits) - 1));
            const auto plain = image_of(stored, static_cast<uint16_t>(bits), false);
            expect_values(called_signed(test::encoded(plain.file(test::kCtClass, "1.2.1"), syntax)),
                          signed_values(bits));
        }
}

TEST(SignedDicom, SignedCodestreamsAreNotExtendedTwice) {
    for (const int bits : {12, 16})
        for (const char* syntax :
             {test::kExplicitLittle, test::kRle, test::kJpeg2000Lossless, test::kJpegLsLossless}) {
            SCOPED_TRACE(fmt::format("{} bits, {}", bits, syntax));
            const auto plain = image_of(signed_values(bits), static_cast<uint16_t>(bits), true);
            const std::string file = plain.file(test::kCtClass, "1.2.1");
            expect_values(
                syntax == std::string(test::kExplicitLittle) ? file : test::encoded(file, syntax),
                signed_values(bits));
        }
}

TEST(SignedDicom, PlainSamplesAreExtendedFromTheStoredBits) {
    std::vector<int> stored;
    for (const int value : signed_values(12))
        stored.push_back(value & 0xfff);
    expect_values(image_of(stored, 12, true).file(test::kCtClass, "1.2.1"), signed_values(12));
    // The same, four bits up in the word.
    for (int& value : stored)
        value <<= 4;
    DicomData high = image_of(stored, 12, true);
    high.put_words(0x28, 0x102, {15});
    expect_values(high.file(test::kCtClass, "1.2.1"), signed_values(12));
}

// ---- mosaics

// A header of Siemens' second format: name and values of each entry.
std::string csa(const std::vector<std::pair<std::string, std::vector<std::string>>>& entries) {
    const auto padded = [](std::string text, size_t length) {
        text.resize(length, '\0');
        return text;
    };
    std::string bytes = "SV10" + test::little(0x01020304, 4) + test::little(entries.size(), 4) +
                        test::little(77, 4);
    for (const auto& [name, values] : entries) {
        bytes += padded(name, 64) + test::little(values.size(), 4) + padded("FD", 4) +
                 test::little(4, 4) + test::little(6, 4) + test::little(77, 4);
        for (size_t i = 0; i < 6; ++i) {
            const std::string value = i < values.size() ? values[i] + '\0' : "";
            bytes += test::little(value.size(), 4) + test::little(value.size(), 4) +
                     test::little(77, 4) + test::little(value.size(), 4) +
                     padded(value, (value.size() + 3) / 4 * 4);
        }
    }
    return bytes;
}

// Five slices of 4 x 3 samples in a mosaic of 3 x 3 tiles; value x + 10 y + 100 slice.
DicomData mosaic(double normal_z, const std::string& position) {
    DicomData data = test::samples(12, 9, 16, 16, false);
    std::vector<int> values(12 * 9, 7); // what lies in empty tiles does not matter
    for (int slice = 0; slice < 5; ++slice)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 4; ++x)
                values[static_cast<size_t>((slice / 3 * 3 + y) * 12 + slice % 3 * 4 + x)] =
                    x + 10 * y + 100 * slice;
    data.put(8, 8, "CS", "ORIGINAL\\PRIMARY\\M\\ND\\MOSAIC").put(8, 0x60, "CS", "MR");
    data.put(0x18, 0x88, "DS", "2.5").put(0x20, 0x0e, "UI", "1.2").put(0x20, 0x13, "IS", "1");
    test::place(data, position, kAxial, "2\\1.5");
    data.put(0x29, 0x10, "LO", "SIEMENS CSA HEADER");
    data.put(0x29, 0x1010, "OB",
             csa({{"EchoLinePosition", {}},
                  {"NumberOfImagesInMosaic", {"5       "}},
                  {"SliceNormalVector", {"0.0", "0.0", fmt::format("{:.1f}", normal_z)}}}));
    return data.put(0x7fe0, 0x10, "OW", test::words_16(values));
}

TEST_P(Mosaic, IsAStackOfItsTiles) {
    // Slices that ascend from z = 20 mm and slices that descend from there.
    for (const double normal : {1.0, -1.0}) {
        const Folder folder("mosaic");
        // The first slice begins at (-3, 8); the image that is said to be as large as the mosaic
        // begins (12 - 4) / 2 columns and (9 - 3) / 2 rows before it.
        const std::string position = fmt::format("{}\\{}\\20", -3 - 4 * 1.5, 8 - 3 * 2.0);
        test::write(folder / "a.dcm", mosaic(normal, position).file(test::kMrClass, "1.2.1"));
        const LoadedVolume mosaic = loaded(folder / "a.dcm");
        const Volume& volume = mosaic.volume;
        ASSERT_EQ(volume.size(), glm::uvec3(4, 3, 5));
        EXPECT_THAT(mosaic.warnings, IsEmpty());
        for (uint32_t slice = 0; slice < 5; ++slice)
            for (uint32_t y = 0; y < 3; ++y)
                for (uint32_t x = 0; x < 4; ++x) {
                    const glm::dvec3 world(-3 + 1.5 * x, 8 + 2.0 * y, 20 + normal * 2.5 * slice);
                    const glm::dvec3 at = index_point(volume.grid(), world);
                    ASSERT_LT(glm::distance(at, glm::round(at)), 1e-9);
                    EXPECT_EQ(volume.value(glm::uvec3(glm::round(at))),
                              static_cast<float>(x + 10 * y + 100 * slice));
                }
    }
}

TEST_P(Mosaic, OfATimeSeriesAreFrames) {
    const Folder folder("mosaics");
    for (int time = 0; time < 3; ++time) {
        DicomData data = mosaic(1.0, "-9\\2\\20");
        data.put(0x20, 0x12, "IS", std::to_string(3 - time));
        data.put(0x28, 0x1052, "DS", std::to_string(1000 * time)).put(0x28, 0x1053, "DS", "1");
        test::write(folder / fmt::format("{}.dcm", time),
                    data.file(test::kMrClass, fmt::format("1.2.{}", time)));
    }
    const LoadedVolume first = loaded(folder.path());
    EXPECT_THAT(first.warnings, ElementsAre(HasSubstr("3 frames")));
    EXPECT_EQ(first.volume.value({1, 2, 4}), 2421.0f); // acquisition 1 is the third file
    EXPECT_EQ(loaded(folder.path(), {.frame = 2}).volume.value({1, 2, 4}), 421.0f);
}

TEST_P(Mosaic, IsRefusedByNameWhereItsHeaderLacksSomething) {
    const Folder folder("mosaic");
    const auto refused = [&](const DicomData& data) {
        test::write(folder / "a.dcm", data.file(test::kMrClass, "1.2.1"));
        return error_of(folder / "a.dcm");
    };
    DicomData data = mosaic(1.0, "-9\\2\\20");
    EXPECT_THAT(refused(DicomData(data).erase(0x18, 0x88)),
                AllOf(HasSubstr("a.dcm: is a Siemens mosaic"), HasSubstr("SpacingBetweenSlices")));
    EXPECT_THAT(refused(DicomData(data).erase(0x29, 0x1010)), HasSubstr("NumberOfImagesInMosaic"));
    EXPECT_THAT(
        refused(DicomData(data).put(0x29, 0x1010, "OB", csa({{"NumberOfImagesInMosaic", {"5"}}}))),
        HasSubstr("SliceNormalVector"));
    EXPECT_THAT(refused(DicomData(data).erase(0x20, 0x32)), HasSubstr("position"));
    EXPECT_THAT(
        refused(DicomData(data).put(0x29, 0x1010, "OB", csa({{"NumberOfImagesInMosaic", {"50"}}}))),
        HasSubstr("12 x 9 samples are not 8 x 8 tiles"));
}

// ---- folders

// Writes five slices of a CT, as test::dicom_slice makes them, in folders as archives do.
void write_archive(const Folder& folder) {
    namespace fs = std::filesystem;
    for (int z = 0; z < 5; ++z) {
        const std::string name = fmt::format("patient/study/series/{}", z % 2 ? "odd" : "even");
        fs::create_directories(folder / name);
        test::write(folder / (name + fmt::format("/IM{:04}", z)), test::dicom_slice(z));
    }
}

std::string structure_set() {
    DicomData data;
    data.put(8, 0x60, "CS", "RTSTRUCT").put(0x20, 0x0e, "UI", "1.2.3.5");
    return data.put(8, 0x103e, "LO", "contours").file(test::kStructureClass, "1.2.3.5.1");
}

// Whatever is loaded must be the five slices of write_archive.
void expect_archive(const LoadedVolume& archive) {
    EXPECT_EQ(archive.volume.size(), glm::uvec3(8, 4, 5));
    for (uint32_t z = 0; z < 5; ++z)
        EXPECT_EQ(archive.volume.value({3, 2, z}), 23.0f + 100.0f * z - 1000.0f);
    EXPECT_EQ(archive.volume.grid().world_from_index[2], glm::dvec4(0, 0, 2.5, 0));
}

TEST_P(DicomFolders, MayBeNested) {
    const Folder folder("nested");
    write_archive(folder);
    const LoadedVolume archive = loaded(folder.path());
    expect_archive(archive);
    EXPECT_THAT(archive.warnings, IsEmpty());
}

TEST_P(DicomFolders, ListWhatIsPassedOverBesideACt) {
    const Folder folder("beside");
    write_archive(folder);
    test::write(folder / "structures.dcm", structure_set());
    const LoadedVolume archive = loaded(folder.path());
    expect_archive(archive);
    ASSERT_EQ(archive.series.size(), 2u);
    EXPECT_EQ(archive.series[1].modality, "RTSTRUCT");
    EXPECT_EQ(archive.series[1].description, "contours");
    EXPECT_THAT(archive.series[1].content,
                HasSubstr("passed over: is a DICOM radiotherapy structure set"));
    EXPECT_THAT(error_of(folder.path(), {.series = "2"}), HasSubstr("(RTSTRUCT)"));
}

TEST_P(DicomFolders, PassOverADamagedFileByName) {
    const Folder folder("damaged");
    write_archive(folder);
    const std::string slice = test::dicom_slice(5);
    test::write(folder / "cut.dcm", slice.substr(0, slice.size() - 10));
    const LoadedVolume archive = loaded(folder.path());
    expect_archive(archive);
    EXPECT_THAT(archive.warnings, ElementsAre(AllOf(HasSubstr("cut.dcm: is passed over"),
                                                    HasSubstr("expected 64 bytes"))));
}

TEST_P(DicomFolders, HoldNoDataWhereADamagedSliceLay) {
    const Folder folder("hole");
    write_archive(folder);
    const auto file = folder / "patient/study/series/even/IM0002";
    test::write(file, test::dicom_slice(2).substr(0, test::dicom_slice(2).size() - 10));
    const LoadedVolume archive = loaded(folder.path());
    EXPECT_EQ(archive.volume.size(), glm::uvec3(8, 4, 5));
    EXPECT_TRUE(std::isnan(archive.volume.value({3, 2, 2})));
    EXPECT_EQ(archive.volume.no_data_count(), 32u);
    EXPECT_EQ(archive.volume.value({3, 2, 3}), 323.0f - 1000.0f);
    EXPECT_THAT(archive.warnings, AllOf(Contains(HasSubstr("IM0002: is passed over")),
                                        Contains(HasSubstr("1 of 5 slices is missing"))));
    // Interpolated on request.
    const LoadedVolume whole = loaded(folder.path(), {.resample_slices = true});
    EXPECT_EQ(whole.volume.value({3, 2, 2}), 223.0f - 1000.0f);
    EXPECT_THAT(whole.warnings, Contains(HasSubstr("resampled")));
}

TEST_P(DicomFolders, LetOrientationsOfOneSeriesBeChosen) {
    const Folder folder("orientations");
    write_archive(folder);
    for (int i = 0; i < 3; ++i) {
        DicomData data = test::samples(8, 4, 16, 16, true);
        data.put(8, 0x60, "CS", "CT").put(8, 0x103e, "LO", "head");
        data.put(0x20, 0x0e, "UI", "1.2.3.4").put(0x20, 0x13, "IS", std::to_string(i));
        test::place(data, fmt::format("0\\{}\\0", 4 * i), "1\\0\\0\\0\\0\\-1", "0.75\\0.5");
        data.put(0x7fe0, 0x10, "OW", test::words_16(std::vector<int>(32, -i)));
        test::write(folder / fmt::format("c{}", i),
                    data.file(test::kCtClass, fmt::format("1.2.9.{}", i)));
    }
    const LoadedVolume axial = loaded(folder.path());
    expect_archive(axial);
    EXPECT_THAT(axial.warnings, ElementsAre(AllOf(HasSubstr("mixes sizes or orientations"),
                                                  HasSubstr("3 of 8 images are left out"),
                                                  HasSubstr("--series 2"))));
    EXPECT_THAT(all_notes(axial),
                Contains(AllOf(HasSubstr("3 images of 8 x 4"), HasSubstr("coronal"))));
    const LoadedVolume coronal = loaded(folder.path(), {.series = "2"});
    EXPECT_EQ(coronal.volume.size(), glm::uvec3(8, 4, 3));
    EXPECT_EQ(glm::dvec3(coronal.volume.grid().world_from_index[2]), glm::dvec3(0, 4, 0));
}

// A DICOMDIR that names the slices of write_archive.
std::string directory_of_archive() {
    std::vector<DicomData> records(1);
    records[0].put(4, 0x1430, "CS", "PATIENT");
    for (int z = 0; z < 5; ++z)
        records.emplace_back()
            .put(4, 0x1430, "CS", "IMAGE")
            .put(4, 0x1500, "CS",
                 fmt::format("PATIENT\\STUDY\\SERIES\\{}\\IM{:04}", z % 2 ? "ODD" : "EVEN", z));
    DicomData data;
    return data.put_items(4, 0x1220, records).file("1.2.840.10008.1.3.10", "1.2.7");
}

TEST_P(Dicomdir, StandsForTheFilesThatItNames) {
    const Folder folder("dicomdir");
    write_archive(folder);
    namespace fs = std::filesystem;
    for (const char* part : {"patient/study/series/even", "patient/study/series/odd"})
        for (int z = 0; z < 5; ++z) // names are capitals in the directory
            if (fs::exists(folder / part / fmt::format("IM{:04}", z)))
                fs::rename(folder / part / fmt::format("IM{:04}", z),
                           folder / part / fmt::format("im{:04}", z));
    test::write(folder / "other.dcm", test::dicom_slice(9));
    test::write(folder / "DICOMDIR", directory_of_archive());
    const LoadedVolume archive = loaded(folder / "DICOMDIR");
    expect_archive(archive);
    EXPECT_THAT(archive.warnings, IsEmpty());
    fs::remove(folder / "other.dcm");
    expect_archive(loaded(folder.path())); // beside its images it is no image
    fs::remove_all(folder / "patient/study/series/odd");
    EXPECT_THAT(loaded(folder / "DICOMDIR").warnings,
                ElementsAre(HasSubstr("2 of the 5 files that it names are not there")));
    fs::remove_all(folder / "patient");
    EXPECT_THAT(error_of(folder / "DICOMDIR"), HasSubstr("5 of the 5 files"));
}

TEST_P(Dicomdir, NamesNoFileOutsideItsFolder) {
    const Folder folder("dicomdir_out");
    std::filesystem::create_directories(folder / "in");
    test::write(folder / "secret.dcm", test::dicom_slice(0));
    std::vector<DicomData> records(1);
    records[0].put(4, 0x1500, "CS", "..\\secret.dcm");
    DicomData data;
    test::write(folder / "in/DICOMDIR",
                data.put_items(4, 0x1220, records).file("1.2.840.10008.1.3.10", "1.2.7"));
    EXPECT_THAT(error_of(folder / "in/DICOMDIR"), HasSubstr("1 of the 1 files"));
}

TEST(DicomCodestreams, ThatAreDamagedArePassedOver) {
    for (const char* syntax : {test::kJpeg2000Lossless, test::kJpegLsLossless, test::kRle}) {
        SCOPED_TRACE(syntax);
        const Folder folder("codestreams");
        for (int z = 0; z < 4; ++z) {
            DicomData data = image_of(signed_values(12), 12, true);
            test::place(data, fmt::format("0\\0\\{}", 2 * z), kAxial, "1\\1");
            std::string file =
                test::encoded(data.file(test::kCtClass, fmt::format("1.2.1.{}", z)), syntax);
            ASSERT_GT(file.size(), 600u);
            if (z == 3) // the end of the codestream; the items around it are whole
                std::memset(file.data() + file.size() - 48, 0, 40);
            test::write(folder / fmt::format("{}.dcm", z), file);
        }
        const LoadedVolume rest = loaded(folder.path());
        EXPECT_EQ(rest.volume.size(), glm::uvec3(8, 8, 3));
        EXPECT_THAT(rest.warnings, ElementsAre(HasSubstr("3.dcm: is passed over: ")));
        EXPECT_THAT(error_of(folder / "3.dcm"),
                    AllOf(HasSubstr("3.dcm: "), Not(HasSubstr("reader"))));
    }
}

TEST(PackedDicom, IsRefusedByName) {
    const Folder folder("packed");
    test::write(folder / "a.dcm.gz", "\x1f\x8b packed");
    EXPECT_THAT(error_of(folder / "a.dcm.gz"), AllOf(HasSubstr("gzip"), HasSubstr("DICOM")));
}

} // namespace
} // namespace palpate
