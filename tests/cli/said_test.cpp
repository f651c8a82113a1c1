// Messages of the program if a picture would silently be empty, or an option would change nothing.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <nlohmann/json.hpp>

#include "engine/image/png.h"
#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Said takes over 5 s of a processor: the program is started for each message, and each time a CPU
// driver compiles its shaders.
class Said : public ProgramTest {
 protected:
    // A body of 500 that ends softly in air of 0, from -8 to 8 mm.
    static Volume body(ScalarType type = ScalarType::i16, glm::uvec3 size = glm::uvec3(17)) {
        const glm::dvec3 middle = 0.5 * (glm::dvec3(size) - 1.0);
        return make_volume(make_grid(size, glm::dvec3(1.0), -middle), type, [=](glm::uvec3 i) {
            const double r = glm::length(glm::dvec3(i) - middle);
            return 500.0 * std::clamp((6.0 - r) / 3.0, 0.0, 1.0);
        });
    }
    void SetUp() override {
        ProgramTest::SetUp();
        ASSERT_TRUE(save_volume(file("v.nrrd"), body()));
    }
    // The messages of a run without the line that a file was made.
    std::string but_made(std::string messages, const char* made) const {
        const size_t line = messages.find("palpate: info: " + file(made).string() + ": ");
        EXPECT_NE(line, std::string::npos) << messages;
        return messages.erase(line, messages.find('\n', line) + 1 - line);
    }
    std::string drawn(std::vector<std::string> more, const char* volume = "v.nrrd") const {
        more.insert(more.begin(), {"render", file(volume).string(), "--size", "24,24", "-o",
                                   file("p.png").string()});
        const ProgramRun ran = run(more);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return but_made(ran.messages, "p.png");
    }
    bool is_black() const {
        const Result<Image> picture = load_png(file("p.png"));
        return picture && std::all_of(picture->samples.begin(), picture->samples.end(),
                                      [](float v) { return v == 0.0f; });
    }
};

TEST_F(Said, APictureThatShowsSomethingSaysNothing) {
    for (const std::vector<std::string>& more : {std::vector<std::string>{},
                                                 {"--mode", "mip"},
                                                 {"--iso", "250"},
                                                 {"--slice", "axial:3"},
                                                 {"--mode", "alpha", "--clip", "0,0,0,1,0,0"},
                                                 {"--view-angle", "20"},
                                                 {"--fill", "0.7"}}) {
        EXPECT_EQ(drawn(more), "") << testing::PrintToString(more);
        EXPECT_FALSE(is_black());
    }
}

TEST_F(Said, ASliceOutsideTheVolumeNamesWhereThatIs) {
    EXPECT_THAT(drawn({"--slice", "axial:80"}),
                HasSubstr("--slice axial:80 lies outside the volume, which is within left -8 .. 8, "
                          "posterior -8 .. 8, superior -8 .. 8 mm (LPS)"));
    EXPECT_TRUE(is_black());
    EXPECT_THAT(drawn({"--slice", "axial:8"}), Not(HasSubstr("outside"))); // its last plane
}

TEST_F(Said, AVolumeOfOneSliceIsSeenInAllModesAndBestInItsOwnPlane) {
    ASSERT_TRUE(save_volume(file("flat.nrrd"), body(ScalarType::i16, {17, 17, 1})));
    EXPECT_EQ(drawn({"--slice", "axial"}, "flat.nrrd"), "");
    EXPECT_FALSE(is_black());
    for (const char* mode : {"mip", "alpha"}) {
        EXPECT_EQ(drawn({"--mode", mode}, "flat.nrrd"), "");
        EXPECT_FALSE(is_black());
    }
    Grid tilted = body(ScalarType::i16, {17, 17, 1}).grid();
    tilted.world_from_index =
        glm::rotate(glm::dmat4(1.0), 0.3, glm::dvec3(1, 0, 0)) * tilted.world_from_index;
    ASSERT_TRUE(
        save_volume(file("tilted.nrrd"), with_grid(body(ScalarType::i16, {17, 17, 1}), tilted)));
    const std::string said = drawn({"--slice", "axial"}, "tilted.nrrd");
    EXPECT_FALSE(is_black());
    ASSERT_THAT(said, HasSubstr("which is one sample thick, and draws a strip; --slice "));
    const size_t at = said.rfind("--slice ") + 8; // what it says is what works
    EXPECT_EQ(drawn({"--slice", said.substr(at, said.find(' ', at) - at)}, "tilted.nrrd"), "");
    EXPECT_FALSE(is_black());
}

