// Every cut of a valid file ends in a volume or in one sentence that names the file.

#include <gmock/gmock.h>

#include "engine/io/volume_io.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/unit/io/sample_files.h"

namespace palpate {
namespace {

using test::Folder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Cuts `bytes` at about `cuts` places, the last byte among them, and loads what is left. The loaded
// volume, where there is one, must be what the whole file holds: `is_whole` says so.
template <class IsWhole>
void load_every_cut(const std::string& name, const std::string& bytes, size_t cuts,
                    const IsWhole& is_whole) {
    const Folder folder("cuts");
    const std::filesystem::path file = folder / name;
    test::write(file, bytes);
    const Result<LoadedVolume> whole = load_volume(file);
    ASSERT_TRUE(whole) << whole.error().message;
    ASSERT_TRUE(is_whole(whole->volume)) << name;
    const size_t step = std::max<size_t>(1, bytes.size() / cuts);
    size_t refused = 0;
    for (size_t length = bytes.size() - 1; length < bytes.size(); length -= step) {
        test::write(file, bytes.substr(0, length));
        const Result<LoadedVolume> loaded = load_volume(file);
        if (loaded) {
            EXPECT_TRUE(is_whole(loaded->volume)) << name << " cut to " << length;
            continue;
        }
        ++refused;
        EXPECT_THAT(loaded.error().message, AllOf(HasSubstr(name), Not(HasSubstr("\n"))));
        EXPECT_THAT(loaded.error().message, Not(HasSubstr("the reader"))) << "cut to " << length;
    }
    EXPECT_GT(refused, cuts / 2);
}

TEST(Truncation, OfDicom) {
    load_every_cut("slice.dcm", test::dicom_slice(2), 40, [](const Volume& volume) {
        return volume.size() == glm::uvec3(8, 4, 1) && volume.value({7, 3, 0}) == 237.0f - 1000.0f;
    });
}

TEST(Truncation, OfLegacyVtk) {
    for (const bool ascii : {false, true})
        load_every_cut("volume.vtk", test::legacy_vtk(ascii), 20, [&](const Volume& volume) {
            return volume.size() == glm::uvec3(4, 3, 2) &&
                   // A number cut in text cannot be told from a shorter one.
                   (ascii || volume.value({3, 2, 1}) == 23 * 11.0f - 100.0f);
        });
}

TEST(Truncation, OfVti) {
    load_every_cut("volume.vti", test::vti(), 20, [](const Volume& volume) {
        return volume.size() == glm::uvec3(4, 3, 2) &&
               volume.value({3, 2, 1}) == 23 * 11.0f - 100.0f &&
               volume.grid().world_from_index[3] == glm::dvec4(-1, 2, 3, 1) &&
               spacing_mm(volume.grid()) == glm::dvec3(0.5, 1, 2);
    });
}

TEST(Truncation, OfPng) {
    load_every_cut(
        "slice.png", test::png({{1, 2, 3}, {400, 500, 600}}), 20, [](const Volume& volume) {
            return volume.size() == glm::uvec3(3, 2, 1) && volume.value({2, 1, 0}) == 600.0f;
        });
}

TEST(DicomFolder, IsStackedAndScaled) {
    const Folder folder("dicom");
    for (int z = 0; z < 5; ++z)
        test::write(folder / ("x" + std::to_string(9 - z)), test::dicom_slice(z));
    test::write(folder / "README", "no image");
    const Result<LoadedVolume> loaded = load_volume(folder.path());
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->volume.size(), glm::uvec3(8, 4, 5));
    EXPECT_EQ(loaded->modality, "CT");
    EXPECT_EQ(loaded->volume.value({3, 2, 4}), 423.0f - 1000.0f);
    const glm::dmat4& m = loaded->volume.grid().world_from_index;
    EXPECT_EQ(m[0], glm::dvec4(0.5, 0, 0, 0));
    EXPECT_EQ(m[1], glm::dvec4(0, 0.75, 0, 0));
    EXPECT_EQ(m[2], glm::dvec4(0, 0, 2.5, 0));
    EXPECT_EQ(m[3], glm::dvec4(-10, 20, 0, 1));
    EXPECT_THAT(loaded->notes, ::testing::Contains(HasSubstr("README")));
    EXPECT_THAT(all_notes(*loaded), ::testing::Contains(HasSubstr("'head', 5 images")));
    EXPECT_TRUE(loaded->warnings.empty());
}

} // namespace
} // namespace palpate
