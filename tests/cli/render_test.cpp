// palpate render, as a person runs it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>

#include "engine/image/exr.h"
#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// RenderCommand takes over 5 s of a processor: the program is started for each option, and each
// time a CPU driver compiles its shaders.
class RenderCommand : public ProgramTest {
 protected:
    std::vector<std::string> command(const std::vector<std::string>& more) const {
        std::vector<std::string> all{"render", "synthetic:phantom?size=40", "--size", "64,48",
                                     "-o",     file("picture.exr").string()};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    bool exists(const std::string& name) const { return std::filesystem::exists(file(name)); }
};

TEST_F(RenderCommand, GivesTheSameBytesTwiceAndOnOneThread) {
    for (const std::vector<std::string>& scene : {std::vector<std::string>{"--mode", "alpha"},
                                                  {"--mode", "mip", "--values"},
                                                  {"--iso=-300,300", "--stereo", "side_by_side"},
                                                  {"--slice", "axial"}}) {
        std::vector<std::string> bytes;
        for (const char* threads : {"2", "2", "1"}) {
            ::setenv("LP_NUM_THREADS", threads, 1);
            const ProgramRun ran = run(command(scene));
            ASSERT_EQ(ran.exit_code, 0) << ran.messages;
            bytes.push_back(bytes_of("picture.exr"));
        }
        ::unsetenv("LP_NUM_THREADS");
        EXPECT_FALSE(bytes[0].empty());
        EXPECT_TRUE(bytes[0] == bytes[1]) << "two runs differ: " << scene[0];
        EXPECT_TRUE(bytes[0] == bytes[2]) << "one thread differs: " << scene[0];
    }
}

TEST_F(RenderCommand, DrawsSurfacesBesideRaysAndWritesThemIntoTheScene) {
    const std::vector<std::string> surfaces{"--surface",
                                            "iso=-300",
                                            "--surface",
                                            "iso=300",
                                            "--surface-opacity",
                                            "0.4,1",
                                            "--surface-color",
                                            "0.9,0.6,0.5",
                                            "--clip",
                                            "0,0,0,0,1,0",
                                            "--stats",
                                            "-",
                                            "--write-scene",
                                            file("scene.json").string()};
    const ProgramRun ran = run(command(surfaces));
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const auto stats = nlohmann::json::parse(ran.output);
    ASSERT_EQ(stats["surfaces"].size(), 2u);
    EXPECT_GT(stats["surfaces"][1]["triangles"], 1000);
    EXPECT_EQ(stats["exact_see_through_layers"], 8);
    EXPECT_FALSE(stats.contains("samples")) << "surfaces alone are not marched";
    for (const auto& resource : stats["resources"])
        EXPECT_NE(resource["name"], "volume");
    const std::string first = bytes_of("picture.exr");
    const ProgramRun again =
        run({"render", file("scene.json").string(), "-o", file("picture.exr").string()});
    ASSERT_EQ(again.exit_code, 0) << again.messages;
    EXPECT_TRUE(bytes_of("picture.exr") == first) << "the scene that was written draws the same";

    for (const auto& [wrong, sentence] :
         {std::pair<std::vector<std::string>, const char*>{{"--surface", "labels"}, "label map"},
          {{"--surface", "nowhere.ply"}, "nowhere.ply"},
          {{"--surface-opacity", "0.5"}, "at most one for each --surface"}}) {
        const ProgramRun refused = run(command(wrong));
        EXPECT_EQ(refused.exit_code, 1);
        EXPECT_THAT(refused.messages, HasSubstr(sentence));
    }
}

TEST_F(RenderCommand, DrawsMeshesOfEveryFormatAlike) {
    const std::string volume = "synthetic:ball?size=24";
    for (const std::string extension : {"ply", "stl", "obj", "vtp"}) {
        const std::string mesh = file("m." + extension).string();
        const ProgramRun made =
            run({"surface", volume, "--iso", "500", "--normals", "none", "-o", mesh});
        ASSERT_EQ(made.exit_code, 0) << made.messages;
        const ProgramRun drawn = run({"render", volume, "--surface", mesh, "--view", "front",
                                      "--size", "40,40", "-o", file(extension + ".exr").string()});
        ASSERT_EQ(drawn.exit_code, 0) << drawn.messages;
        EXPECT_EQ(drawn.messages.find("one colour"), std::string::npos) << drawn.messages;
        const ProgramRun same =
            run({"compare", file("ply.exr").string(), file(extension + ".exr").string()});
        EXPECT_EQ(same.exit_code, 0) << same.messages;
        EXPECT_EQ(nlohmann::json::parse(same.output)["rmse"], 0.0) << extension;
    }
}

TEST_F(RenderCommand, GivesTheSameBytesFromABrickAtlasAndOnceAMovingPictureHasSettled) {
    const std::vector<std::string> by_hand{"--sampling", "fp32", "--stats", "-"};
    std::vector<std::string> bytes;
    for (const std::vector<std::string>& how :
         {std::vector<std::string>{"--residency", "dense"},
          {"--residency", "atlas"},
          {"--residency", "dense", "--frame-ms", "0.01", "--settle"},
          {"--residency", "atlas", "--frame-ms", "0.01", "--settle"}}) {
        std::vector<std::string> all = by_hand;
        all.insert(all.end(), how.begin(), how.end());
        const ProgramRun ran = run(command(all));
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        const auto stats = nlohmann::json::parse(ran.output);
        EXPECT_EQ(stats["residency"]["kind"], how[1]);
        EXPECT_EQ(stats.contains("interactive"), how.size() > 2);
        bytes.push_back(bytes_of("picture.exr"));
        EXPECT_TRUE(bytes.back() == bytes[0]) << how[1] << how.size();
    }
}

TEST_F(RenderCommand, RefusesAPreviewOfWhatHasNone) {
    const ProgramRun ran = run(command({"--preview", file("preview.png").string()}));
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("--preview: expected a brick file"));
    EXPECT_FALSE(exists("picture.exr"));
    EXPECT_FALSE(exists("preview.png"));
}

