// The program writes segmentations, and keeps names of labels.

#include <gmock/gmock.h>

#include "engine/io/labels_write.h"
#include "engine/io/volume_io.h"
#include "tests/support/program.h"
#include "tests/unit/dicom_write/series.h"

namespace palpate {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ConvertLabels : public ProgramTest {
 protected:
    ConvertLabels() {
        std::mt19937 random(3);
        test::SeriesPlace place = test::random_place(random);
        place.size.z = 4;
        test::write_series(file("ct"), place);
        labels_ = test::random_labels(load_volume(file("ct"))->volume.grid(), {2, 5}, random);
        EXPECT_TRUE(save_labels(file("labels.nrrd"), *labels_, names_));
    }
    ProgramRun convert(const std::vector<std::string>& arguments) const {
        std::vector<std::string> all{"convert"};
        all.insert(all.end(), arguments.begin(), arguments.end());
        return run(all);
    }
    std::string path(const char* name) const { return file(name).string(); }

    std::vector<LabelName> names_{{2, "kidney_left", glm::dvec3(1, 0, 0)},
                                  {5, "liver", glm::dvec3(0, 1, 0)}};
    std::optional<Volume> labels_;
};

TEST_F(ConvertLabels, ToDicomAndBackWithTheirNames) {
    for (const char* kind : {"", "seg-fractional", "seg-labelmap"}) {
        std::vector<std::string> arguments{path("labels.nrrd"), path("seg.dcm"), "--reference",
                                           path("ct")};
        if (*kind != 0)
            arguments.insert(arguments.end(), {"--as", kind});
        const ProgramRun there = convert(arguments);
        ASSERT_EQ(there.exit_code, 0) << there.messages;
        const ProgramRun back = convert({"--labels", path("seg.dcm"), path("back.nii.gz")});
        ASSERT_EQ(back.exit_code, 0) << back.messages;
        const auto loaded = load_labels(file("back.nii.gz"));
        ASSERT_TRUE(loaded) << loaded.error().message;
        ASSERT_EQ(loaded->volume.size(), labels_->size());
        const glm::uvec3 size = labels_->size();
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x)
                    ASSERT_EQ(loaded->volume.value({x, y, z}), labels_->value({x, y, z}));
        ASSERT_EQ(loaded->labels.size(), 2u);
        EXPECT_EQ(loaded->labels[0].name, "kidney_left");
        EXPECT_EQ(loaded->labels[1].name, "liver");
        EXPECT_NEAR(loaded->labels[1].color->y, 1.0, 0.5 / 255); // CIELAB in 16 bits
        std::filesystem::remove(file("seg.dcm"));
    }
}

TEST_F(ConvertLabels, NamesComeFromATable) {
    write("names.txt", "2 spleen 10 20 30\n");
    const ProgramRun ran = convert({"--labels", path("labels.nrrd"), path("named.seg.nrrd"),
                                    "--label-names", path("names.txt")});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const std::vector<LabelName> found = load_labels(file("named.seg.nrrd"))->labels;
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].label, 2u);
    EXPECT_EQ(found[0].name, "spleen");
    EXPECT_NEAR(found[0].color->z, 30.0 / 255, 1e-6); // six digits are written
}

TEST_F(ConvertLabels, ToContoursAndBack) {
    const ProgramRun there = convert(
        {path("labels.nrrd"), path("rt.dcm"), "--reference", path("ct"), "--as", "rtstruct"});
    ASSERT_EQ(there.exit_code, 0) << there.messages;
    const ProgramRun back =
        convert({path("rt.dcm"), path("back.seg.nrrd"), "--reference", path("ct")});
    ASSERT_EQ(back.exit_code, 0) << back.messages;
    const auto loaded = load_labels(file("back.seg.nrrd"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    const glm::uvec3 size = labels_->size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                ASSERT_EQ(loaded->volume.value({x, y, z}), labels_->value({x, y, z}));
    ASSERT_EQ(loaded->labels.size(), 2u);
    EXPECT_EQ(loaded->labels[1].name, "liver");
    // Contours become a segmentation, too.
    const ProgramRun seg = convert({path("rt.dcm"), path("seg.dcm"), "--reference", path("ct")});
    ASSERT_EQ(seg.exit_code, 0) << seg.messages;
    EXPECT_EQ(load_labels(file("seg.dcm"))->volume.range().max, 5.0f);
}

TEST_F(ConvertLabels, WhatDoesNotFitIsRefusedWithoutAFile) {
    const std::string in = path("labels.nrrd"), out = path("out.dcm");
    const ProgramRun alone = convert({in, out});
    EXPECT_EQ(alone.exit_code, 2);
    EXPECT_THAT(alone.messages, HasSubstr("--reference"));
    const ProgramRun elsewhere = convert({in, path("out.nii"), "--reference", path("ct")});
    EXPECT_EQ(elsewhere.exit_code, 2);
    EXPECT_THAT(elsewhere.messages, HasSubstr("expected OUT to end in .dcm"));
    const ProgramRun absent = convert({in, out, "--reference", path("none")});
    EXPECT_EQ(absent.exit_code, 1);
    EXPECT_THAT(absent.messages, HasSubstr("none: no such file or folder"));
    const ProgramRun no_series =
        convert({in, out, "--reference", path("ct"), "--reference-series", "9.9.9"});
    EXPECT_EQ(no_series.exit_code, 1);
    EXPECT_THAT(no_series.messages, HasSubstr("9.9.9"));
    const ProgramRun other = convert({in, out, "--reference", path("ct"), "--spacing", "0.7"});
    EXPECT_EQ(other.exit_code, 1);
    EXPECT_THAT(other.messages, AllOf(HasSubstr("out.dcm"), HasSubstr("another grid")));
    write("codes.txt", "liver\n");
    const ProgramRun codes =
        convert({in, out, "--reference", path("ct"), "--codes", path("codes.txt")});
    EXPECT_EQ(codes.exit_code, 1);
    EXPECT_THAT(codes.messages, HasSubstr("codes.txt:1: expected NAME"));
    EXPECT_FALSE(std::filesystem::exists(out));
}

} // namespace
} // namespace palpate
