// Real volumes held against independent answers: landmarks in the patient, and the same images in
// other forms.

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "tests/unit/io_shared/shared_data.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;

struct Landmark {
    float label;
    uint64_t voxels;
    glm::dvec3 centroid_mm; // LPS, from nibabel's affine times diag(-1, -1, 1, 1)
    double mean_hu;
};

TEST_F(SharedData, OrgansLieWhereNibabelPutsThem) {
    const Volume ct = loaded("ct_trunk_labels/ct.nii.gz").volume;
    const Result<LoadedVolume> labels =
        load_labels(kShared / "ct_trunk_labels/labels_totalseg_v2.nii.gz");
    ASSERT_TRUE(labels) << labels.error().message;
    EXPECT_EQ(labels->volume.type(), ScalarType::u8);
    EXPECT_EQ(labels->volume.grid(), ct.grid());
    const Landmark landmarks[] = {
        {1, 9668, {112.87389244, -122.68019180, 394.79544834}, 32.77006620},  // spleen, left
        {2, 7134, {-69.61095409, -132.09275971, 345.65793945}, 10.72932436},  // right kidney
        {3, 5090, {78.09758671, -125.62194720, 357.37405644}, 18.38998035},   // left kidney
        {5, 41692, {-66.57101403, -185.29518273, 392.33490566}, 44.45958457}, // liver, right
        {52, 1839, {16.92859688, -161.25537871, 363.44531409}, 42.08374116},  // aorta
    };
    for (const Landmark& expected : landmarks) {
        SCOPED_TRACE(expected.label);
        uint64_t voxels = 0;
        glm::dvec3 sum_mm{};
        double hu = 0;
        for (uint32_t z = 0; z < ct.size().z; ++z)
            for (uint32_t y = 0; y < ct.size().y; ++y)
                for (uint32_t x = 0; x < ct.size().x; ++x)
                    if (labels->volume.value({x, y, z}) == expected.label) {
                        ++voxels;
                        sum_mm += world_point(ct.grid(), {x, y, z});
                        hu += ct.value({x, y, z});
                    }
        EXPECT_EQ(voxels, expected.voxels);
        // Eight decimals are given; sums of 4e4 doubles round far below.
        for (int i = 0; i < 3; ++i)
            EXPECT_NEAR(sum_mm[i] / static_cast<double>(voxels), expected.centroid_mm[i], 1e-6);
        EXPECT_NEAR(hu / static_cast<double>(voxels), expected.mean_hu, 1e-6);
    }
}

TEST_F(SharedData, SegmentationLiesWherePydicomPutsIt) {
    // pydicom 2.3 and numpy: unpacked bits of each frame, at its own plane position.
    const Result<LoadedVolume> liver = load_labels(kShared / "dicom_small/seg_liver_3frames.dcm");
    ASSERT_TRUE(liver) << liver.error().message;
    const Volume& volume = liver->volume;
    ASSERT_EQ(volume.size(), glm::uvec3(512, 512, 3));
    std::vector<uint64_t> counts(3);
    glm::dvec3 sum_mm{};
    for (uint32_t z = 0; z < 3; ++z)
        for (uint32_t y = 0; y < 512; ++y)
            for (uint32_t x = 0; x < 512; ++x)
                if (volume.value({x, y, z}) == 1.0f) {
                    ++counts[z];
                    sum_mm += world_point(volume.grid(), {x, y, z});
                }
    EXPECT_EQ(counts, (std::vector<uint64_t>{36233, 35645, 35220}));
    const glm::dvec3 centroid = sum_mm / 107098.0;
    // Eight decimals are given; sums of 1e5 doubles round far below.
    EXPECT_NEAR(centroid.x, -74.05705344, 1e-6);
    EXPECT_NEAR(centroid.y, -33.26204082, 1e-6);
    EXPECT_NEAR(centroid.z, -127.69945863, 1e-6);
    ASSERT_EQ(liver->labels.size(), 1u);
    EXPECT_EQ(liver->labels[0].name, "Liver");
    EXPECT_TRUE(liver->labels[0].color);
}