TEST_F(Said, ClipPlanesThatKeepNothingOrAll) {
    EXPECT_THAT(drawn({"--mode", "mip", "--clip", "9,0,0,1,0,0"}),
                HasSubstr("the clip plane keeps nothing of the volume, within left -8 .. 8"));
    EXPECT_TRUE(is_black());
    EXPECT_THAT(drawn({"--mode", "mip", "--clip", "3,0,0,1,0,0", "--clip", "2,0,0,-1,0,0"}),
                HasSubstr("the clip planes together keep nothing"));
    EXPECT_TRUE(is_black());
    EXPECT_THAT(drawn({"--mode", "mip", "--clip=-9,0,0,1,0,0"}),
                HasSubstr("the clip plane -9,0,0,1,0,0 cuts nothing away"));
    EXPECT_THAT(drawn({"--slice", "axial", "--clip", "0,0,0,1,0,0"}),
                HasSubstr("without effect here: --clip (slices are not cut)"));
}

TEST_F(Said, LabelsThatLieElsewhereOrAreNone) {
    Grid away = body().grid();
    away.world_from_index[3].y += 500.0;
    const Volume labels = make_volume(away, ScalarType::u8, [](glm::uvec3) { return 3.0; });
    ASSERT_TRUE(save_volume(file("l.nrrd"), labels));
    ASSERT_TRUE(save_volume(file("none.nrrd"), make_volume(body().grid(), ScalarType::u8,
                                                           [](glm::uvec3) { return 0.0; })));
    ASSERT_TRUE(save_volume(file("fit.nrrd"), with_grid(labels, body().grid())));
    const auto with = [&](const char* name, std::vector<std::string> more) {
        more.insert(more.begin(), {"--labels", file(name).string()});
        return drawn(more);
    };
    EXPECT_THAT(with("l.nrrd", {"--slice", "axial"}),
                AllOf(HasSubstr("the label map lies outside the volume: it is within left -8 .. 8, "
                                "posterior 492 .. 508, superior -8 .. 8 mm"),
                      HasSubstr("the volume within left -8 .. 8, posterior -8 .. 8")));
    EXPECT_THAT(with("none.nrrd", {"--slice", "axial"}), HasSubstr("holds no label"));
    EXPECT_EQ(with("fit.nrrd", {"--slice", "axial"}), "");
    EXPECT_THAT(with("fit.nrrd", {"--mode", "mip"}),
                HasSubstr("--labels (mode mip has no colours of labels)"));
    EXPECT_THAT(with("fit.nrrd", {"--surface", "iso=250"}), HasSubstr("--labels (without ray"));
    const ProgramRun felt =
        run({"touch", file("v.nrrd").string(), "--labels", file("l.nrrd").string(), "--trajectory",
             "press", "--duration", "0.01", "--iso", "250"});
    EXPECT_THAT(felt.messages, HasSubstr("the label map lies outside the volume"));
}