TEST_F(RenderCommand, StatsHaveTheKeysProgramsRelyOn) {
    const ProgramRun ran = run(command({"--frames", "3", "--orbit-deg", "5", "--stats", "-"}));
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const auto stats = nlohmann::json::parse(ran.output);
    for (const char* key : {"device", "driver", "first_frame_ms", "frame_ms", "passes", "resources",
                            "samples", "skipped_share", "error_estimate"})
        EXPECT_TRUE(stats.contains(key)) << key;
    for (const char* key : {"median", "p95", "gpu_median"})
        EXPECT_GT(stats["frame_ms"][key].get<double>(), 0.0) << key;
    ASSERT_EQ(stats["passes"].size(), 3u); // background, tiles, ray cast
    // 64 x 48 rays, none longer than the box's diagonal of 69 steps.
    EXPECT_GT(stats["samples"].get<uint64_t>(), 0u);
    EXPECT_LT(stats["samples"].get<uint64_t>(), 64u * 48u * 70u);
}

TEST_F(RenderCommand, WritesBothEyesApart) {
    ASSERT_EQ(run(command({"--iso", "300", "--stereo", "separate"})).exit_code, 0);
    EXPECT_TRUE(exists("picture_left.exr"));
    EXPECT_TRUE(exists("picture_right.exr"));
    EXPECT_NE(bytes_of("picture_left.exr"), bytes_of("picture_right.exr"));
}

