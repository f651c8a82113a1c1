// Tasks 13, 29 to 31 and 48 to 50: what a window writes is read again.

#include "engine/image/png.h"
#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "tests/view/task_session.h"

namespace palpate::view {
namespace {

// A ball of label 1 beside a bar of label 2, with names.
constexpr double kBall_mm = 12.0;

class FigureTask : public Task {
 protected:
    static OpenedScene named_labels() {
        const Volume volume = skull(41, 2.0);
        const Volume map = label_map(volume, [&](glm::uvec3 at) {
            const double mm = 2.0 * glm::distance(glm::dvec3(at), glm::dvec3(20.0));
            return mm <= kBall_mm ? 1 : at.x > 32 && at.x < 36 && at.z > 4 && at.z < 36 ? 2 : 0;
        });
        OpenedScene scene = scene_of_volume(volume, map);
        scene.scene.labels->styles.resize(3);
        scene.scene.labels->styles[1].color = glm::dvec3(1.0, 0.0, 0.0);
        scene.scene.labels->styles[2].color = glm::dvec3(0.0, 0.0, 1.0);
        scene.loaded.label_names = {{1, "organ", glm::dvec3(1.0, 0.0, 0.0)},
                                    {2, "bar", glm::dvec3(0.0, 0.0, 1.0)}};
        return scene;
    }
    Image read_png(const std::filesystem::path& path) {
        Result<Image> image = load_png(path);
        EXPECT_TRUE(image) << path;
        return image ? std::move(*image) : Image();
    }
};

class WriteTask : public FigureTask {};

TEST_F(WriteTask, T13_MeasuresAreATable) {
    begin(head(), false, /*writes=*/true);
    play("09_ruler");
    play("12_sphere");
    play("start/13");
    play("13_measures_to_a_table");
    const nlohmann::json measures = dump()["measures"];
    ASSERT_EQ(measures.size(), 2u);
    std::istringstream lines(text_of(folder() / "measures.csv"));
    std::vector<std::string> read;
    for (std::string line; std::getline(lines, line);)
        read.push_back(line);
    ASSERT_EQ(read.size(), 3u); // a head and two rows
    EXPECT_NE(read[1].find("ruler"), std::string::npos);
    // As many digits as give back the number.
    EXPECT_NE(read[1].find(fmt::format(",{},", measures[0]["length_mm"].get<double>())),
              std::string::npos)
        << read[1];
    EXPECT_NE(read[2].find("sphere"), std::string::npos);
}

// Pictures of 160 x 120 pixels keep the test quick.
TEST_F(FigureTask, T29_PicturesOfOneTurnAreWritten) {
    begin(head(24), false, /*writes=*/true);
    play("start/29");
    play("29_turntable");
    std::set<std::string> different;
    for (int i = 0; i < 8; ++i) {
        const auto path = folder() / fmt::format("figure-{:04}.png", i);
        ASSERT_TRUE(std::filesystem::exists(path)) << path;
        different.insert(text_of(path));
    }
    EXPECT_EQ(different.size(), 8u);
}

TEST_F(FigureTask, T30_APictureOfTheViewUnderThePointerIsWritten) {
    begin(head(), false, /*writes=*/true);
    play("30_picture_of_a_view");
    const Image picture = read_png(folder() / "figure.png");
    EXPECT_EQ(picture.size_px, glm::uvec2(1600, 1200));
    EXPECT_EQ(state().figure.panel, Panel::axial);
}

// White, 3000 pixels wide, and at the left below a patch of each label's colour.
TEST_F(FigureTask, T31_AFigureOf3000PixelsOnWhiteHasALegend) {
    begin(named_labels(), false, /*writes=*/true);
    play("31_figure_with_legend");
    const Image figure = read_png(folder() / "figure.png");
    ASSERT_EQ(figure.size_px.x, 3000u);
    for (uint32_t channel = 0; channel < 3; ++channel)
        EXPECT_EQ(figure.at(5, 5, channel), 1.0f);
    size_t red = 0, blue = 0;
    for (uint32_t y = figure.size_px.y * 3 / 4; y < figure.size_px.y; ++y)
        for (uint32_t x = 0; x < figure.size_px.x / 16; ++x) {
            const glm::vec3 rgb(figure.at(x, y, 0), figure.at(x, y, 1), figure.at(x, y, 2));
            red += rgb == glm::vec3(1.0f, 0.0f, 0.0f);
            blue += rgb == glm::vec3(0.0f, 0.0f, 1.0f);
        }
    EXPECT_GT(red, 100u);
    EXPECT_GT(blue, 100u);
}

// The surface lies between samples: within half a sample of the ball.
TEST_F(WriteTask, T48_TheSurfaceOfALabelIsAnStlFile) {
    begin(named_labels(), false, /*writes=*/true);
    play("48_export_for_print");
    const Result<LoadedMesh> read = load_mesh(folder() / "label-1.stl");
    ASSERT_TRUE(read) << read.error().message;
    const MeshTopology found = topology(read->mesh);
    EXPECT_TRUE(found.closed);
    EXPECT_EQ(found.euler_number, 2);
    const auto ball_mm3 = [](double radius_mm) {
        return 4.0 / 3.0 * M_PI * std::pow(radius_mm, 3);
    };
    EXPECT_GT(found.volume_mm3, ball_mm3(kBall_mm - 1.0));
    EXPECT_LT(found.volume_mm3, ball_mm3(kBall_mm + 1.0));
}

TEST_F(WriteTask, T49_LabelsAreANiftiFileWithTheirNames) {
    begin(named_labels(), false, /*writes=*/true);
    const size_t of_1 = count(1), of_2 = count(2);
    play("49_export_labels");
    const Result<LoadedVolume> read = load_labels(folder() / "labels.nii.gz");
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->labels.size(), 2u);
    EXPECT_EQ(read->labels[0].name, "organ");
    EXPECT_EQ(read->labels[1].name, "bar");
    std::map<float, size_t> counts;
    for (uint32_t z = 0; z < 41; ++z)
        for (uint32_t y = 0; y < 41; ++y)
            for (uint32_t x = 0; x < 41; ++x)
                ++counts[read->volume.value({x, y, z})];
    EXPECT_EQ(counts[1.0f], of_1);
    EXPECT_EQ(counts[2.0f], of_2);
}

// The stroke was made before the save, and is undone after the project was opened again.
TEST_F(WriteTask, T50_AStrokeIsUndoneAfterItsProjectWasOpenedAgain) {
    begin(scene_of_volume(skull(41, 2.0)), false, /*writes=*/true);
    play("34_paint_a_ball");
    ASSERT_EQ(count(1), 19u);
    recent_ = {(folder() / "work.palpate").string()}; // once it is saved
    play("50_undo_past_the_save");
    ASSERT_TRUE(viewer().work().saving().has_project());
    ASSERT_TRUE(Project::is_one(folder() / "work.palpate"));
    EXPECT_EQ(edited().undo_steps, 0u);
    EXPECT_EQ(edited().redo_steps, 1u);
    EXPECT_EQ(count(1), 0u);
}

} // namespace
} // namespace palpate::view