// Holds one volume against another sample by sample in world space: their samples must coincide.
void expect_same_in_world(const Volume& a, const Volume& b, double value_tolerance) {
    ASSERT_EQ(sample_count(a.grid()), sample_count(b.grid()));
    uint64_t wrong = 0;
    for (uint32_t z = 0; z < a.size().z; ++z)
        for (uint32_t y = 0; y < a.size().y; ++y)
            for (uint32_t x = 0; x < a.size().x; ++x) {
                const glm::dvec3 at = index_point(b.grid(), world_point(a.grid(), {x, y, z}));
                const glm::dvec3 nearest = glm::round(at);
                // The NIfTI stores its affine in float: 2^-24 of 160 mm, at spacings of 1 mm.
                ASSERT_LT(glm::length(at - nearest), 1e-4);
                ASSERT_TRUE(glm::all(glm::greaterThanEqual(nearest, glm::dvec3(0))) &&
                            glm::all(glm::lessThan(nearest, glm::dvec3(b.size()))));
                wrong +=
                    std::abs(a.value({x, y, z}) - b.value(glm::uvec3(nearest))) > value_tolerance;
            }
    EXPECT_EQ(wrong, 0u);
}

TEST_F(SharedData, DicomSeriesAreTheirNiftiInWorldSpace) {
    const Volume expected = loaded("dicom_series_truth/expected.nii.gz").volume;
    expect_same_in_world(loaded("dicom_series_truth/anatomical").volume, expected, 0.0);
    const Volume compressed = loaded("dicom_series_truth/expected_compressed.nii.gz").volume;
    for (const char* name : {"compressed", "compressed_j2k", "compressed_jpeg", "compressed_jpegls",
                             "compressed_rle"}) {
        SCOPED_TRACE(name);
        expect_same_in_world(loaded(std::string("dicom_series_truth/") + name).volume, compressed,
                             0.0);
    }
}

TEST_F(SharedData, EnhancedMultiFrameIsItsNiftiInWorldSpace) {
    // 2^-24 of 1082 each: the NIfTI rounds its slope to float, and both round the product.
    expect_same_in_world(loaded("dicom_enhanced_mr/IM-0001-0170-0001.dcm").volume,
                         loaded("dicom_enhanced_mr/expected.nii.gz").volume, 3 * 1082 * 0x1p-24);
}

void expect_same(const Volume& a, const Volume& b) {
    ASSERT_EQ(a.grid(), b.grid());
    uint64_t wrong = 0;
    for (uint32_t z = 0; z < a.size().z; ++z)
        for (uint32_t y = 0; y < a.size().y; ++y)
            for (uint32_t x = 0; x < a.size().x; ++x)
                wrong += a.value({x, y, z}) != b.value({x, y, z});
    EXPECT_EQ(wrong, 0u);
}

TEST_F(SharedData, NineLosslessCodecsGiveOneImage) {
    const Volume plain = loaded("dicom_codecs/CTImage.dcm").volume;
    size_t compared = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(kShared / "dicom_codecs")) {
        const std::string name = entry.path().filename().string();
        for (const char* lossless :
             {"LittleEndianImplicit", "LittleEndianExplicit", "BigEndianExplicit", "Deflated",
              "RLELossless", "JPEGProcess14SV1", "JPEGProcess14Transfer", "JPEGLSLossless",
              "JPEG2000LosslessOnly"})
            if (name.find(lossless) != std::string::npos) {
                SCOPED_TRACE(name);
                expect_same(plain, loaded("dicom_codecs/" + name).volume);
                ++compared;
            }
    }
    EXPECT_EQ(compared, 9u);
}