TEST_F(RenderCommand, EachLayoutShowsThePixelsOfItsEyes) {
    const auto drawn = [&](std::vector<std::string> options, const char* name = "picture.exr") {
        options.insert(options.begin(), {"--iso", "300"});
        EXPECT_EQ(run(command(options)).exit_code, 0);
        Result<ExrFile> file = load_exr(this->file(name));
        return file ? file->image : Image{};
    };
    const Image left = drawn({"--stereo", "separate"}, "picture_left.exr");
    const Image right = load_exr(file("picture_right.exr"))->image;
    ASSERT_EQ(left.size_px, glm::uvec2(64, 48));
    using Sees = std::function<bool(glm::uvec2 pixel)>; // the right eye
    const auto expect = [&](const std::vector<std::string>& options, const Sees& sees_right,
                            bool mirrored = false) {
        const Image joint = drawn(options);
        ASSERT_EQ(joint.size_px, left.size_px) << options[1];
        int wrong = 0;
        for (uint32_t y = 0; y < 48; ++y)
            for (uint32_t x = 0; x < 64; ++x)
                for (size_t c = 0; c < 4; ++c)
                    wrong += joint.at(x, y, c) !=
                             (sees_right({x, y}) ? right : left).at(x, mirrored ? 47 - y : y, c);
        EXPECT_EQ(wrong, 0) << options[1];
    };
    expect({"--stereo", "row_interleaved"}, [](glm::uvec2 p) { return p.y % 2 == 1; });
    expect({"--stereo", "column_interleaved"}, [](glm::uvec2 p) { return p.x % 2 == 1; });
    expect({"--stereo", "checkerboard"}, [](glm::uvec2 p) { return (p.x + p.y) % 2 == 1; });
    expect({"--stereo", "left"}, [](glm::uvec2) { return false; });
    expect({"--stereo", "right"}, [](glm::uvec2) { return true; });
    expect(
        {"--stereo", "checkerboard", "--swap-eyes", "--mirror"},
        [](glm::uvec2 p) { return (p.x + p.y) % 2 == 0; }, true);
}

TEST_F(RenderCommand, TheSceneItWritesDrawsTheSamePicture) {
    ASSERT_EQ(run(command({"--mode", "alpha", "--view", "front", "--write-scene",
                           file("scene.json").string()}))
                  .exit_code,
              0);
    const std::string first = bytes_of("picture.exr");
    const ProgramRun again =
        run({"render", file("scene.json").string(), "-o", file("again.exr").string()});
    ASSERT_EQ(again.exit_code, 0) << again.messages;
    EXPECT_TRUE(first == bytes_of("again.exr"));
}

TEST_F(RenderCommand, RefusesWithOneSentenceAndWritesNothing) {
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
        {{"--tf", "no-such-preset"}, "--tf: expected a preset (ct-bone, "},
        {{"--labels", "no/such/file.nii"}, "no/such/file.nii"},
        {{"--camera", "0,0,9,0,0,0,0,0,1"}, "up vector that is not parallel to the view direction"},
        {{"--device", "no such device"}, "is not 'no such device'"},
        {{"--step", "1e-4"}, "60000 steps along"},
        {{"--stats", file("picture.exr").string()}, "-o and --stats: expected a file for each"},
        {{"--write-scene", file("./picture.exr").string()},
         "-o and --write-scene: expected a file"},
    };
    for (const auto& [arguments, words] : cases) {
        const ProgramRun ran = run(command(arguments));
        EXPECT_EQ(ran.exit_code, 1) << words;
        EXPECT_THAT(ran.messages, HasSubstr(words));
        EXPECT_EQ(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 1) << ran.messages;
        EXPECT_FALSE(exists("picture.exr"));
    }
}

TEST_F(RenderCommand, SaysWhatDrawsNothingAndWhatChangesNothing) {
    const auto said = [&](std::vector<std::string> more) {
        more.insert(more.begin(), {"render", "synthetic:ball?size=16", "--size", "16,16", "-o",
                                   file("picture.png").string()});
        const ProgramRun ran = run(more);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return ran.messages;
    };
    EXPECT_THAT(said({"--iso", "123456"}),
                HasSubstr("nothing is drawn at the iso-value 123456: expected one within"));
    EXPECT_THAT(said({"--slab", "3", "--half", "--eye-separation", "60", "--swap-eyes"}),
                HasSubstr("without effect here: --half (of .exr alone), --slab (without --slice), "
                          "--eye-separation (without --stereo), --swap-eyes (without --stereo)\n"));
    const std::string useful = said({"--iso", "500", "--slice", "axial", "--slab", "3"});
    EXPECT_THAT(useful, testing::Not(HasSubstr("nothing is drawn")));
    EXPECT_THAT(useful, testing::Not(HasSubstr("without effect")));
}

