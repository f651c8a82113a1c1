#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/image/exr.h"
#include "engine/image/png.h"
#include "engine/io/mesh_io.h"
#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;

class CompareCommand : public ProgramTest {
 protected:
    // a.exr and b.exr: 8 x 8 grey, of which b is 0.25 brighter in 4 pixels; c.png is b in 8 bits.
    CompareCommand() {
        Image image = make_image({8, 8}, {"R", "G", "B"});
        std::fill(image.samples.begin(), image.samples.end(), 0.5f);
        EXPECT_TRUE(save_exr(file("a.exr"), image, ExrPrecision::half_float));
        for (uint32_t x = 0; x < 4; ++x)
            for (size_t c = 0; c < 3; ++c)
                image.at(x, 0, c) = 0.75f;
        EXPECT_TRUE(save_exr(file("b.exr"), image, ExrPrecision::full_float));
        EXPECT_TRUE(save_png(file("c.png"), image));
    }

    ProgramRun compare(const std::string& a, const std::string& b,
                       std::vector<std::string> options = {}) const {
        options.insert(options.begin(), {"compare", file(a).string(), file(b).string()});
        return run(options);
    }
};

TEST_F(CompareCommand, PassesWhatIsIdentical) {
    const ProgramRun same = compare("a.exr", "a.exr");
    EXPECT_EQ(same.exit_code, 0) << same.messages;
    EXPECT_EQ(same.messages, "");
    const json said = json::parse(same.output);
    EXPECT_EQ(said["kind"], "image");
    EXPECT_EQ(said["size_px"], json({8, 8}));
    EXPECT_EQ(said["max"], 0.0);
    EXPECT_EQ(said["flip_mean"], 0.0);
    EXPECT_TRUE(said["pass"]);
}

TEST_F(CompareCommand, FailsWhatDiffersAndSaysByHowMuch) {
    const ProgramRun differing = compare("a.exr", "b.exr");
    EXPECT_EQ(differing.exit_code, 1);
    EXPECT_NE(differing.messages.find("share beyond the bound is 0.0625"), std::string::npos)
        << differing.messages;
    const json said = json::parse(differing.output);
    EXPECT_FALSE(said["pass"]);
    EXPECT_EQ(said["failed"].size(), 1u);
    EXPECT_EQ(said["max"], 0.25);
    EXPECT_EQ(said["beyond"], 4);
    EXPECT_EQ(said["rmse"], std::sqrt(0.0625 * 4 / 64));
    EXPECT_EQ(said["rgb"]["mean_signed"], 0.25 * 4 / 64);
    EXPECT_EQ(said["channels"]["G"]["max"], 0.25);
    EXPECT_GT(said["flip_mean"], 0.0);
}

TEST_F(CompareCommand, JudgesByTheTolerancesThatAreGiven) {
    EXPECT_EQ(compare("a.exr", "b.exr", {"--max", "0.25"}).exit_code, 0);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--max", "0.24"}).exit_code, 1);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--share", "0.0625"}).exit_code, 0);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--share", "0.06"}).exit_code, 1);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--share", "0", "--bound", "0.25"}).exit_code, 0);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--rmse", "0.0625"}).exit_code, 0);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--mean", "0.015"}).exit_code, 1);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--flip", "0.9"}).exit_code, 0);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--flip", "0.0001"}).exit_code, 1);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--neighborhood", "1"}).exit_code, 1);
    EXPECT_EQ(compare("a.exr", "b.exr", {"--max", "0.25", "--rmse", "0.01"}).exit_code, 1);
}

TEST_F(CompareCommand, ComparesAcrossFileFormats) {
    // 0.5 and 0.75 are no multiples of 1/255: an EXR beside a PNG is rounded as that was.
    EXPECT_EQ(compare("b.exr", "c.png", {"--max", "0"}).exit_code, 0);
    EXPECT_EQ(compare("c.png", "b.exr").exit_code, 0);
    EXPECT_EQ(compare("a.exr", "c.png").exit_code, 1);
}

