// palpate render --write-scene: a scene for another folder and another volume.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "engine/io/volume_io.h"
#include "engine/volume/synthetic.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;

class WrittenScene : public ProgramTest {
 protected:
    WrittenScene() {
        std::filesystem::create_directories(file("study/scenes"));
        std::filesystem::create_directories(file("far"));
        for (const auto& [name, middle] : {std::pair("study/ct.nrrd", 0.0), {"other.nrrd", 700.0}})
            EXPECT_TRUE(save_volume(file(name), synthetic::sample_ct_phantom(make_grid(
                                                    {40, 40, 20}, {5, 5, 10},
                                                    glm::dvec3(-100.0 + middle, -100, -100)))));
        EXPECT_EQ(run({"filter", file("study/ct.nrrd").string(), "--threshold", "300", "-o",
                       file("study/labels.nrrd").string()})
                      .exit_code,
                  0);
    }
    void render(std::vector<std::string> more) const {
        more.insert(more.begin(), "render");
        more.insert(more.end(), {"--size", "40,40"});
        const ProgramRun ran = run(more);
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    }
    json scene(const char* name) const { return json::parse(bytes_of(name)); }
};

TEST_F(WrittenScene, NamesFilesNearItSoThatTheFolderCanMove) {
    render({file("study/ct.nrrd").string(), "--labels", file("study/labels.nrrd").string(), "--iso",
            "300", "-o", file("a.png").string(), "--write-scene",
            file("study/scenes/s.json").string()});
    EXPECT_EQ(scene("study/scenes/s.json")["volume"], "../ct.nrrd");
    EXPECT_EQ(scene("study/scenes/s.json")["labels"], "../labels.nrrd");
    std::filesystem::rename(file("study"), file("moved"));
    render({file("moved/scenes/s.json").string(), "-o", file("b.png").string()});
    EXPECT_EQ(bytes_of("a.png"), bytes_of("b.png"));
}

// A layer of what the scene does not name is said, and not drawn.
TEST_F(WrittenScene, LayersWithoutTheirVolumeHaveNoEffect) {
    render({file("study/ct.nrrd").string(), "--iso", "300", "-o", file("a.png").string(),
            "--write-scene", file("s.json").string()});
    for (const auto& [layer, volume] : {std::pair("label_layer", "labels"),
                                        {"fusion_layer", "fused"},
                                        {"overlay_layer", "overlay"}}) {
        json more = scene("s.json");
        more[layer] = json::object();
        write("more.json", more.dump());
        const ProgramRun ran = run({"render", file("more.json").string(), "--size", "40,40", "-o",
                                    file("b.png").string()});
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_NE(ran.messages.find(std::string(layer) +
                                    " has no effect, because the scene has no " + volume),
                  std::string::npos)
            << ran.messages;
        EXPECT_EQ(bytes_of("a.png"), bytes_of("b.png")) << layer;
    }
}

TEST_F(WrittenScene, NamesFilesElsewhereWhole) {
    std::filesystem::create_directories(file("far/away"));
    render({file("study/ct.nrrd").string(), "--iso", "300", "-o", file("a.png").string(),
            "--write-scene", file("far/away/s.json").string()});
    EXPECT_EQ(scene("far/away/s.json")["volume"],
              std::filesystem::canonical(file("study/ct.nrrd")).string());
    render({"synthetic:ball?size=24", "-o", file("a.png").string(), "--write-scene",
            file("s.json").string()});
    EXPECT_EQ(scene("s.json")["volume"], "synthetic:ball?size=24");
}

// The same phantom 70 cm to the left: the scene draws it as if its view had been asked for.
TEST_F(WrittenScene, KeepsAViewForAnotherVolume) {
    const std::string path = file("study/s.json").string(), other = file("other.nrrd").string();
    render({file("study/ct.nrrd").string(), "--iso", "300", "--view", "left", "--fill", "0.6", "-o",
            file("a.png").string(), "--write-scene", path});
    EXPECT_EQ(scene("study/s.json")["camera"]["direction"], json({1, 0, 0}));
    EXPECT_EQ(scene("study/s.json")["camera"]["fill"], 0.6);
    render({path, "-o", file("b.png").string()});
    EXPECT_EQ(bytes_of("a.png"), bytes_of("b.png"));
    render({path, "--volume", other, "-o", file("c.png").string()});
    render(
        {other, "--iso", "300", "--view", "left", "--fill", "0.6", "-o", file("d.png").string()});
    EXPECT_EQ(bytes_of("c.png"), bytes_of("d.png"));
    // And through a second writing.
    render({path, "--view-angle", "40", "-o", file("e.png").string(), "--write-scene",
            file("study/t.json").string()});
    EXPECT_EQ(scene("study/t.json")["camera"]["view_angle_deg"], 40);
    render({file("study/t.json").string(), "-o", file("f.png").string()});
    EXPECT_EQ(bytes_of("e.png"), bytes_of("f.png"));
    // A camera that is placed stays in its place.
    render({path, "--camera", "0,-500,0,0,0,0", "-o", file("g.png").string(), "--write-scene",
            file("study/u.json").string()});
    EXPECT_EQ(scene("study/u.json")["camera"]["eye_mm"], json({0, -500, 0}));
}

} // namespace
} // namespace palpate