TEST_F(RenderCommand, RefusesVolumesThatAreNone) {
    for (const auto& [volume, words] : std::vector<std::pair<std::string, std::string>>{
             {"no/such/file.nrrd", "no/such/file.nrrd"},
             {"synthetic:teapot", "expected one of phantom"},
             {"synthetic:phantom?size=99999", "1 .. 4096 samples"},
             {"synthetic:phantom?colour=red", "expected the keys size, spacing and type"}}) {
        const ProgramRun ran = run({"render", volume, "-o", file("picture.png").string()});
        EXPECT_EQ(ran.exit_code, 1) << volume;
        EXPECT_THAT(ran.messages, HasSubstr(words));
        EXPECT_FALSE(exists("picture.png"));
    }
    EXPECT_THAT(run({"render", "synthetic:phantom", "-o", "picture.bmp"}).messages,
                HasSubstr("ending in .png or .exr"));
}

TEST_F(RenderCommand, WrongUsageIsTwo) {
    EXPECT_EQ(run({"render"}).exit_code, 2);
    EXPECT_EQ(run({"render", "synthetic:phantom"}).exit_code, 2);
    EXPECT_EQ(run(command({"--size", "0,0"})).exit_code, 2);
    EXPECT_EQ(run(command({"--no-such-option"})).exit_code, 2);
    for (const auto& [option, value, words] :
         std::vector<std::array<std::string, 3>>{{"--mode", "fog", "expected one of alpha,iso,mip"},
                                                 {"--view", "inside", "expected one of oblique"},
                                                 {"--volume-format", "r8", "of auto,r16,r32f"},
                                                 {"--integrator", "0", "expected one of exact"}}) {
        const ProgramRun ran = run(command({option, value}));
        EXPECT_EQ(ran.exit_code, 2);
        EXPECT_THAT(ran.messages, AllOf(HasSubstr(option + ": "), HasSubstr(words)));
    }
    EXPECT_EQ(run(command({"--window", "0,1", "--tf", "mr"})).exit_code, 2);
    EXPECT_EQ(run(command({"--window", "0,1", "--window-level", "0,1"})).exit_code, 2);
}

TEST_F(RenderCommand, NumbersAreFinite) {
    for (const auto& [option, value] :
         std::vector<std::pair<std::string, std::string>>{{"--iso", "nan"},
                                                          {"--iso", "300,inf"},
                                                          {"--background", "nan,0,0"},
                                                          {"--frame-ms", "nan"},
                                                          {"--frame-ms", "inf"},
                                                          {"--step", "nan"},
                                                          {"--step", "-1"},
                                                          {"--view-angle", "nan"},
                                                          {"--fill", "-nan"},
                                                          {"--slab", "nan"},
                                                          {"--orbit-deg", "nan"},
                                                          {"--min-transmittance", "nan"},
                                                          {"--max-memory", "nan"},
                                                          {"--convergence", "-inf"},
                                                          {"--error", "0"}}) {
        const ProgramRun ran = run(command({option + "=" + value}));
        EXPECT_EQ(ran.exit_code, 2) << option;
        EXPECT_THAT(ran.messages, AllOf(HasSubstr(option + ": expected "), HasSubstr("found '")));
        EXPECT_LT(ran.messages.size(), 200u) << ran.messages;
    }
}

TEST_F(RenderCommand, SaysWhenStandardOutputIsFull) {
    const std::string line =
        std::string(kProgram) + " doctor >/dev/full 2>" + file("stderr").string();
    EXPECT_EQ(WEXITSTATUS(std::system(line.c_str())), 1);
    EXPECT_THAT(bytes_of("stderr"), HasSubstr("standard output cannot be written"));
}

TEST_F(RenderCommand, DoctorNamesADeviceThatCanBeUsed) {
    const ProgramRun ran = run({"doctor"});
    EXPECT_EQ(ran.exit_code, 0);
    EXPECT_THAT(ran.output, HasSubstr("can be used"));
    EXPECT_THAT(ran.output, HasSubstr("chosen by default"));
}

} // namespace
} // namespace palpate
