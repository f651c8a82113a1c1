// Labels as files, from the window.

#include "apps/view/document/label_export.h"
#include "apps/view/panels/export_panel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <thread>

#include "engine/io/dicom_reference.h"
#include "engine/io/mesh_io.h"
#include "engine/io/volume_io.h"
#include "engine/mesh/topology.h"
#include "engine/program/surface_labels.h"
#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

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

// Names that XML and lines of text could trip over come back, and a second program's reader finds
// the volume where it was.
TEST_F(LabelExportTest, AVolumeHoldsNamesAndColours) {
    const Volume labels = ball_and_bar();
    const std::vector<LabelName> names{
        {3, "left <kidney> & \"co\", \xc3\xa9", glm::dvec3(0.25, 0.5, 1)}, {7, "bar", {}}};
    for (const char* name : {"named.nii", "named.nii.gz", "named.nrrd"}) {
        SCOPED_TRACE(name);
        const auto wrote = export_labels(labels, 3, file(name), {}, names);
        ASSERT_TRUE(wrote) << wrote.error().message;
        EXPECT_TRUE(wrote->ends_with(", with their names")) << *wrote;
        const auto read = load_labels(file(name));
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_TRUE(read->warnings.empty());
        EXPECT_EQ(read->volume.grid(), labels.grid());
        EXPECT_EQ(count_labels(read->volume), count_labels(labels));
        ASSERT_EQ(read->labels.size(), 2u);
        EXPECT_EQ(read->labels[0], names[0]);
        EXPECT_EQ(read->labels[1].label, 7u);
        EXPECT_EQ(read->labels[1].name, "bar");
        EXPECT_TRUE(read->labels[1].color.has_value());
    }
    EXPECT_TRUE(
        export_labels(labels, 3, file("named.mha"), {}, names)->find("without their names") !=
        std::string::npos);
}

