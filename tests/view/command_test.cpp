// palpate view, as a person runs it, without a window.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "engine/image/png.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

class ViewCommand : public ProgramTest {
 protected:
    ProgramRun view(const std::vector<std::string>& more) const {
        std::vector<std::string> all{"view", "synthetic:phantom?size=32", "--headless"};
        all.insert(all.end(), more.begin(), more.end());
        return run(all);
    }
};

TEST_F(ViewCommand, DoesAScriptToTheSameBytesEachTime) {
    write("script.jsonl", R"({"palpate_view": 1, "size": [640, 480]}
{"frame": 1, "key": "b", "down": true}
{"frame": 2, "key": "b"}
{"frame": 3, "move": [90, 100]}
{"frame": 4, "button": "left", "down": true}
{"frame": 5, "move": [130, 120]}
{"frame": 6, "button": "left"}
)");
    std::string states[2], shots[2];
    for (int i = 0; i < 2; ++i) {
        ::setenv("LP_NUM_THREADS", i == 0 ? "2" : "1", 1);
        const ProgramRun ran = view({"--replay", file("script.jsonl").string(), "--shot",
                                     file("shot.png").string(), "--state", "-", "--validate"});
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_EQ(ran.messages, "");
        states[i] = ran.output;
        shots[i] = bytes_of("shot.png");
    }
    ::unsetenv("LP_NUM_THREADS");
    EXPECT_EQ(states[0], states[1]);
    EXPECT_EQ(shots[0], shots[1]);
    const auto state = nlohmann::json::parse(states[0]);
    EXPECT_EQ(state["tool"]["hand"], "draw");
    EXPECT_EQ(state["undo_steps"], 1);
    EXPECT_EQ(load_png(file("shot.png")).value().size_px, glm::uvec2(640, 480));
}

// A cube of 12 samples a side, as text: a volume of many values, or labels in a half of it.
std::string cube(bool labels) {
    std::string text = fmt::format(
        "NRRD0004\ntype: {}\ndimension: 3\nsizes: 12 12 12\n"
        "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
        "space origin: (0,0,0)\nencoding: ascii\n\n",
        labels ? "uint8" : "int16");
    for (int i = 0; i < 12 * 12 * 12; ++i) {
        const int x = i % 12, y = i / 12 % 12, z = i / 144;
        const bool inside = x > 2 && x < 9 && y > 2 && y < 9 && z > 2 && z < 9;
        text += std::to_string(labels ? inside * 3 : (7 * x + 11 * y + 13 * z) % 256 - 20) +
                (x == 11 ? "\n" : " ");
    }
    return text;
}

TEST_F(ViewCommand, FilesAfterTheFirstLieOverItEachByWhatItHolds) {
    write("first.nrrd", cube(false));
    write("second.nrrd", cube(false));
    write("organs.nrrd", cube(true));
    const std::vector<std::string> files{"view", file("first.nrrd").string(),
                                         file("organs.nrrd").string(),
                                         file("second.nrrd").string()};
    std::vector<std::string> all = files;
    all.insert(all.end(), {"--headless", "--size", "1280,1000", "--state", "-"});
    const ProgramRun ran = run(all);
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const auto state = nlohmann::json::parse(ran.output);
    EXPECT_EQ(state["label_counts"]["3"], 6 * 6 * 6);
    EXPECT_TRUE(state["widgets"].contains("slices/fused"));
    all.insert(all.begin() + 4, file("first.nrrd").string());
    const ProgramRun refused = run(all);
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(refused.messages, HasSubstr("expected at most one other volume over a volume"));
}