TEST_F(Said, AFusedVolumeAndAnOverlayThatLieElsewhere) {
    Grid away = body().grid();
    away.world_from_index[3].x += 1000.0;
    const Volume one = make_volume(away, ScalarType::u8, [](glm::uvec3) { return 3.0; });
    ASSERT_TRUE(save_volume(file("away.nrrd"), one));
    ASSERT_TRUE(save_volume(file("fit.nrrd"), with_grid(one, body().grid())));
    const auto with = [&](const char* option, const char* name) {
        return drawn({"--slice", "axial", option, file(name).string()});
    };
    const std::string name = file("away.nrrd").string();
    const std::string where =
        " lies outside the volume: it is within left 992 .. 1008, posterior -8 .. 8, superior -8 "
        ".. 8 mm, the volume within left -8 .. 8, posterior -8 .. 8, superior -8 .. 8 mm (LPS)\n";
    EXPECT_EQ(with("--fused", "away.nrrd"), "palpate: warning: the fused volume " + name + where);
    EXPECT_EQ(with("--overlay", "away.nrrd"), "palpate: warning: the overlay " + name + where);
    EXPECT_EQ(with("--fused", "fit.nrrd"), "");
    EXPECT_EQ(with("--overlay", "fit.nrrd"), "");
}

TEST_F(Said, WindowsTransferFunctionsAndCamerasThatShowNothing) {
    EXPECT_THAT(drawn({"--mode", "mip", "--window", "1000,2000"}),
                HasSubstr("all of the volume's values, 0 .. 500, are transparent"));
    EXPECT_TRUE(is_black());
    EXPECT_THAT(drawn({"--slice", "axial", "--window", "1000,2000"}),
                HasSubstr("have one colour in slices"));
    EXPECT_THAT(drawn({"--camera", "0,-50,0,0,-100,0"}), HasSubstr("the camera sees nothing"));
    EXPECT_TRUE(is_black());
    EXPECT_EQ(drawn({"--camera", "0,-50,12,0,0,12", "--projection", "orthographic"}), "");
    EXPECT_THAT(drawn({"--camera", "0,-50,200,0,0,200", "--projection", "orthographic"}),
                HasSubstr("the camera sees nothing"));
    // Every part shows something, and all of them nothing: rays of 1 mm through opacity of 0.
    write("tf.json", R"({"colors": [[0, 1, 1, 1]], "opacities": [[499, 0], [500, 0], [500, 1]]})");
    const std::string thin =
        drawn({"--tf", file("tf.json").string(), "--camera", "7,-50,7,7,0,7", "--view-angle", "1"});
    EXPECT_TRUE(is_black());
    EXPECT_THAT(thin, HasSubstr("p.png: the picture has one colour: "));
}

TEST_F(Said, OptionsOfRenderThatChangeNothing) {
    struct Case {
        std::vector<std::string> more;
        const char* words;
    };
    for (const Case& c : {
             Case{{"--iso", "250", "--window", "0,500"}, "--window (iso-surfaces have own"},
             Case{{"--iso", "250", "--tf", "mr"}, "--tf (iso-surfaces have own"},
             Case{{"--iso", "250", "--no-shade"}, "--no-shade (of mode alpha"},
             Case{{"--mode", "mip", "--shade"}, "--shade (of mode alpha"},
             Case{{"--mode", "alpha", "--iso", "250"}, "--iso (of mode iso)"},
             Case{{"--mode", "mip", "--min-transmittance", "0.1"}, "--min-transmittance (mode mip"},
             Case{{"--integrator", "exact", "--step", "2"}, "--step (of fast"},
             Case{{"--sub-steps", "4"}, "--sub-steps (of mode alpha with"},
             Case{{"--iso", "250", "--integrator", "preintegrated"}, "--integrator (preint"},
             Case{{"--slice", "axial", "--step", "1"}, "--step (without ray casting"},
             Case{{"--slice", "axial", "--fill", "0.5"}, "--fill (without --view)"},
             Case{{"--slice", "axial", "--view-angle", "9"}, "--view-angle (of --projection"},
             Case{{"--slice", "axial", "--slab-mode", "mean"}, "--slab-mode (without --slab)"},
             Case{{"--camera", "0,-50,0,0,0,0", "--view", "top"}, "--view (with --camera)"},
             Case{{"--values"}, "--values (of .exr alone)"},
             Case{{"--surface", "iso=250", "--surface-depth", "3"}, "--surface-depth (without see"},
             Case{{"--surface", "iso=250", "--residency", "dense"}, "--residency (meshes alone"},
             Case{{"--no-shade", "--gradients", "taps"}, "--gradients (of shaded"},
         })
        EXPECT_THAT(drawn(c.more), AllOf(HasSubstr("without effect here: "), HasSubstr(c.words)))
            << c.words;
}

