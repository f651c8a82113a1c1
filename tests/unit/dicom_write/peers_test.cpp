// Other programs read the segmentations that are written: dciodvfy of dicom3tools, which checks
// them against the standard, and pydicom.

#include <gmock/gmock.h>

#include <cstdio>
#include <sstream>

#include "engine/io/dicom_labels_write.h"
#include "tests/unit/dicom_write/series.h"

namespace palpate {
namespace {

using test::Folder;

// A command's output, and its exit status.
std::pair<std::string, int> said_by(const std::string& command) {
    FILE* const pipe = ::popen((command + " 2>&1").c_str(), "r");
    std::string said;
    char buffer[4096];
    for (size_t got; (got = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;)
        said.append(buffer, got);
    return {said, ::pclose(pipe)};
}

class SegmentationPeers : public testing::Test {
 protected:
    // Random labels on a random series, as a segmentation and as NIfTI.
    void write(DicomLabels kind, unsigned seed) {
        std::mt19937 random(seed);
        test::SeriesPlace place = test::random_place(random);
        place.size.z += 1;
        test::write_series(folder_ / "ct", place);
        const auto reference = load_dicom_reference(folder_ / "ct");
        ASSERT_TRUE(reference) << reference.error().message;
        const Volume labels = test::random_labels(reference->grid, {2, 7, 200}, random);
        ASSERT_TRUE(save_volume(folder_ / "labels.nii", labels));
        DicomLabelOptions options;
        options.kind = kind;
        const std::vector<LabelName> names{{2, "kidney_right", glm::dvec3(1, 0, 0)},
                                           {7, "Größe", {}}};
        const auto saved =
            save_dicom_labels(folder_ / "seg.dcm", labels, names, *reference, options);
        ASSERT_TRUE(saved) << saved.error().message;
    }
    Folder folder_{"peers"};
};

TEST_F(SegmentationPeers, DciodvfyFindsNoError) {
    for (const DicomLabels kind : {DicomLabels::binary, DicomLabels::fractional})
        for (unsigned seed = 1; seed <= 4; ++seed) {
            write(kind, seed);
            const auto [said, status] = said_by("dciodvfy " + (folder_ / "seg.dcm").string());
            EXPECT_EQ(status, 0) << said;
            EXPECT_EQ(said.find("Error"), std::string::npos) << said;
            EXPECT_NE(said.find("Segmentation"), std::string::npos) << said; // it ran
            test::fs::remove_all(folder_ / "ct");
        }
}

// Version 20220618 of dicom3tools does not know label maps, which are of 2024, and expects that
// segments are numbered without gaps, as those of other segmentations are.
TEST_F(SegmentationPeers, DciodvfyFindsNoOtherErrorInALabelMap) {
    write(DicomLabels::label_map, 1);
    const auto [said, status] = said_by("dciodvfy " + (folder_ / "seg.dcm").string());
    EXPECT_NE(status, 127 << 8) << said; // it ran
    std::istringstream lines(said);
    for (std::string line; std::getline(lines, line);)
        if (line.find("Error") != std::string::npos) {
            EXPECT_THAT(line, testing::AnyOf(testing::HasSubstr("Information Object Not found"),
                                             testing::HasSubstr("SegmentNumber not monotonic")));
        }
}

TEST_F(SegmentationPeers, PydicomReadsTheSameSamplesAndReferences) {
    for (const DicomLabels kind :
         {DicomLabels::binary, DicomLabels::fractional, DicomLabels::label_map})
        for (unsigned seed = 1; seed <= 2; ++seed) {
            write(kind, seed);
            const auto [said, status] =
                said_by("/usr/bin/python3 " PALPATE_PYDICOM_CHECK " " + folder_.path().string());
            EXPECT_EQ(status, 0) << said;
            EXPECT_EQ(said, "same\n");
            test::fs::remove_all(folder_ / "ct");
        }
}

} // namespace
} // namespace palpate
