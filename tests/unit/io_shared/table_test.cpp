// Every file of the folder of real data is loaded with these numbers, or refused with these
// words.

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "tests/unit/io_shared/shared_data.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Loads {
    std::string name; // a file, or the folder of a DICOM series; "*" stands for the end of a name
    glm::uvec3 size;
    glm::dvec3 spacing_mm, origin_mm; // LPS
    std::string towards;              // where x, y, z point: Left Right Posterior Anterior Superior
    std::string type;
    double min, max, mean;
    std::string warning; // a part of one; "" where there must be none
};

// From nibabel 5.0 (NIfTI), pydicom 2.3 with GDCM 3.0 (DICOM), VTK 9.1 (.vtk, .vti) and numpy on
// the plain bytes (NRRD, MetaImage), none of which is used by palpate's readers except GDCM. The
// retired JPEG processes 6/8 and 10/12, which pydicom refuses, are held against process 2/4 of the
// same image.
// clang-format off
const std::vector<Loads> kLoads = {
    {"ct_head/ct_brain_atlas_1mm.nii.gz",
     {202, 202, 179}, {1, 1, 1}, {100.802734, -81.6972656, 1126.80005}, "RAS", "i16", -30, 385, 6.86313465269863, ""},
    {"ct_head", // its DICOM lies in a folder below
     {64, 64, 93}, {3.2, 3.2, 1.5}, {0, 0, 0}, "LPS", "u16", 0, 3926, 507.687324113743, "taken as HU + 1024"},
    {"ct_head/dicom_axial_64",
     {64, 64, 93}, {3.2, 3.2, 1.5}, {0, 0, 0}, "LPS", "u16", 0, 3926, 507.687324113743, "taken as HU + 1024"},
    {"ct_trunk_labels/ct.nii.gz",
     {122, 101, 112}, {3, 3, 3}, {177.956329, -11.3190002, 94.3017578}, "RAS", "i16", -1207, 3382, -360.020385286479, ""},
    {"ct_trunk_labels/labels_totalseg_v2.nii.gz",
     {122, 101, 112}, {3, 3, 3}, {177.956329, -11.3190002, 94.3017578}, "RAS", "u8", 0, 117, 11.0059714621931, ""},
    {"ct_head/raw_slices_headsq/quarter.nhdr",
     {64, 64, 93}, {3.2, 3.2, 1.5}, {0, 0, 0}, "LPS", "u16", 0, 3926, 507.687324113743, "names no side"},
    {"dicom_codecs/CT0012*",
     {512, 512, 2}, {0.388672, 0.388672, 10}, {99.5, -301.5, -149}, "RPI", "i16", -14, 1199, 379.041732788086, "taken as HU + 1024"},
    {"dicom_codecs/CTImage.dcm",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_BigEndianExplicitTransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_DeflatedExplicitVRLittleEndianTransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_JPEG2000LosslessOnlyTransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_JPEG2000TransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3027, 1377, -949.13134765625, ""},
    {"dicom_codecs/CTImage.dcm_JPEGLSLosslessTransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_JPEGLSLossyTransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3025, 1377, -948.950698852539, ""},
    {"dicom_codecs/CTImage.dcm_JPEGProcess10_12TransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "f32", -3052.87863, 1369.66129, -950.108594800664, "f32 rounds by"},
    {"dicom_codecs/CTImage.dcm_JPEGProcess14SV1TransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_JPEGProcess14TransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_JPEGProcess1TransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "f32", -3083.352, 1349.4288, -967.8670265625, "f32 rounds by"},
    {"dicom_codecs/CTImage.dcm_JPEGProcess2_4TransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "f32", -3052.87863, 1369.66129, -950.108594800664, "f32 rounds by"},
    {"dicom_codecs/CTImage.dcm_JPEGProcess6_8TransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "f32", -3052.87863, 1369.66129, -950.108594800664, "f32 rounds by"},
    {"dicom_codecs/CTImage.dcm_LittleEndianExplicitTransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_LittleEndianImplicitTransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_codecs/CTImage.dcm_RLELosslessTransferSyntax*",
     {512, 512, 1}, {0.675781, 0.675781, 6.5}, {-161.399994, -148.800003, 4.7}, "LPS", "i16", -3024, 1378, -949.076435089111, ""},
    {"dicom_enhanced_mr/IM-0001-0170-0001.dcm",
     {256, 256, 8}, {1, 1, 1.20000565}, {100.293579, -150.604593, 116.949244}, "PIR", "f32", 0, 1081.748474, 541.541063469407, "f32 rounds by"},
    {"dicom_enhanced_mr/expected.nii.gz",
     {256, 256, 8}, {1, 1, 1.20000565}, {100.293579, -150.604599, 116.949242}, "PIR", "f32", 0, 1081.74854, 541.54109118572, ""},
    {"dicom_series_truth/anatomical",
     {256, 256, 4}, {1, 1, 1}, {-100.794158, -161.074673, 130.051254}, "PIR", "u8", 0, 254, 127.016868591309, ""},
    {"dicom_series_truth/compressed",
     {256, 256, 4}, {1, 1, 1}, {-100.794158, -161.074673, 130.051254}, "PIR", "u8", 0, 254, 127.047523498535, ""},
    {"dicom_series_truth/compressed_j2k",
     {256, 256, 4}, {1, 1, 1}, {-100.794158, -161.074673, 130.051254}, "PIR", "u8", 0, 254, 127.047523498535, ""},
    {"dicom_series_truth/compressed_jpeg",
     {256, 256, 4}, {1, 1, 1}, {-100.794158, -161.074673, 130.051254}, "PIR", "u8", 0, 254, 127.047523498535, ""},
    {"dicom_series_truth/compressed_jpegls",
     {256, 256, 4}, {1, 1, 1}, {-100.794158, -161.074673, 130.051254}, "PIR", "u8", 0, 254, 127.047523498535, ""},
    {"dicom_series_truth/compressed_rle",
     {256, 256, 4}, {1, 1, 1}, {-100.794158, -161.074673, 130.051254}, "PIR", "u8", 0, 254, 127.047523498535, ""},
    {"dicom_series_truth/expected.nii.gz",
     {256, 256, 4}, {1, 1, 1}, {-103.794159, -161.074677, 130.051254}, "PIL", "u8", 0, 254, 127.016868591309, ""},
    {"dicom_series_truth/expected_compressed.nii.gz",
     {256, 256, 4}, {1, 1, 1}, {-103.794159, -161.074677, 130.051254}, "PIL", "u8", 0, 254, 127.047523498535, ""},
    {"dicom_small/CT_small.dcm",
     {128, 128, 1}, {0.661468, 0.661468, 5}, {-158.135803, -179.035797, -75.699997}, "LPS", "i16", -896, 1167, -119.073852539062, ""},
    {"dicom_small/MR_small.dcm",
     {64, 64, 1}, {0.3125, 0.3125, 0.8}, {-83.9063, -91.2, 6.6406}, "LPS", "u16", 127, 2145, 518.88134765625, ""},
    {"dicom_small/MR_small_RLE.dcm",
     {64, 64, 1}, {0.3125, 0.3125, 0.8}, {-83.9063, -91.2, 6.6406}, "LPS", "u16", 127, 2145, 518.88134765625, ""},
    {"dicom_small/MR_small_bigendian.dcm",
     {64, 64, 1}, {0.3125, 0.3125, 0.8}, {-83.9063, -91.2, 6.6406}, "LPS", "u16", 127, 2145, 518.88134765625, ""},
    {"dicom_small/MR_small_implicit.dcm",
     {64, 64, 1}, {0.3125, 0.3125, 0.8}, {-83.9063, -91.2, 6.6406}, "LPS", "u16", 127, 2145, 518.88134765625, ""},
    {"dicom_small/MR_small_jp2klossless.dcm",
     {64, 64, 1}, {0.3125, 0.3125, 0.8}, {-83.9063, -91.2, 6.6406}, "LPS", "u16", 127, 2145, 518.88134765625, ""},
    {"dicom_small/MR_small_jpeg_ls_lossless.dcm",
     {64, 64, 1}, {0.3125, 0.3125, 0.8}, {-83.9063, -91.2, 6.6406}, "LPS", "u16", 127, 2145, 518.88134765625, ""},
    {"dicom_small/MR_small_padded.dcm",
     {64, 64, 1}, {0.3125, 0.3125, 0.8}, {-83.9063, -91.2, 6.6406}, "LPS", "u16", 127, 2145, 518.88134765625, ""},
    {"dicom_small/image_dfl.dcm",
     {512, 512, 1}, {1, 1, 1}, {0, 0, 0}, "LPS", "u8", 0, 255, 127.115966796875, "assumed"},
    // Means of numpy's unpacked bits.
    {"dicom_small/liver_1frame.dcm",
     {512, 512, 1}, {0.810547, 0.810547, 1}, {-235.2, -226.8, -128.69}, "LPS", "u8", 0, 1, 0.13821792602539062, ""},
    {"dicom_small/seg_liver_3frames.dcm",
     {512, 512, 3}, {0.810547, 0.810547, 1}, {-235.2, -226.8, -128.69}, "LPS", "u8", 0, 1, 0.1361821492513021, ""},
    {"labels_frog/frogtissue.mhd",
     {500, 470, 136}, {1, 1, 1.5}, {0, 0, 0}, "LPS", "u8", 0, 29, 0.384213767209011, ""},
    {"mr_hippocampus_labels/hippocampus_001_image.nii.gz",
     {35, 51, 35}, {1, 1, 1}, {-1, -1, 1}, "RAS", "u8", 2, 139, 63.5217927170868, ""},
    {"mr_hippocampus_labels/hippocampus_001_label.nii.gz",
     {35, 51, 35}, {1, 1, 1}, {-1, -1, 1}, "RAS", "u8", 0, 2, 0.0731812725090036, ""},
    {"mr_nrrd_negdir/brain1_image.nrrd",
     {256, 256, 25}, {0.78125, 0.78125, 6.5}, {-99.609375, 99.609375, -78}, "LAS", "u16", 0, 3057, 385.656408081055, ""},
    {"mr_nrrd_negdir/brain1_label.nrrd",
     {256, 256, 25}, {0.78125, 0.78125, 6.5}, {-99.609375, 99.609375, -78}, "LAS", "u8", 0, 1, 0.0025250244140625, ""},
    {"mr_small/mr_trunk_slab.nii.gz",
     {117, 91, 20}, {3, 3, 3}, {-168.59964, -166.359436, 28.9896412}, "LPS", "i16", -47, 833, 193.663524936602, ""},
    {"mr_t1gd_dicom_512",
     {512, 512, 40}, {0.41015625, 0.41015625, 1.5}, {-106.326809, -123.074438, -63.500669}, "LPS", "u16", 0, 1753, 270.129267024994, ""},
    {"nifti_variants/anatomical.nii",
     {33, 41, 25}, {2, 2, 2}, {-32, 40, -16}, "LAS", "i16", -610, 30393, 8401.06672579453, ""},
    {"nifti_variants/big.nii.gz",
     {64, 64, 21}, {4, 4, 6}, {0, 0, 0}, "LAS", "f32", -8.71075058, 18.5825291, 0.13542099169935, ""},
    {"nifti_variants/example_nifti2.nii.gz",
     {32, 20, 12}, {2, 2.00000005, 2.19999919}, {-117.855103, 35.7229424, -7.24879837}, "LAS", "u16", 49, 742, 450.7484375, "2 frames"},
    {"nifti_variants/functional.nii",
     {17, 21, 3}, {4, 4, 8}, {-32, 40, 0}, "LAS", "f32", 762.542437, 5538.06576, 3626.28062775884, "20 frames"},
    {"nifti_variants/little.nii.gz",
     {64, 64, 21}, {4, 4, 6}, {0, 0, 0}, "LAS", "f32", -8.71075058, 18.5825291, 0.13542099169935, ""},
    {"nifti_variants/reoriented_anat_moved.nii",
     {21, 26, 22}, {4, 4, 4}, {35.2978973, 47.9775848, -27.5994091}, "RAS", "f32", 0, 21199.9355, 2725.58853223091, ""},
    {"nifti_variants/standard.nii.gz",
     {4, 5, 7}, {1, 3, 2}, {0, 0, 0}, "RAS", "u8", 0, 255, 54.6428571428571, ""},
    {"nifti_variants/test.mgz", // numbers of nibabel
     {3, 4, 5}, {3.741657387, 3.741657387, 3.741657387}, {13, 11.5, -11.5}, "SAR", "f32", -1.7049814, 2.4723177, -0.0407881941956778, "2 frames"},
    {"nifti_variants/with_extension.nii.gz",
     {161, 191, 151}, {1, 1, 1}, {-80, -80, 85}, "LPI", "u8", 0, 1, 0.317196597924668, ""},
    {"nrrd_variants/BallBinary30x30x30.nhdr",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, ""},
    {"nrrd_variants/BallBinary30x30x30.nii.gz",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, ""},
    {"nrrd_variants/BallBinary30x30x30.nrrd",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, ""},
    {"nrrd_variants/BallBinary30x30x30_byteskip_minus_one.nhdr",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, ""},
    {"nrrd_variants/BallBinary30x30x30_byteskip_minus_one_nifti.nhdr",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, ""},
    {"nrrd_variants/BallBinary30x30x30_gz.nrrd",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, ""},
    {"nrrd_variants/BallBinary30x30x30_gz_byteskip_minus_one.nrrd",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, ""},
    {"nrrd_variants/BallBinary30x30x30_gz_lineskip.nrrd",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, ""},
    {"nrrd_variants/BallBinary30x30x30_nifti.nhdr",
     {30, 30, 30}, {1, 1, 1}, {0, 0, 0}, "LPS", "u16", 0, 257, 136.381333333333, "54352 bytes"},
    {"nrrd_variants/test1d_ascii.nrrd",
     {27, 1, 1}, {1.0458, 1, 1}, {0, 0, 0}, "LPS", "u8", 1, 27, 14, "names no space"},
    {"nrrd_variants/test2d_ascii.nrrd",
     {3, 9, 1}, {1.0458, 2, 1}, {0, 0, 0}, "LPS", "u8", 1, 27, 14, "names no space"},
    {"nrrd_variants/test_customFields.nrrd",
     {27, 1, 1}, {1.0458, 1, 1}, {0, 0, 0}, "LPS", "u8", 1, 27, 14, "names no space"},
    {"nrrd_variants/test_simple4d_raw.nrrd",
     {1, 1, 1}, {1.5, 1.5, 1}, {0, 0, 0}, "RAS", "f32", 0.76903426, 0.76903426, 0.76903426, "9 bytes"},
    {"vtk_formats/HeadMRVolume.mhd",
     {48, 62, 42}, {4, 4, 4}, {0, 0, 0}, "LPS", "u8", 0, 255, 24.4682219662058, ""},
    {"vtk_formats/foot.mha",
     {256, 256, 1}, {1, 1, 1}, {0, 0, 0}, "LPS", "u8", 0, 218, 31.3613891601562, ""},
    {"vtk_formats/ironProt.vtk",
     {68, 68, 68}, {1, 1, 1}, {0, 0, 0}, "LPS", "u8", 0, 255, 13.138258828618, ""},
    {"vtk_formats/vase_1comp.vti",
     {115, 101, 75}, {1, 1, 1}, {0, 0, 0}, "LPS", "u8", 0, 239, 12.3095204476969, ""},
};
// clang-format on

struct Refused {
    std::string name;
    std::string words;
};

const std::vector<Refused> kRefused = {
    {"README.md", "no format"},
    {"SHA256SUMS", "no format"},
    {"ct_head/raw_slices_headsq", "described by slices.json"},      // see SlicesOfHeadsq
    {"dicom_small/no_meta.dcm", "no DICOM file, or a damaged one"}, // begins with a stray byte
    {"dicom_small/rtstruct.dcm", "radiotherapy structure set (RTSTRUCT)"},
    {"labels_frog/frogtissue.zraw", "no format"}, // read through its header
    {"nifti_variants/5D_small.nii", "several components (3 in dimension 5)"},
    {"nifti_variants/analyze.hdr", "analyze.img: no such file"},
    {"nifti_variants/nifti1.hdr", "nifti1.img: no such file"},
    {"nifti_variants/nifti2.hdr", "nifti2.img: no such file"},
    {"nifti_variants/not-nifti.nii", "expected a header"},
    {"nifti_variants/small.mnc", "is MINC, which is not read"},
    {"nifti_variants/tiny.mnc", "is MINC, which is not read"},
    {"nrrd_variants/BallBinary30x30x30.raw", "no format"},
    {"nrrd_variants/BallBinary30x30x30_bz2.nrrd", "bzip2"},
    {"nrrd_variants/BallBinary30x30x30_byteskip_minus_five.nhdr", "-5"},
    {"vtk_formats/HeadMRVolume.raw", "no format"},
    {"vtk_formats/brainImageSmooth.vtk", "POLYDATA"},
    {"vtk_formats/foot.raw", "no format"},
};

// Files of which a folder holds many; each loads as one slice or is refused like the others.
struct Slices {
    std::string folder;
    glm::uvec3 size;
    std::string refusal; // "" where they load
};
const std::vector<Slices> kSlices = {
    {"ct_head/dicom_axial_64", {64, 64, 1}, ""},
    {"ct_head/raw_slices_headsq", {}, "no format"},
    {"dicom_series_truth/anatomical", {256, 256, 1}, ""},
    {"dicom_series_truth/compressed", {256, 256, 1}, ""},
    {"dicom_series_truth/compressed_j2k", {256, 256, 1}, ""},
    {"dicom_series_truth/compressed_jpeg", {256, 256, 1}, ""},
    {"dicom_series_truth/compressed_jpegls", {256, 256, 1}, ""},
    {"dicom_series_truth/compressed_rle", {256, 256, 1}, ""},
    {"mr_t1gd_dicom_512", {512, 512, 1}, ""},
};

// The letter of the patient's side towards which an index axis points most.
std::string towards(const Grid& grid) {
    constexpr const char* sides[] = {"RL", "AP", "IS"};
    std::string letters;
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 step(grid.world_from_index[axis]);
        int most = 0;
        for (int i = 1; i < 3; ++i)
            if (std::abs(step[i]) > std::abs(step[most]))
                most = i;
        letters.push_back(sides[most][step[most] > 0 ? 1 : 0]);
    }
    return letters;
}

double mean(const Volume& volume) {
    double sum = 0;
    std::vector<float> row(volume.size().x);
    for (uint32_t z = 0; z < volume.size().z; ++z)
        for (uint32_t y = 0; y < volume.size().y; ++y) {
            read_row(volume, {0, y, z}, volume.size().x, row.data());
            for (const float value : row)
                sum += value;
        }
    return sum / static_cast<double>(sample_count(volume.grid()));
}

// The file meant by the name of a row.
fs::path file_of(const std::string& name) {
    if (!name.ends_with('*'))
        return kShared / name;
    const fs::path start = kShared / name.substr(0, name.size() - 1);
    std::vector<fs::path> found;
    for (const fs::directory_entry& entry : fs::directory_iterator(start.parent_path()))
        if (entry.path().string().starts_with(start.string()))
            found.push_back(entry.path());
    EXPECT_EQ(found.size(), 1u) << name;
    return found.empty() ? start : found.front();
}

void expect_loads(const Loads& expected) {
    SCOPED_TRACE(expected.name);
    const Result<LoadedVolume> loaded = load_volume(file_of(expected.name));
    ASSERT_TRUE(loaded) << loaded.error().message;
    const Volume& volume = loaded->volume;
    EXPECT_EQ(volume.size(), expected.size);
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    for (int i = 0; i < 3; ++i) {
        // The table has nine digits; the files store float or decimals.
        EXPECT_NEAR(spacing[i], expected.spacing_mm[i], 1e-6 * expected.spacing_mm[i]);
        EXPECT_NEAR(volume.grid().world_from_index[3][i], expected.origin_mm[i], 1e-5);
    }
    EXPECT_EQ(towards(volume.grid()), expected.towards);
    EXPECT_EQ(name_of(volume.type()), expected.type);
    // Values are exact but for f32, which rounds each by 2^-24 of it at most; nine digits again.
    const double rounding =
        std::max({std::abs(expected.min), std::abs(expected.max), 1.0}) * (0x1p-24 + 1e-9);
    EXPECT_NEAR(volume.range().min, expected.min, rounding);
    EXPECT_NEAR(volume.range().max, expected.max, rounding);
    EXPECT_NEAR(mean(volume), expected.mean, rounding);
    EXPECT_EQ(volume.no_data_count(), 0u);
    if (expected.warning.empty())
        EXPECT_THAT(loaded->warnings, ::testing::IsEmpty());
    else
        EXPECT_THAT(loaded->warnings, ::testing::Contains(HasSubstr(expected.warning)));
}

void expect_refused(const std::string& name, const std::string& words) {
    const Result<LoadedVolume> loaded = load_volume(kShared / name);
    ASSERT_FALSE(loaded) << name;
    const std::string& message = loaded.error().message;
    EXPECT_THAT(message, HasSubstr(words)) << name;
    EXPECT_THAT(message, HasSubstr(fs::path(name).filename().string()));
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

// SharedData takes over 5 s of a processor: every file of the data folder is read, by a child of
// its own.
TEST_F(SharedData, LoadsAsTheTableSays) {
    for (const Loads& expected : kLoads)
        expect_loads(expected);
}

// Each within 2 s of processor time and 512 MiB, both of all children of this process.
TEST_F(SharedData, RefusesAsTheTableSays) {
    for (const Refused& expected : kRefused) {
        rusage before{}, after{};
        ::getrusage(RUSAGE_CHILDREN, &before);
        expect_refused(expected.name, expected.words);
        ::getrusage(RUSAGE_CHILDREN, &after);
        const auto seconds = [](const rusage& use) {
            return static_cast<double>(use.ru_utime.tv_sec + use.ru_stime.tv_sec) +
                   1e-6 * static_cast<double>(use.ru_utime.tv_usec + use.ru_stime.tv_usec);
        };
        EXPECT_LT(seconds(after) - seconds(before), 2.0) << expected.name;
        EXPECT_LT(after.ru_maxrss, 512 << 10) << expected.name;
    }
}

TEST_F(SharedData, SlicesOfSeriesLoadOneByOne) {
    for (const Slices& expected : kSlices)
        for (const fs::directory_entry& entry : fs::directory_iterator(kShared / expected.folder)) {
            if (entry.path().extension() == ".nhdr")
                continue;
            const Result<LoadedVolume> loaded = load_volume(entry.path());
            if (expected.refusal.empty()) {
                ASSERT_TRUE(loaded) << loaded.error().message;
                EXPECT_EQ(loaded->volume.size(), expected.size);
            } else {
                ASSERT_FALSE(loaded) << entry.path();
                EXPECT_THAT(loaded.error().message, HasSubstr(expected.refusal));
            }
        }
}

TEST_F(SharedData, EveryFileIsInTheTable) {
    std::set<std::string> named;
    for (const Loads& row : kLoads)
        named.insert(fs::relative(file_of(row.name), kShared).string());
    for (const Refused& row : kRefused)
        named.insert(row.name);
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kShared)) {
        if (!entry.is_regular_file())
            continue;
        const fs::path name = fs::relative(entry.path(), kShared);
        if (*name.begin() == "reported") // these have tests of their own, after their README
            continue;
        const bool is_slice = std::any_of(kSlices.begin(), kSlices.end(), [&](const Slices& row) {
            return name.parent_path() == row.folder;
        });
        EXPECT_TRUE(is_slice || named.count(name.string())) << name;
    }
}

} // namespace
} // namespace palpate