// Their slices would look as if they were not there.
TEST_F(ViewCommand, SaysThatAnotherVolumeLiesElsewhere) {
    write("away.nrrd",
          "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\n"
          "space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
          "space origin: (1000,0,0)\nencoding: ascii\n\n1 2 3 4 5 6 7 8\n");
    const std::string sentence = "the fused volume " + file("away.nrrd").string() +
                                 " lies outside the volume: it is within left 1000 .. 1001";
    const ProgramRun ran = view({"--fused", file("away.nrrd").string(), "--state", "-"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.messages, HasSubstr("warning: " + sentence));
    EXPECT_THAT(nlohmann::json::parse(ran.output)["message"].get<std::string>(),
                HasSubstr(sentence));
}

TEST_F(ViewCommand, FailuresAreOneSentence) {
    const auto expect = [&](int code, const std::vector<std::string>& words, const char* sentence) {
        const ProgramRun ran = run(words);
        EXPECT_EQ(ran.exit_code, code) << ran.messages;
        EXPECT_THAT(ran.messages, HasSubstr(sentence));
        if (code == 1) {
            EXPECT_EQ(ran.messages.find('\n'), ran.messages.size() - 1) << ran.messages;
        }
    };
    ::unsetenv("DISPLAY");
    ::unsetenv("WAYLAND_DISPLAY");
    expect(1, {"view", "synthetic:ball?size=8"}, "expected a display");
    expect(1, {"view", "nowhere.nii", "--headless", "--state", "-"}, "nowhere.nii");
    expect(
        1,
        {"view", "synthetic:ball?size=8", "--headless", "--replay", "none.jsonl", "--state", "-"},
        "none.jsonl");
    expect(2, {"view", "synthetic:ball?size=8", "--size", "100,100"}, "expected at least 480,320");
    expect(2, {"view", "synthetic:ball?size=8", "--headless"}, "--headless: expected");
    expect(2, {"view", "--headless", "--state", "-"}, "SCENE is required with --headless");
    expect(1, {"view"}, "expected a display");
    expect(2, {"view", "synthetic:ball?size=8", "--shot", "a.png"}, "--shot: needs --headless");
    expect(1,
           {"view", "synthetic:ball?size=8", "--headless", "--state", "-", "--device", "nothing"},
           "no Vulkan device can be used");
    const std::string shot = file("shot.png").string();
    for (const char* residency : {"auto", "dense", "atlas"})
        expect(1,
               {"view", "synthetic:phantom?size=64", "--headless", "--shot", shot, "--gpu-memory",
                "100K", "--residency", residency},
               "bytes of graphics memory, and 0 are left of the limit");
    EXPECT_FALSE(std::filesystem::exists(shot));
    std::filesystem::create_directory(file("p"));
    write("p/project.json", "{\"project\": 1}");
    expect(1, {"view", file("p").string(), "--headless", "--state", "-"},
           "p/project.json:1: expected \"save\" and \"volumes\"");
}

// Native code draws the views and the interface.
TEST_F(ViewCommand, NeedsNoDriverOfTheSystemWithoutAScreen) {
    for (const char* drivers : {"VK_ICD_FILENAMES", "VK_DRIVER_FILES"})
        ::setenv(drivers, "/nonexistent", 1);
    const std::string shot = file("shot.png").string();
    const ProgramRun ran = run({"view", "synthetic:ball?size=8", "--headless", "--shot", shot});
    EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_TRUE(std::filesystem::exists(shot));
    for (const char* drivers : {"VK_ICD_FILENAMES", "VK_DRIVER_FILES"})
        ::unsetenv(drivers);
}

// The sample of docs/reference/view-scripts.md does what the page says.
TEST_F(ViewCommand, TheSampleScriptOfTheDocsPutsTheCrosshairIntoTheHead) {
    std::ifstream in(std::string(kSourceDir) + "/docs/reference/view-scripts.md");
    const std::string page((std::istreambuf_iterator<char>(in)), {});
    const size_t begin = page.find("```json\n") + 8, end = page.find("```", begin);
    ASSERT_NE(end, page.npos);
    write("sample.jsonl", page.substr(begin, end - begin));
    const ProgramRun ran =
        run({"--quiet", "view", "/usr/share/doc/invesalius-examples/examples/Cranium.inv3",
             "--headless", "--replay", file("sample.jsonl").string(), "--state", "-"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const auto state = nlohmann::json::parse(ran.output);
    EXPECT_EQ(state["at_crosshair"], "(127, 108, 61)  17 HU");
    EXPECT_THAT(page, HasSubstr("sample (127, 108, 61) with 17 HU"));
    const auto eye = state["camera"]["eye_mm"], target = state["camera"]["target_mm"];
    EXPECT_EQ(eye[0], target[0]);
    EXPECT_EQ(eye[1], target[1]);
    EXPECT_GT(eye[2], target[2]);
}

// An option that the window comes to heed leaves this list and that of view/command.cpp.
TEST_F(ViewCommand, OptionsWithoutEffectAreSaid) {
    const std::vector<std::vector<std::string>> idle{{"--slab", "3"},
                                                     {"--slab-mode", "maximum"},
                                                     {"--interpolation", "cubic"},
                                                     {"--values"},
                                                     {"--frame-ms", "30"}};
    std::vector<std::string> all{"--state", file("s.json").string()};
    for (const auto& option : idle)
        all.insert(all.end(), option.begin(), option.end());
    const ProgramRun ran = view(all);
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    for (const auto& option : idle)
        EXPECT_THAT(ran.messages, HasSubstr(option.front() + " ("));
    EXPECT_THAT(view({"--state", file("s.json").string(), "--slice", "axial"}).messages,
                HasSubstr("--slice ("));
    EXPECT_EQ(view({"--state", file("s.json").string(), "--mode", "mip", "--view", "left",
                    "--background", "0,0,1"})
                  .messages,
              "");
}

TEST_F(ViewCommand, OpensWithTheStereoAndTheSlabOfItsOptions) {
    const ProgramRun ran = view({"--state", "-", "--stereo", "side_by_side", "--eye-separation",
                                 "60", "--convergence", "300", "--swap-eyes", "--mirror", "--slice",
                                 "axial", "--slab", "4", "--slab-mode", "minimum"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_EQ(ran.messages, "");
    const auto state = nlohmann::json::parse(ran.output);
    EXPECT_EQ(state["stereo"]["layout"], "side_by_side");
    EXPECT_EQ(state["stereo"]["on"], true);
    EXPECT_EQ(state["stereo"]["swap_eyes"], true);
    EXPECT_EQ(state["stereo"]["mirror"], true);
    double distance_mm2 = 0.0; // of the camera, of which the separation is a share
    for (int i = 0; i < 3; ++i)
        distance_mm2 += std::pow(state["camera"]["eye_mm"][i].get<double>() -
                                     state["camera"]["target_mm"][i].get<double>(),
                                 2.0);
    EXPECT_NEAR(state["stereo"]["separation"].get<double>() * std::sqrt(distance_mm2), 60.0, 1e-6);
    EXPECT_EQ(state["slab"]["mm"], 4.0);
    EXPECT_EQ(state["slab"]["mode"], "minimum");
}

} // namespace
} // namespace palpate
