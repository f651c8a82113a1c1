#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "engine/io/mesh_io.h"
#include "engine/io/narrow.h"
#include "engine/volume/grid.h"
#include "tests/support/paths.h"
#include "tests/unit/io_formats/decode_here.h"

// Real files: where they lie and what they hold, against independent readers.
namespace palpate::io {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kShared = kSharedData;
const fs::path kTemplates = "/usr/share/mricron/templates"; // Debian's mricron-data
const fs::path kProject = "/usr/share/doc/invesalius-examples/examples/Cranium.inv3";

#define SKIP_WITHOUT(path) \
    if (!fs::exists(path)) \
    GTEST_SKIP() << (path).string() << " is absent"

struct Expected {
    const char* file;
    glm::uvec3 size;
    glm::dvec3 last_mm; // centre of the last sample, LPS
    double sum;         // of the values of frame 0, scaled as the header says
    double placed_sum;  // of (x + 2 y + 3 z) * value: tells every order of axes apart
};

// NIfTI: nibabel 5.0,
//   i = nibabel.load(file); d = numpy.asanyarray(i.dataobj).astype(float)[..., 0 if 4-D]
//   numpy.diag([-1, -1, 1, 1]) @ i.affine @ [*(numpy.array(d.shape) - 1), 1], d.sum(),
//   (d * (x + 2 * y + 3 * z)).sum()
// NRRD, MetaImage, project: numpy.fromfile or frombuffer of the unpacked payload, same sums.
constexpr Expected kExpected[] = {
    {"nifti_variants/anatomical.nii", {33, 41, 25}, {32, -40, 32}, 284166082, 25953325904},
    {"nifti_variants/big.nii.gz", {64, 64, 21}, {252, -252, 120}, 11648.372022, 953480.221527},
    {"nifti_variants/little.nii.gz", {64, 64, 21}, {252, -252, 120}, 11648.372022, 953480.221527},
    {"nifti_variants/example_nifti2.nii.gz",
     {32, 20, 12},
     {-55.8551025, 2.13323462, 22.7740459},
     3461748,
     180231647},
    {"nifti_variants/functional.nii", {17, 21, 3}, {32, -40, 16}, 3883746.55233, 118879248.247},
    {"nifti_variants/reoriented_anat_moved.nii",
     {21, 26, 22},
     {-44.7021027, -52.0224152, 56.4005909},
     32739769.4492,
     2103795562.03},
    {"nifti_variants/standard.nii.gz", {4, 5, 7}, {-3, -12, 12}, 7650, 115005},
    {"nifti_variants/with_extension.nii.gz", {161, 191, 151}, {80, 110, -65}, 1472871, 740360529},
    {"ct_head/ct_brain_atlas_1mm.nii.gz",
     {202, 202, 179},
     {-100.197266, -282.697266, 1304.80005},
     50127759,
     29270351871},
    {"ct_trunk_labels/ct.nii.gz",
     {122, 101, 112},
     {-185.043671, -311.319, 427.301758},
     -496851173,
     -172579839925},
    {"ct_trunk_labels/labels_totalseg_v2.nii.gz",
     {122, 101, 112},
     {-185.043671, -311.319, 427.301758},
     15188945,
     4238858000},
    {"mr_hippocampus_labels/hippocampus_001_image.nii.gz",
     {35, 51, 35},
     {-35, -51, 35},
     3968524,
     483405171},
    {"mr_hippocampus_labels/hippocampus_001_label.nii.gz",
     {35, 51, 35},
     {-35, -51, 35},
     4572,
     515564},
    {"mr_small/mr_trunk_slab.nii.gz",
     {117, 91, 20},
     {179.40036, 103.640564, 85.9896412},
     41238711,
     7300057252},
    {"dicom_series_truth/expected.nii.gz",
     {256, 256, 4},
     {-100.794159, 93.9253235, -124.948746},
     33296710,
     12889893096},
    {"dicom_series_truth/expected_compressed.nii.gz",
     {256, 256, 4},
     {-100.794159, 93.9253235, -124.948746},
     33304746,
     12877977866},
    {"dicom_enhanced_mr/expected.nii.gz",
     {256, 256, 8},
     {91.8935395, 104.395401, -138.050758},
     283923495.616,
     111604652587},
    {"nrrd_variants/BallBinary30x30x30.nrrd", {30, 30, 30}, {29, 29, 29}, 3682296, 320359752},
    {"nrrd_variants/BallBinary30x30x30.nhdr", {30, 30, 30}, {29, 29, 29}, 3682296, 320359752},
    {"nrrd_variants/BallBinary30x30x30_gz.nrrd", {30, 30, 30}, {29, 29, 29}, 3682296, 320359752},
    {"nrrd_variants/BallBinary30x30x30_gz_lineskip.nrrd",
     {30, 30, 30},
     {29, 29, 29},
     3682296,
     320359752},
    {"nrrd_variants/BallBinary30x30x30_gz_byteskip_minus_one.nrrd",
     {30, 30, 30},
     {29, 29, 29},
     3682296,
     320359752},
    {"nrrd_variants/BallBinary30x30x30_byteskip_minus_one.nhdr",
     {30, 30, 30},
     {29, 29, 29},
     3682296,
     320359752},
    {"nrrd_variants/BallBinary30x30x30_byteskip_minus_one_nifti.nhdr",
     {30, 30, 30},
     {29, 29, 29},
     3682296,
     320359752},
    {"nrrd_variants/test1d_ascii.nrrd", {27, 1, 1}, {27.1908, 0, 0}, 378, 6552},
    {"nrrd_variants/test2d_ascii.nrrd", {3, 9, 1}, {2.0916, 16, 0}, 378, 4500},
    {"nrrd_variants/test_customFields.nrrd", {27, 1, 1}, {27.1908, 0, 0}, 378, 6552},
    {"mr_nrrd_negdir/brain1_image.nrrd",
     {256, 256, 25},
     {99.609375, -99.609375, 78},
     631859459,
     262648780140},
    {"mr_nrrd_negdir/brain1_label.nrrd",
     {256, 256, 25},
     {99.609375, -99.609375, 78},
     4137,
     1832135},
    {"labels_frog/frogtissue.mhd", {500, 470, 136}, {499, 469, 202.5}, 12279472, 10909179406},
    {"vtk_formats/HeadMRVolume.mhd", {48, 62, 42}, {188, 244, 164}, 3058332, 449714092},
    {"vtk_formats/foot.mha", {256, 256, 1}, {255, 255, 0}, 2055300, 817140629},
};

void expect_same(const DecodedHere& read, const Expected& expected) {
    const glm::uvec3 size = read.decoded.grid.size;
    EXPECT_EQ(size, expected.size);
    const Rescale rescale = read.decoded.rescale.empty() ? Rescale{} : read.decoded.rescale[0];
    double sum = 0, placed_sum = 0, magnitude = 0;
    size_t at = 0;
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x, ++at) {
                const double value = rescale.slope * read.values[at] + rescale.intercept;
                sum += value;
                placed_sum += value * (x + 2.0 * y + 3.0 * z);
                magnitude += std::abs(value);
            }
    // The table has 12 digits, and sums in another order differ by at most samples * 2^-53 of the
    // sum of magnitudes; positions weigh up to 3 * (x + y + z).
    const double tolerance =
        magnitude * static_cast<double>(read.values.size()) * 1.2e-16 + std::abs(sum) * 1e-11;
    EXPECT_NEAR(sum, expected.sum, tolerance);
    EXPECT_NEAR(placed_sum, expected.placed_sum,
                tolerance * 3 * (size.x + size.y + size.z) + std::abs(placed_sum) * 1e-11);
    // The table has 9 digits.
    const glm::dvec3 last = world_point(read.decoded.grid, glm::dvec3(size) - 1.0);
    EXPECT_LE(glm::length(last - expected.last_mm), 1e-8 * (1 + glm::length(expected.last_mm)));
}