// --fill and --view-angle say of the view that is drawn without --view what they say of a --view.
TEST_F(Said, FillAndViewAngleMoveTheCameraWithoutAView) {
    for (const std::vector<std::string>& how :
         {std::vector<std::string>{"--fill", "0.5"}, {"--view-angle", "12"}}) {
        drawn({});
        const std::string usual = bytes_of("p.png");
        std::vector<std::string> viewed = how;
        viewed.insert(viewed.end(), {"--view", "oblique"});
        drawn(viewed);
        const std::string expected = bytes_of("p.png");
        EXPECT_NE(expected, usual);
        drawn(how);
        EXPECT_EQ(bytes_of("p.png"), expected);
    }
    drawn({"--window", "0,400"});
    const std::string window = bytes_of("p.png");
    drawn({"--window-level", "200,400"});
    EXPECT_EQ(bytes_of("p.png"), window);
}

// A scene file's own slices and camera take the options too.
TEST_F(Said, OptionsReplaceWhatASceneFileSays) {
    write("scene.json", R"({"volume": "v.nrrd", "size_px": [24, 24],
        "camera": {"direction": [0, -1, 0], "fill": 0.5}, "slices": [{"normal": [0, 1, 0]}],
        "slice_transfer": {"window": [0, 500]}})");
    drawn({}, "scene.json");
    const std::string usual = bytes_of("p.png");
    EXPECT_EQ(drawn({"--window", "0,5000"}, "scene.json"), "");
    EXPECT_NE(bytes_of("p.png"), usual);
    EXPECT_EQ(drawn({"--fill", "1"}, "scene.json"), "");
    EXPECT_NE(bytes_of("p.png"), usual);
    write("viewed.json", R"({"volume": "v.nrrd", "camera": {"direction": [0, 0, 1],
        "up": [0, 1, 0]}})");
    drawn({}, "viewed.json"); // nothing says what to draw, but from where
    const std::string above = bytes_of("p.png");
    drawn({});
    EXPECT_NE(bytes_of("p.png"), above);
}

TEST_F(Said, StrokesThatChangeNothing) {
    const auto stroke = [](const char* operation, double x) {
        return fmt::format(R"({{"stroke": 1, "units": "mm", "shape": {{"kind": "ball", )"
                           R"("radius_mm": 2}}, "operation": {}}})"
                           "\n{{\"p_mm\": [{}, 0, 0]}}\n",
                           operation, x);
    };
    const char* cut = R"({"kind": "cut", "to_value": 0})";
    const auto edited = [&](const std::string& strokes) {
        write("s.jsonl", strokes);
        const ProgramRun ran = run({"edit", file("v.nrrd").string(), file("s.jsonl").string(), "-o",
                                    file("o.nrrd").string()});
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return but_made(ran.messages, "o.nrrd");
    };
    EXPECT_EQ(edited(stroke(cut, 0)), "");
    EXPECT_THAT(edited(stroke(cut, 0) + stroke(cut, 500)),
                HasSubstr("1 of 2 strokes changed no sample: of stroke 2, its tool stays within "
                          "left 498 .. 502, posterior -2 .. 2, superior -2 .. 2 mm, and the volume "
                          "lies elsewhere, within left -8 .. 8"));
    EXPECT_THAT(edited(stroke(R"({"kind": "cut", "to_value": 500})", 0)),
                HasSubstr("'cut' finds nothing to change"));
    EXPECT_THAT(edited(stroke(R"({"kind": "cut", "to_value": 0, "only_values": [900, 999]})", 0)),
                HasSubstr("no sample with a value of only_values is in its tool"));
}