// They name the series that the volume came from; for another volume they are refused.
TEST_F(LabelExportTest, DicomObjectsBelongToTheOpenSeries) {
    for (int z = 0; z < 3; ++z)
        test::write(file(("slice" + std::to_string(z) + ".dcm").c_str()), test::dicom_slice(z));
    const auto series = load_volume(file("").parent_path());
    ASSERT_TRUE(series) << series.error().message;
    const Volume labels = make_volume(series->volume.grid(), ScalarType::u8,
                                      [](glm::uvec3 at) { return at.x < 3 ? 3.0 : 0.0; });
    const LabelSeries of{file("").parent_path(), "1.2.3.4"};
    const std::vector<LabelName> names{{3, "liver", {}}};
    const auto seg = export_labels(labels, 3, file("seg.dcm"), {}, names, of);
    ASSERT_TRUE(seg) << seg.error().message;
    EXPECT_THAT(*seg, HasSubstr("DICOM segmentation of the open series"));
    const auto read = load_labels(file("seg.dcm"));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(count_labels(read->volume), count_labels(labels));
    EXPECT_EQ(read->labels[0].name, "liver");
    const auto contours = export_labels(labels, 3, file("my_rtstruct.dcm"), {}, names, of);
    ASSERT_TRUE(contours) << contours.error().message;
    const auto back = load_structures(file("my_rtstruct.dcm"), of.path);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(count_labels(back->volume), count_labels(labels));
    ASSERT_TRUE(save_volume(file("other.nrrd"), labels));
    const auto other =
        export_labels(labels, 3, file("none.dcm"), {}, names, {file("other.nrrd"), {}});
    ASSERT_FALSE(other);
    EXPECT_THAT(other.error().message, HasSubstr("expected a series of DICOM images"));
    EXPECT_FALSE(fs::exists(file("none.dcm")));
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
        std::string told = work_.take_message().shown(false);
        while (told.starts_with("writing ") || told.starts_with("making ")) {
            std::this_thread::yield();
            work_.poll();
            if (std::string next = work_.take_message().shown(false); !next.empty())
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
    EXPECT_EQ(labels, "all labels written to " + file("labels-1.nii.gz").string());
    EXPECT_TRUE(load_labels(file("labels-1.nii.gz")));
    const std::string measures = write_out(order::ExportMeasures{file("measures.csv").string()});
    EXPECT_EQ(measures, "measures written: " + file("measures-1.csv").string());
    EXPECT_TRUE(fs::exists(file("measures-1.csv")));
    for (const char* name : {"labels.nii.gz", "measures.csv"})
        EXPECT_EQ(bytes_of(name), "of a person") << name;
}

TEST_F(Exports, ASurfaceForPrintIsCheckedAndNoneIsLeftWhereItIsStopped) {
    write("ball.stl", "of a person");
    MeshExport ball{.iso = 500.0, .pieces = {.largest_only = true}, .decimate_mm = 0.5};
    const std::string told = write_out(order::ExportMesh{ball, file("ball.stl").string()});
    EXPECT_TRUE(told.starts_with(file("ball-1.stl").string() + ": watertight, 1 piece, ")) << told;
    EXPECT_EQ(work_.mesh_writing().last().shown(false), told) << "it stays to be read";
    EXPECT_EQ(bytes_of("ball.stl"), "of a person");
    const auto whole = load_mesh(file("ball-1.stl"));
    ASSERT_TRUE(whole);
    const double mm3 = topology(whole->mesh).volume_mm3;
    EXPECT_TRUE(is_watertight(topology(whole->mesh)));

    ball.scale = 0.5;
    ball.within = {{center_mm(work_.subject().grid), {0.0, 0.0, 2.0}}};
    ASSERT_THAT(write_out(order::ExportMesh{ball, file("half.ply").string()}),
                HasSubstr("watertight"));
    const auto half = load_mesh(file("half.ply"));
    ASSERT_TRUE(half);
    const MeshTopology found = topology(half->mesh);
    EXPECT_TRUE(is_watertight(found));
    EXPECT_GT(found.volume_mm3, 0.3 * mm3 / 8.0);
    EXPECT_LT(found.volume_mm3, 0.7 * mm3 / 8.0);

    work_.obey(order::ExportMesh{ball, file("stopped.stl").string()}, state_);
    EXPECT_TRUE(work_.mesh_writing().share());
    EXPECT_THAT(write_out(order::StopMesh{}), HasSubstr("stopped"));
    EXPECT_FALSE(fs::exists(file("stopped.stl")));
    EXPECT_FALSE(work_.mesh_writing().share());
    EXPECT_THAT(write_out(order::ExportMesh{{.label = 9}, file("none.stl").string()}),
                HasSubstr("label"));
    EXPECT_THAT(write_out(order::ExportMesh{ball, file("none.txt").string()}),
                HasSubstr("ends in .stl, .ply, .obj or .vtp"));
}

TEST_F(Exports, NamesOfSurfacesAreThoseOfWhatIsWritten) {
    ExportSetup setup;
    setup.made.iso = -300.0;
    EXPECT_EQ(surface_file_name(setup, state_, work_), "surface_-300.stl");
    state_.iso.list.push_back({{}, "skin"});
    state_.iso.list.back().surface.value = -300.0;
    EXPECT_EQ(surface_file_name(setup, state_, work_), "skin.stl");
    setup.of_label = true;
    state_.label = 7;
    EXPECT_EQ(surface_file_name(setup, state_, work_), "label-7.stl");
    name_label(state_.notes, 7, "left kidney");
    EXPECT_EQ(surface_file_name(setup, state_, work_), "left_kidney.stl");
}

// Beside the volume, where a folder can be made there.
TEST_F(Exports, AProjectIsOfferedTheFolderOfTheVolume) {
    Source source{open_synthetic("synthetic:ball?size=8")};
    source.scene.file.volume = file("scans/ch2.nii.gz").string();
    fs::create_directories(file("scans"));
    Work work(std::move(source), {400, 300}, 1.0, true);
    EXPECT_EQ(work.saving().new_folder(false), file("scans/ch2.palpate").string());
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