TEST(SharedData, FilesLieAndHoldWhatOthersRead) {
    SKIP_WITHOUT(kShared);
    for (const Expected& expected : kExpected) {
        SCOPED_TRACE(expected.file);
        const auto read = decode_here(kShared / expected.file);
        ASSERT_TRUE(read) << read.error().message;
        expect_same(*read, expected);
    }
}

TEST(SharedData, WhatCannotBeReadIsRefusedByName) {
    SKIP_WITHOUT(kShared);
    constexpr std::pair<const char*, const char*> refusals[] = {
        {"nifti_variants/5D_small.nii", "several components (3"},
        {"nifti_variants/analyze.hdr", "analyze.img"},
        {"nifti_variants/nifti1.hdr", "nifti1.img"},
        {"nifti_variants/nifti2.hdr", "nifti2.img"},
        {"nifti_variants/not-nifti.nii", "348 or 540"},
        {"nrrd_variants/BallBinary30x30x30_bz2.nrrd", "bzip2"},
        {"nrrd_variants/BallBinary30x30x30_byteskip_minus_five.nhdr", "-5"},
    };
    for (const auto& [file, reason] : refusals) {
        const auto read = decode_here(kShared / file);
        ASSERT_FALSE(read) << file;
        EXPECT_THAT(read.error().message, HasSubstr(reason));
    }
}

