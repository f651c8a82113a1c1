#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string refusal(const std::string& name, const std::string& bytes) {
    const TemporaryFolder folder;
    const auto result = decode_here(folder.write(name, bytes));
    return result ? "read" : result.error().message;
}

TEST(NotRead, NamesTheFormatAndWhatToDo) {
    const std::pair<const char*, const char*> names[] = {
        {"a.gipl", "is GIPL"},      {"a.GIPL.GZ", "is GIPL"},
        {"a+orig.HEAD", "is AFNI"}, {"a+orig.BRIK.gz", "is AFNI"},
        {"a.PAR", "is Philips"},    {"a.rec", "is Philips"},
        {"a.v", "is ECAT"},         {"a.mif", "is MRtrix"},
        {"a.mif.gz", "is MRtrix"},  {"a.dcm.gz", "gzipped DICOM"},
        {"a.mnc", "is MINC"},       {"a.nii.bz2", "is bzip2"},
    };
    for (const auto& [name, words] : names)
        EXPECT_THAT(refusal(name, "anything"),
                    AllOf(HasSubstr(name), HasSubstr(words), HasSubstr("which is not read; ")));
}

TEST(NotRead, KnowsMarksUnderAnyName) {
    std::string gipl(256, '\0');
    gipl.replace(252, 4, "\xef\xff\xe9\xb0");
    const std::pair<std::string, const char*> files[] = {
        {gipl, "is GIPL"},
        {"MATRIX72v", "is ECAT"},
        {"mrtrix image\ndim: 2,2,2\n", "is MRtrix"},
        {"# === DATA DESCRIPTION FILE ====", "is Philips"},
        {"\ntype  = integer-attribute\nname  = DATASET_RANK\n", "is AFNI"},
        {"\x89HDF\r\n\x1a\n", "is HDF5"},
        {deflated("anything"), "is gzip"},
    };
    for (const auto& [bytes, words] : files)
        EXPECT_THAT(refusal("a.dat", bytes), HasSubstr(words));
}

} // namespace
} // namespace palpate::io