TEST_F(CompareCommand, RefusesWhatCannotBeComparedInOneSentence) {
    ASSERT_TRUE(save_png(file("small.png"), make_image({2, 2}, {"R", "G", "B"})));
    write("broken.exr", bytes_of("a.exr").substr(0, 100));
    for (const ProgramRun& refused :
         {compare("a.exr", "small.png"), compare("a.exr", "broken.exr"),
          compare("a.exr", "absent.png"), compare("a.exr", "volume.nii"),
          compare("a.exr", "a.exr", {"--dice", "1"})}) {
        EXPECT_EQ(refused.exit_code, 1);
        EXPECT_EQ(refused.output, "");
        EXPECT_EQ(std::count(refused.messages.begin(), refused.messages.end(), '\n'), 1)
            << refused.messages;
    }
    EXPECT_EQ(run({"compare", "one.exr"}).exit_code, 2);
    EXPECT_EQ(compare("a.exr", "a.exr", {"--max", "-1"}).exit_code, 2);
}

// Two tetrahedra on both sides of one wall, of labels 2 (x > 0) and 1, far from the origin.
Mesh two_tetrahedra() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {-2, 0, 0}};
    for (glm::vec3& p : mesh.positions)
        p += glm::vec3(100, 200, 300);
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}, {0, 4, 1}, {0, 2, 4}, {1, 4, 2}};
    mesh.labels = {2, 2, 2, 2, 1, 1, 1};
    mesh.outer_labels = {1, 0, 0, 0, 0, 0, 0};
    return mesh;
}

TEST_F(CompareCommand, VolumesOfMeshesDoNotDependOnTheOrderOfTriangles) {
    Mesh mesh = two_tetrahedra();
    ASSERT_TRUE(save_mesh(file("first.ply"), mesh));
    std::reverse(mesh.triangles.begin(), mesh.triangles.end());
    std::reverse(mesh.labels.begin(), mesh.labels.end());
    std::reverse(mesh.outer_labels.begin(), mesh.outer_labels.end());
    ASSERT_TRUE(save_mesh(file("second.ply"), mesh));
    const json said = json::parse(compare("first.ply", "second.ply").output);
    const double rounding = 1e-9;
    for (const int one : {0, 1}) {
        EXPECT_NEAR(said["volume_mm3"][one].get<double>(), 0.5, rounding);
        EXPECT_NEAR(said["labels"][0]["volume_mm3"][one].get<double>(), 2.0 / 6.0, rounding);
        EXPECT_NEAR(said["labels"][1]["volume_mm3"][one].get<double>(), 1.0 / 6.0, rounding);
    }
    mesh.labels.clear();
    mesh.outer_labels.clear();
    mesh.triangles.erase(mesh.triangles.begin()); // a hole: nothing is enclosed
    ASSERT_TRUE(save_mesh(file("open.ply"), mesh));
    EXPECT_TRUE(json::parse(compare("open.ply", "open.ply").output)["volume_mm3"][0].is_null());
}

TEST_F(CompareCommand, ScoresLabelMapsAndJudgesTheirSurfaces) {
    const Grid grid = make_grid({24, 10, 10}, {1, 1, 2});
    const char* const names[] = {"l0.nrrd", "l1.nrrd", "l2.nrrd"};
    for (const uint32_t shift : {0u, 1u, 2u})
        ASSERT_TRUE(
            save_volume(file(names[shift]), make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
                            return i.x >= 4 + shift && i.x < 14 + shift ? 5.0 : 0.0;
                        })));
    const ProgramRun shifted =
        compare("l0.nrrd", "l1.nrrd",
                {"--labels", "--dice", "0.9", "--hausdorff", "1", "--tolerance-mm", "0.5",
                 "--surface-dice", "0.7", "--runs", file("l2.nrrd").string()});
    EXPECT_EQ(shifted.exit_code, 1);
    EXPECT_NE(shifted.messages.find("the least surface Dice"), std::string::npos)
        << shifted.messages;
    const json said = json::parse(shifted.output);
    EXPECT_EQ(said["failed"].size(), 1u) << said["failed"];
    EXPECT_EQ(said["least_dice"], 0.9);
    EXPECT_EQ(said["labels"][0]["surface"]["largest_mm"], 1.0);
    EXPECT_EQ(said["overall"]["sensitivity"], 0.9);
    EXPECT_NEAR(said["runs"][0]["jaccard_mean"].get<double>(), (2 * 9.0 / 11 + 8.0 / 12) / 3,
                1e-12);
    const ProgramRun idle = compare("l0.nrrd", "l0.nrrd", {"--tolerance-mm", "2"});
    EXPECT_EQ(idle.exit_code, 0);
    EXPECT_NE(idle.messages.find("--tolerance-mm"), std::string::npos) << idle.messages;
}

} // namespace
} // namespace palpate