// Its payload is a NIfTI file: 352 bytes of header before the voxels, of which the NRRD header
// says nothing. Read as it says, the picture is shifted, which must not pass in silence.
TEST(SharedData, PayloadThatIsTooLongIsAWarningWithBothNumbers) {
    SKIP_WITHOUT(kShared);
    const auto read = decode_here(kShared / "nrrd_variants/BallBinary30x30x30_nifti.nhdr");
    ASSERT_TRUE(read);
    ASSERT_EQ(read->decoded.warnings.size(), 1u);
    EXPECT_THAT(read->decoded.warnings[0], HasSubstr("54352"));
    EXPECT_THAT(read->decoded.warnings[0], HasSubstr("54000"));
}

TEST(SharedData, LaterFramesAreRead) {
    SKIP_WITHOUT(kShared);
    // nibabel: nibabel.load(file).dataobj[..., 19].sum() of functional.nii, [..., 1] of the other.
    const auto last = decode_here(kShared / "nifti_variants/functional.nii", 19);
    ASSERT_TRUE(last);
    ASSERT_EQ(last->decoded.rescale.size(), 1u);
    const auto [slope, intercept] = last->decoded.rescale[0];
    EXPECT_NEAR(slope * last->sum() + intercept * static_cast<double>(last->values.size()),
                3888072.27308, 3888072.27308 * 1e-11);
    EXPECT_EQ(decode_here(kShared / "nifti_variants/example_nifti2.nii.gz", 1)->sum(), 3465054);
}

glm::dvec3 centre_of(const DecodedHere& labels, double label) {
    const glm::uvec3 size = labels.decoded.grid.size;
    glm::dvec3 sum{};
    double count = 0;
    for (size_t i = 0; i < labels.values.size(); ++i)
        if (labels.values[i] == label) {
            sum += glm::dvec3(i % size.x, i / size.x % size.y, i / (size_t{size.x} * size.y));
            ++count;
        }
    return world_point(labels.decoded.grid, sum / count);
}

// Centres of organs, LPS, by nibabel:
//   numpy.diag([-1, -1, 1, 1]) @ i.affine @ [*numpy.argwhere(d == label).mean(0), 1]
TEST(SharedData, OrgansLieOnTheirSides) {
    SKIP_WITHOUT(kShared);
    const auto labels = decode_here(kShared / "ct_trunk_labels/labels_totalseg_v2.nii.gz");
    ASSERT_TRUE(labels);
    const glm::dvec3 spleen = centre_of(*labels, 1), liver = centre_of(*labels, 5);
    EXPECT_LE(glm::length(spleen - glm::dvec3(112.873892, -122.680192, 394.795448)), 1e-5);
    EXPECT_LE(glm::length(liver - glm::dvec3(-66.571014, -185.295183, 392.334906)), 1e-5);
    EXPECT_GT(spleen.x, liver.x); // left is positive
}

TEST(SharedData, AtlasLiesOverItsHead) {
    SKIP_WITHOUT(kTemplates);
    const auto atlas = decode_here(kTemplates / "aal.nii.gz");
    const auto head = decode_here(kTemplates / "ch2.nii.gz");
    ASSERT_TRUE(atlas);
    ASSERT_TRUE(head);
    EXPECT_EQ(*std::max_element(atlas->values.begin(), atlas->values.end()), 116);
    // 1 is Precentral_L, 2 Precentral_R, 43 Calcarine_L (aal.nii.txt).
    EXPECT_LE(glm::length(centre_of(*atlas, 1) - glm::dvec3(39.649571, 5.683325, 50.944204)), 1e-5);
    EXPECT_LE(glm::length(centre_of(*atlas, 2) - glm::dvec3(-40.374566, 8.213061, 52.092025)),
              1e-5);
    EXPECT_LE(glm::length(centre_of(*atlas, 43) - glm::dvec3(8.141653, 78.666960, 6.439225)), 1e-5);
    // Both say by themselves where they lie, and it is the same place.
    EXPECT_EQ(atlas->decoded.grid, head->decoded.grid);
}