TEST_F(SharedData, SevenFormsOfOneMrSliceAreOneImage) {
    const Volume plain = loaded("dicom_small/MR_small.dcm").volume;
    for (const char* name :
         {"RLE", "bigendian", "implicit", "jp2klossless", "jpeg_ls_lossless", "padded"})
        expect_same(plain, loaded(std::string("dicom_small/MR_small_") + name + ".dcm").volume);
}

TEST_F(SharedData, SlicesOfHeadsqAreTheDicomSeries) {
    const fs::path folder = fs::temp_directory_path() / "palpate_headsq";
    fs::remove_all(folder);
    fs::create_directories(folder);
    for (int i = 1; i <= 93; ++i) {
        const std::string name = "quarter." + std::to_string(i);
        fs::copy_file(kShared / "ct_head/raw_slices_headsq" / name, folder / name);
    }
    std::ofstream(folder / "slices.json")
        << R"({"pattern": "quarter.%d", "size": [64, 64], "type": "i16",
               "spacing_mm": [3.2, 3.2, 1.5], "origin_mm": [0, 0, 138],
               "directions": [[1, 0, 0], [0, 1, 0], [0, 0, -1]], "modality": "CT"})";
    const Result<LoadedVolume> slices = load_volume(folder);
    fs::remove_all(folder);
    ASSERT_TRUE(slices) << slices.error().message;
    EXPECT_EQ(slices->volume.size(), glm::uvec3(64, 64, 93));
    EXPECT_EQ(slices->volume.range(), (ValueRange{0.0f, 3926.0f}));
    // The same data set, published as plain slices from the top down and as DICOM.
    expect_same_in_world(slices->volume, loaded("ct_head/dicom_axial_64").volume, 0.0);
}

TEST_F(SharedData, FramesOfA4DFileAreChosen) {
    const LoadedVolume first = loaded("nifti_variants/functional.nii");
    EXPECT_THAT(first.warnings, Contains(HasSubstr("20 frames")));
    const LoadedVolume last = loaded("nifti_variants/functional.nii", {.frame = 19});
    EXPECT_THAT(last.warnings, ::testing::Not(Contains(HasSubstr("frames"))));
    EXPECT_NE(first.volume.range(), last.volume.range());
    EXPECT_THAT(
        load_volume(kShared / "nifti_variants/functional.nii", {.frame = 20}).error().message,
        HasSubstr("no frame 20"));
}

TEST_F(SharedData, LabelsOfEveryKindLoad) {
    for (const auto& [name, largest] :
         std::vector<std::pair<std::string, float>>{{"labels_frog/frogtissue.mhd", 29},
                                                    {"mr_nrrd_negdir/brain1_label.nrrd", 1},
                                                    {"mr_hippocampus_labels/"
                                                     "hippocampus_001_label.nii.gz",
                                                     2}}) {
        const Result<LoadedVolume> labels = load_labels(kShared / name);
        ASSERT_TRUE(labels) << labels.error().message;
        EXPECT_EQ(labels->volume.type(), ScalarType::u8);
        EXPECT_EQ(labels->volume.range().max, largest);
    }
    EXPECT_THAT(load_labels(kShared / "ct_trunk_labels/ct.nii.gz").error().message,
                HasSubstr("from -1207 to 3382"));
    EXPECT_THAT(load_labels(kShared / "nifti_variants/big.nii.gz").error().message,
                HasSubstr("fractions"));
}

TEST_F(SharedData, MemoryLimitIsHeld) {
    const Result<LoadedVolume> frog =
        load_volume(kShared / "labels_frog/frogtissue.mhd", {.max_memory_bytes = 10 << 20});
    ASSERT_FALSE(frog);
    EXPECT_THAT(frog.error().message, HasSubstr("10485760"));
    EXPECT_THAT(frog.error().message, HasSubstr("63920000")); // 500 x 470 x 136, decoded and kept
}

} // namespace
} // namespace palpate