TEST_F(Said, SurfacesOfSomeLabels) {
    ASSERT_TRUE(save_volume(
        file("l.nrrd"),
        make_volume(make_grid({12, 6, 6}, glm::dvec3(1)), ScalarType::u8, [](glm::uvec3 i) {
            const bool in =
                glm::all(glm::greaterThan(i, glm::uvec3(0))) && i.y < 5 && i.z < 5 && i.x < 10;
            return in ? (i.x < 4 ? 5.0 : 7.0) : 0.0;
        })));
    const auto labels = [&](const std::string& which, const char* walls) {
        const ProgramRun made = run({"surface", file("l.nrrd").string(), which, "--walls", walls,
                                     "-o", file("m.ply").string(), "--report", "-"});
        EXPECT_EQ(made.exit_code, 0) << made.messages;
        std::vector<int> found;
        const auto report = nlohmann::json::parse(made.output);
        for (const auto& entry : report["labels"]) {
            found.push_back(entry["label"]);
            EXPECT_EQ(entry["open_edges"], 0);
        }
        return found;
    };
    for (const char* walls : {"shared", "separate"}) {
        EXPECT_EQ(labels("--labels", walls), (std::vector<int>{5, 7}));
        EXPECT_EQ(labels("--labels=5", walls), (std::vector<int>{5}));
        EXPECT_EQ(labels("--labels=7,5", walls), (std::vector<int>{5, 7}));
    }
    const auto refused = [&](const char* which, int code) {
        const ProgramRun ran =
            run({"surface", file("l.nrrd").string(), which, "-o", file("n.ply").string()});
        EXPECT_EQ(ran.exit_code, code);
        EXPECT_FALSE(std::filesystem::exists(file("n.ply")));
        return ran.messages;
    };
    EXPECT_THAT(refused("--labels=6", 1), HasSubstr("no sample has label 6"));
    EXPECT_THAT(refused("--labels=bone", 1),
                HasSubstr("--labels: expected a number, because the label map names no labels, "
                          "found 'bone'"));
    for (const char* wrong : {"--labels=5,", "--labels=0", "--labels=65536"})
        EXPECT_THAT(refused(wrong, 2), HasSubstr("expected labels from 1 to 65535"));
}

// Commands that print nothing else say in one line what they made; --quiet drops it.
TEST_F(Said, OneLineSaysWhatWasMade) {
    const std::string ball = "synthetic:ball?size=24";
    write("s.jsonl",
          "{\"stroke\": 1, \"units\": \"mm\", \"shape\": {\"kind\": \"ball\", \"radius_mm\": 9}, "
          "\"operation\": {\"kind\": \"cut\"}}\n{\"p_mm\": [0, 0, 0]}\n");
    const struct {
        std::vector<std::string> words;
        const char *out, *what;
    } cases[] = {
        {{"convert", ball, file("c.nrrd").string()}, "c.nrrd", "24 x 24 x 24 samples of [a-z0-9]+"},
        {{"convert", ball, file("c.pbv").string()}, "c.pbv", "24 x 24 x 24 samples of [a-z0-9]+"},
        {{"filter", ball, "--gaussian", "1", "-o", file("f.nii").string()},
         "f.nii",
         "24 x 24 x 24 samples of f32"},
        {{"edit", ball, file("s.jsonl").string(), "-o", file("e.mha").string()},
         "e.mha",
         "24 x 24 x 24 samples of [a-z0-9]+"},
        {{"surface", ball, "--iso", "500", "-o", file("s.stl").string()},
         "s.stl",
         "[0-9]+ triangles, [0-9]+ vertices"},
        {{"render", ball, "--size", "40,30", "-o", file("r.png").string()},
         "r.png",
         "40 x 30 pixels"},
    };
    for (const auto& [words, out, what] : cases) {
        const ProgramRun ran = run(words);
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_EQ(ran.output, "");
        EXPECT_THAT(ran.messages,
                    testing::MatchesRegex(fmt::format(
                        "palpate: info: .*{}: {}, [0-9.]+ (bytes|kB|MB)\n", out, what)));
        std::vector<std::string> quiet = words;
        quiet.insert(quiet.begin(), "--quiet");
        EXPECT_EQ(run(quiet).messages, "") << words[0];
    }
}

} // namespace
} // namespace palpate