TEST(SharedData, ProjectLooksForwardAndUpward) {
    SKIP_WITHOUT(kProject);
    const auto read = decode_here(kProject);
    ASSERT_TRUE(read) << read.error().message;
    expect_same(*read, {"Cranium.inv3",
                        {256, 256, 108},
                        {244.0429560, -244.0429560, 160.5},
                        -4147325847,
                        -2422538813378});
    EXPECT_EQ(read->decoded.modality, "CT");
    // Metal and enamel above 2400 HU are teeth: lower and further to the front than all bone.
    glm::dvec3 teeth{}, bone{};
    double teeth_count = 0, bone_count = 0;
    for (size_t i = 0; i < read->values.size(); ++i) {
        if (read->values[i] <= 300)
            continue;
        const glm::dvec3 position = world_point(
            read->decoded.grid, {static_cast<double>(i % 256), static_cast<double>(i / 256 % 256),
                                 static_cast<double>(i / 65536)});
        bone += position;
        ++bone_count;
        if (read->values[i] > 2400) {
            teeth += position;
            ++teeth_count;
        }
    }
    teeth /= teeth_count;
    bone /= bone_count;
    EXPECT_LT(teeth.y, bone.y - 50); // posterior is positive
    EXPECT_LT(teeth.z, bone.z - 50); // superior is positive
}

// Inputs after public reports; shared/data/reported/README.md states the right values.
const fs::path kReported = kShared / "reported";

TEST(Reported, MicronsAndFramesOfNrrd) {
    SKIP_WITHOUT(kReported);
    const auto microns = decode_here(kReported / "nrrd/microns.nrrd");
    ASSERT_TRUE(microns) << microns.error().message;
    const glm::dvec3 spacing = spacing_mm(microns->decoded.grid);
    EXPECT_NEAR(spacing.x, 0.1, 1e-15);
    EXPECT_NEAR(spacing.y, 0.1, 1e-15);
    EXPECT_NEAR(spacing.z, 0.2, 1e-15);
    const fs::path frames = kReported / "nrrd/list_axis_first.nrrd";
    double sums[5]{};
    for (uint32_t t = 0; t < 5; ++t) {
        const auto frame = decode_here(frames, t);
        ASSERT_TRUE(frame) << frame.error().message;
        EXPECT_EQ(frame->decoded.grid.size, glm::uvec3(32, 28, 24));
        sums[t] = frame->sum();
    }
    // numpy.frombuffer(gzip.decompress(payload), "<i2").reshape(24, 28, 32, 5).sum((0, 1, 2))
    const double expected[] = {-18969700, -18754660, -18539620, -18324580, -18109540};
    for (int t = 0; t < 5; ++t)
        EXPECT_EQ(sums[t], expected[t]) << t;
    EXPECT_THAT(decode_here(frames, 5).error().message, HasSubstr("5 frames"));
}

TEST(Reported, LayersOfASegmentation) {
    SKIP_WITHOUT(kReported);
    const auto map = decode_here(kReported / "nrrd/two_layers.seg.nrrd");
    ASSERT_TRUE(map) << map.error().message;
    int counts[4]{};
    for (const double label : map->values)
        ++counts[static_cast<int>(label)];
    // 515 and 33 samples less the 228 and 1 that the tumour of 257 covers.
    EXPECT_EQ(counts[1], 287);
    EXPECT_EQ(counts[2], 32);
    EXPECT_EQ(counts[3], 257);
    ASSERT_EQ(map->decoded.labels.size(), 3u);
    EXPECT_EQ(map->decoded.labels[2].name, "Tumour");
    ASSERT_EQ(map->decoded.warnings.size(), 1u);
    for (const char* words : {"1 'Liver' (515 samples) and 3 'Tumour' (257 samples) in 228 samples",
                              "2 'Kidney' (33 samples) and 3 'Tumour' (257 samples) in 1 samples"})
        EXPECT_THAT(map->decoded.warnings[0], HasSubstr(words));
}

