// Labels as files, from the window.

#include "apps/view/document/label_export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <thread>

#include "engine/io/mesh_io.h"
#include "engine/io/volume_io.h"
#include "engine/mesh/topology.h"
#include "engine/program/surface_labels.h"
#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

namespace fs = std::filesystem;

// A ball of label 3, of 12 mm, and a bar of label 7 that does not touch it.
Volume ball_and_bar() {
    const Grid grid = make_grid(glm::uvec3(40, 36, 20), glm::dvec3(1.0, 1.0, 2.0));
    return make_volume(grid, ScalarType::u8, [&](glm::uvec3 at) {
        const glm::dvec3 mm = glm::dvec3(at) * glm::dvec3(1.0, 1.0, 2.0);
        if (glm::distance(mm, glm::dvec3(15.0, 18.0, 20.0)) <= 12.0)
            return 3.0;
        return at.x >= 34 && at.x < 37 ? 7.0 : 0.0;
    });
}

class LabelExportTest : public ::testing::Test {
 protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path file(const char* name) const { return folder_ / name; }

 private:
    fs::path folder_ = fs::temp_directory_path() / ("palpate_labels_" + std::to_string(getpid()));
};

TEST_F(LabelExportTest, AVolumeHoldsAllLabels) {
    const Volume labels = ball_and_bar();
    ASSERT_TRUE(export_labels(labels, 3, file("labels.nii.gz"), {}));
    const auto read = load_labels(file("labels.nii.gz"));
    ASSERT_TRUE(read);
    ASSERT_EQ(read->volume.size(), labels.size());
    EXPECT_EQ(count_labels(read->volume), count_labels(labels));
}

// Smoothing moves a vertex by at most 0.375 of a sample on each axis from where it is the middle of
// samples of both sides, so the volume by at most the surface of a ball of 12 mm, three twelfths of
// its volume a mm, times 0.375 of the length of (1, 1, 2) mm. The bar would be beyond.
TEST_F(LabelExportTest, AMeshIsTheClosedSurfaceOfTheChosenLabel) {
    const Volume labels = ball_and_bar();
    for (const char* name : {"ball.stl", "ball.ply", "ball.obj", "ball.vtp"}) {
        ASSERT_TRUE(export_labels(labels, 3, file(name), {})) << name;
        const auto read = load_mesh(file(name));
        ASSERT_TRUE(read) << name;
        const MeshTopology found = topology(read->mesh);
        EXPECT_EQ(found.components.size(), 1u) << name;
        EXPECT_EQ(found.open_edges, 0u) << name;
        const double voxels_mm3 = 2.0 * static_cast<double>(count_labels(labels)[3]);
        EXPECT_NEAR(found.volume_mm3, voxels_mm3, 3.0 / 12.0 * 0.375 * std::sqrt(6.0) * voxels_mm3)
            << name;
    }
}

TEST_F(LabelExportTest, NothingIsWrittenOfALabelThatIsNowhereOrUnderAStrangeName) {
    const Volume labels = ball_and_bar();
    EXPECT_FALSE(export_labels(labels, 4, file("none.stl"), {}));
    const Result<std::string> strange = export_labels(labels, 3, file("labels.doc"), {});
    ASSERT_FALSE(strange);
    for (const char* ending : {".nii.gz", ".pbv", ".ply", ".stl", ".obj or .vtp", "\".doc\""})
        EXPECT_THAT(strange.error().message, ::testing::HasSubstr(ending));
    EXPECT_FALSE(export_labels(labels, 3, file("no/such/labels.nii"), {}));
    EXPECT_FALSE(export_labels(labels, 3, file("no/such/ball.stl"), {}));
    EXPECT_TRUE(fs::is_empty(file("")));
}

TEST_F(LabelExportTest, OneThatIsStoppedLeavesNothing) {
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(export_labels(ball_and_bar(), 3, file("ball.stl"), stop.get_token()));
    EXPECT_FALSE(export_labels(ball_and_bar(), 3, file("labels.nii.gz"), stop.get_token()));
    EXPECT_TRUE(fs::is_empty(file("")));
}

// With threads, as in a window: such a document can be written.
class Exports : public TemporaryFolder {
 protected:
    Work work_{Source{open_synthetic("synthetic:ball?size=24")}, {800, 600}, 1.0, true};
    ViewState state_ = work_.subject().home;

    // The last message to the person.
    std::string write_out(const DocumentOrder& order) {
        work_.obey(order, state_);
        std::string told = work_.take_message();
        while (told.starts_with("writing ")) {
            std::this_thread::yield();
            work_.poll();
            if (std::string next = work_.take_message(); !next.empty())
                told = std::move(next);
        }
        return told;
    }
};

TEST_F(Exports, ReplaceNoFileAndSayWhereTheyAre) {
    write("labels.nii.gz", "of a person");
    write("measures.csv", "of a person");
    state_.tool = &kDrawTool;
    work_.obey(order::StrokeDown{{}, 0.1}, state_);
    work_.obey(order::StrokeUp{{}, 0.2}, state_);
    const std::string labels = write_out(order::ExportLabels{file("labels.nii.gz").string()});
    EXPECT_EQ(labels, "all labels written to " + file("labels-1.nii.gz").string() +
                          ", without their names");
    EXPECT_TRUE(load_labels(file("labels-1.nii.gz")));
    const std::string measures = write_out(order::ExportMeasures{file("measures.csv").string()});
    EXPECT_EQ(measures, "measures written: " + file("measures-1.csv").string());
    EXPECT_TRUE(fs::exists(file("measures-1.csv")));
    for (const char* name : {"labels.nii.gz", "measures.csv"})
        EXPECT_EQ(bytes_of(name), "of a person") << name;
}

TEST_F(ViewerTest, AProjectIsOfferedTheNameOfTheFileWithoutItsEnding) {
    for (const auto& [file, folder] : {std::pair("/x/ch2.nii.gz", "ch2.palpate"),
                                       {"/x/a.b.nrrd", "a.b.palpate"},
                                       {"/x/CT", "CT.palpate"}}) {
        Source source{open_synthetic("synthetic:ball?size=8")};
        source.scene.file.volume = file;
        open_scene(std::move(source), {400, 300});
        EXPECT_EQ(viewer().work().saving().new_folder(false),
                  (fs::current_path() / folder).string());
    }
}

} // namespace
} // namespace palpate::view