TEST(Reported, ListsOfDataFiles) {
    SKIP_WITHOUT(kReported);
    for (const char* name : {"list_nhdr/list.nhdr", "list_mhd/list.mhd"}) {
        const auto list = decode_here(kReported / name);
        ASSERT_TRUE(list) << list.error().message;
        EXPECT_EQ(list->decoded.grid.size, glm::uvec3(32, 28, 24));
        EXPECT_THAT(list->decoded.warnings, testing::IsEmpty());
        // The sum of numpy.fromfile(file, "<i2") over the 24 files.
        EXPECT_EQ(list->sum(), name[5] == 'n' ? -18969700 : -18969700);
    }
}

TEST(Reported, StacksOfImageJ) {
    SKIP_WITHOUT(kReported);
    for (uint32_t channel = 0; channel < 2; ++channel) {
        const auto stack = decode_here(kReported / "tiff/ij_2ch.tif", channel);
        ASSERT_TRUE(stack) << stack.error().message;
        EXPECT_EQ(stack->decoded.grid.size, glm::uvec3(32, 28, 24));
        EXPECT_EQ(spacing_mm(stack->decoded.grid), glm::dvec3(0.5, 0.5, 2));
        // tifffile.imread(file)[:, channel].sum()
        EXPECT_EQ(stack->sum(), channel == 0 ? 2534300 : 2641820);
    }
    const auto um = decode_here(kReported / "tiff/ij_um.tif");
    ASSERT_TRUE(um) << um.error().message;
    const glm::dvec3 spacing = spacing_mm(um->decoded.grid);
    // 0.01 but for the file's quotient of two 32-bit numbers.
    EXPECT_DOUBLE_EQ(spacing.x, 1e-3 * 4294967295.0 / 429496730.0);
    EXPECT_DOUBLE_EQ(spacing.y, 1e-3 * 4294967295.0 / 429496730.0);
    EXPECT_NEAR(spacing.z, 0.02, 1e-15);
    EXPECT_THAT(um->decoded.warnings, testing::IsEmpty());
}

TEST(Reported, ASformOfZerosGivesWayToTheQform) {
    SKIP_WITHOUT(kReported);
    const auto volume = decode_here(kReported / "other/zero_sform_good_qform.nii");
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(world_point(volume->decoded.grid, {0, 0, 0}), glm::dvec3(5, 6, -7));
    EXPECT_EQ(world_point(volume->decoded.grid, {1, 1, 1}), glm::dvec3(4, 5, -5));
    ASSERT_EQ(volume->decoded.warnings.size(), 1u);
    EXPECT_THAT(volume->decoded.warnings[0], HasSubstr("its qform (code 1) is taken"));
}

TEST(Reported, ASlopeOf1By255GivesLabels0And1) {
    SKIP_WITHOUT(kReported);
    const fs::path path = kReported / "labels/slope_1_255.nii.gz";
    const auto mask = decode_here(path);
    ASSERT_TRUE(mask) << mask.error().message;
    std::vector<uint8_t> stored;
    for (const double value : mask->values)
        stored.push_back(static_cast<uint8_t>(value));
    const auto labels = narrow(path.string(), mask->decoded, mask->claim,
                               std::as_bytes(std::span(stored)), VolumeKind::labels, 1 << 30);
    ASSERT_TRUE(labels) << labels.error().message;
    size_t i = 0;
    const glm::uvec3 size = labels->volume.size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                ASSERT_EQ(labels->volume.value({x, y, z}), stored[i++] == 255 ? 1.0f : 0.0f);
}

TEST(Reported, AMeshOfSpaceRasIsTurnedToLps) {
    SKIP_WITHOUT(kReported);
    const auto mesh = load_mesh(kReported / "mesh_space/space_ras.stl");
    ASSERT_TRUE(mesh) << mesh.error().message;
    glm::dvec3 low(1e9), high(-1e9);
    for (const glm::vec3 p : mesh->mesh.positions) {
        low = glm::min(low, glm::dvec3(p));
        high = glm::max(high, glm::dvec3(p));
    }
    // numpy.fromfile(file, stl, offset=84): least and largest corner, times (-1, -1, 1).
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(low[i], (std::array<double, 3>{-27.36111068725586, -24.233333587646484,
                                                 5.42307710647583})[static_cast<size_t>(i)]);
        EXPECT_EQ(high[i], (std::array<double, 3>{-8.423076629638672, -7.42307710647583,
                                                  16.576923370361328})[static_cast<size_t>(i)]);
    }
}

} // namespace
} // namespace palpate::io
