// palpate render for figures: marks, backgrounds, turntables.

#include <gmock/gmock.h>

#include <algorithm>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "engine/image/exr.h"
#include "engine/image/png.h"
#include "tests/support/kill.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

// FigureCommand takes over 5 s of a processor: the program is started for each option, and each
// time a CPU driver compiles its shaders.
class FigureCommand : public ProgramTest {
 protected:
    ProgramRun render(const std::string& output, std::vector<std::string> more,
                      const std::string& size = "96,80") const {
        more.insert(more.begin(), {"render", "synthetic:phantom?size=32", "--size", size, "-o",
                                   file(output).string()});
        return run(more);
    }
    Image png(const std::string& name) const {
        const Result<Image> image = load_png(file(name));
        EXPECT_TRUE(image) << image.error().message;
        return *image;
    }
    size_t files_like(const std::string& start) const {
        size_t count = 0;
        for (const auto& entry : fs::directory_iterator(file("")))
            count += entry.path().filename().string().starts_with(start);
        return count;
    }
};

// A transparent picture over a colour is the picture with that background: rays, surfaces and
// slices alike. An EXR has colours associated with alpha, a PNG straight ones.
TEST_F(FigureCommand, ATransparentPictureIsThatOfAnyBackgroundTakenAway) {
    const std::vector<std::vector<std::string>> scenes{
        {"--mode", "alpha"},
        {"--iso", "300"},
        {"--slice", "axial"},
        {"--surface", "iso=300", "--surface-opacity", "0.5"}};
    const double background[] = {1.0, 0.6, 0.2};
    for (const std::vector<std::string>& scene : scenes) {
        const auto draw = [&](const std::string& output, const char* color) {
            std::vector<std::string> all = scene;
            all.insert(all.end(), {"--background", color});
            const ProgramRun ran = render(output, all);
            ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        };
        draw("clear.exr", "transparent");
        draw("clear.png", "transparent");
        draw("filled.exr", "1,0.6,0.2");
        const Image clear = load_exr(file("clear.exr"))->image;
        const Image filled = load_exr(file("filled.exr"))->image;
        const Image straight = png("clear.png");
        ASSERT_EQ(straight.channels.size(), 4u);
        size_t see_through = 0;
        for (uint32_t y = 0; y < clear.size_px.y; ++y)
            for (uint32_t x = 0; x < clear.size_px.x; ++x) {
                const auto of = [&](const Image& image, const char* name) {
                    return double(image.at(x, y, *channel_index(image, name)));
                };
                const double a = of(clear, "A");
                see_through += a < 1.0;
                const char* names[] = {"R", "G", "B"};
                for (int c = 0; c < 3; ++c) {
                    // Floats of a few additions each.
                    ASSERT_NEAR(of(clear, names[c]) + (1.0 - a) * background[c],
                                of(filled, names[c]), 1e-5);
                    // Two values of 8 bits, each rounded by half a step.
                    ASSERT_NEAR(of(straight, names[c]) * of(straight, "A"), of(clear, names[c]),
                                1.01 / 255.0);
                }
                ASSERT_NEAR(of(straight, "A"), a, 0.51 / 255.0);
            }
        EXPECT_GT(see_through, 100u);
    }
    ASSERT_EQ(render("white.png", {"--background", "white"}).exit_code, 0);
    EXPECT_EQ(png("white.png").channels.size(), 3u);
    EXPECT_EQ(png("white.png").at(0, 0, 1), 1.0f);
    EXPECT_EQ(render("x.png", {"--background", "grey"}).exit_code, 2);
    EXPECT_THAT(render("x.png", {"--background", "1,1"}).messages,
                HasSubstr("expected black, white, transparent or a colour r,g,b, 0 .. 1, found "
                          "'1,1'"));
}

// A scene says it as the option does; the option replaces what the scene says.
TEST_F(FigureCommand, ASceneMayHaveATransparentBackground) {
    write("clear.json", R"({"volume": "synthetic:phantom?size=32", "size_px": [96, 80],
        "background": "transparent", "ray_cast": {"mode": "mip", "transfer": "ct-bone"}})");
    const auto draw = [&](const std::string& output, std::vector<std::string> more) {
        more.insert(more.begin(),
                    {"render", file("clear.json").string(), "-o", file(output).string()});
        const ProgramRun ran = run(more);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return png(output);
    };
    const Image by_scene = draw("scene.png", {});
    EXPECT_EQ(by_scene.channels.size(), 4u);
    EXPECT_EQ(by_scene.samples, draw("option.png", {"--background", "transparent"}).samples);
    EXPECT_EQ(draw("white.png", {"--background", "white"}).channels.size(), 3u);
    write("grey.json", R"({"volume": "synthetic:ball", "background": "grey"})");
    EXPECT_THAT(run({"render", file("grey.json").string(), "-o", "x.png"}).messages,
                HasSubstr("background: expected a colour [r, g, b] or \"transparent\", found"));
}

TEST_F(FigureCommand, MarksAreDrawnAsAskedAndNowhereElse) {
    const std::vector<std::string> slice{"--slice", "axial", "--window=-200,300"};
    const auto with = [&](const std::string& output, const char* marks,
                          const char* more = "white") {
        std::vector<std::string> all = slice;
        all.insert(all.end(), {"--annotate", marks, "--background", more});
        const ProgramRun ran = render(output, all, "300,240");
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_EQ(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 1) << ran.messages;
        return png(output);
    };
    std::vector<std::string> plain_options = slice;
    plain_options.insert(plain_options.end(), {"--background", "white"});
    ASSERT_EQ(render("plain.png", plain_options, "300,240").exit_code, 0);
    const Image plain = png("plain.png");
    // The places of the differences: letters at the edges' middles, the bar at the lower right, the
    // colour bar at the upper right, the note at the upper left.
    const auto differs = [&](const Image& image, uint32_t x0, uint32_t y0, uint32_t x1,
                             uint32_t y1) {
        size_t count = 0;
        for (uint32_t y = y0; y < y1; ++y)
            for (uint32_t x = x0; x < x1; ++x)
                count += image.at(x, y, 0) != plain.at(x, y, 0) ||
                         image.at(x, y, 2) != plain.at(x, y, 2);
        return count;
    };
    const Image letters = with("letters.png", "letters");
    EXPECT_GT(differs(letters, 0, 110, 30, 130), 10u);
    EXPECT_GT(differs(letters, 270, 110, 300, 130), 10u);
    EXPECT_EQ(differs(letters, 0, 0, 100, 100), 0u);
    EXPECT_EQ(differs(letters, 200, 140, 300, 240), 0u);
    const Image bar = with("bar.png", "scale-bar");
    EXPECT_GT(differs(bar, 200, 200, 300, 240), 30u);
    EXPECT_EQ(differs(bar, 0, 0, 300, 200), 0u);
    const Image colors = with("colors.png", "color-bar");
    EXPECT_GT(differs(colors, 200, 0, 300, 110), 300u);
    EXPECT_EQ(differs(colors, 0, 0, 200, 240), 0u);
    const Image note = with("note.png", "note");
    EXPECT_GT(differs(note, 0, 0, 200, 60), 100u);
    EXPECT_EQ(differs(note, 0, 60, 300, 240), 0u);
    const Image all = with("all.png", "all"),
                listed = with("list.png", "letters,scale-bar,color-bar,note");
    EXPECT_EQ(all.samples, listed.samples);

    EXPECT_THAT(render("iso.png", {"--iso", "300", "--annotate", "color-bar"}).messages,
                HasSubstr("--annotate color-bar: without effect"));
    EXPECT_THAT(render("t.png", {"--text-size", "20"}).messages, HasSubstr("--text-size (without"));
    EXPECT_EQ(render("t.png", {"--annotate", "arrows"}).exit_code, 2);
}

TEST_F(FigureCommand, ATurntableWritesEveryFrameOfATurn) {
    const ProgramRun ran = render("turn_###.png", {"--turntable", "4", "--view", "front"}, "48,40");
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_EQ(files_like("turn_"), 4u);
    // Frame 1 is a quarter turn on: the picture of that camera.
    for (const auto& [frame, view] :
         {std::pair("turn_000.png", "front"), {"turn_002.png", "back"}}) {
        ASSERT_EQ(render("one.png", {"--view", view}, "48,40").exit_code, 0);
        const Image a = png(frame), b = png("one.png");
        double most = 0.0;
        for (size_t i = 0; i < a.samples.size(); ++i)
            most = std::max(most, std::abs(double(a.samples[i]) - double(b.samples[i])));
        // The eye is the same to a rounding of its place.
        EXPECT_LE(most, 2.0 / 255.0) << frame;
    }
    EXPECT_NE(png("turn_001.png").samples, png("turn_003.png").samples);

    // From one camera to another; both ends are those of the scenes.
    for (const auto& [scene, view] : {std::pair("a.json", "front"), {"b.json", "left"}})
        ASSERT_EQ(render("x.png", {"--view", view, "--write-scene", file(scene).string()}, "48,40")
                      .exit_code,
                  0);
    const ProgramRun path =
        run({"--quiet", "render", file("a.json").string(), "--turntable", "3", "--camera-path",
             file("b.json").string(), "-o", file("path_#.png").string()});
    ASSERT_EQ(path.exit_code, 0) << path.messages;
    EXPECT_EQ(files_like("path_"), 3u);
    ASSERT_EQ(render("one.png", {"--view", "left"}, "48,40").exit_code, 0);
    const Image last = png("path_2.png"), left = png("one.png");
    for (size_t i = 0; i < last.samples.size(); ++i)
        ASSERT_NEAR(last.samples[i], left.samples[i], 2.01 / 255.0);

    EXPECT_THAT(render("one.png", {"--turntable", "4"}).messages, HasSubstr("a name with ####"));
    EXPECT_THAT(render("f_#.png", {"--turntable", "11"}).messages,
                HasSubstr("expected 2 digits for 11 pictures, found 1"));
    EXPECT_THAT(render("m.mp4", {}).messages, HasSubstr("a movie needs --turntable"));
    EXPECT_EQ(render("f_#.png", {"--turntable", "3", "--frames", "3"}).exit_code, 2);
}

TEST_F(FigureCommand, AnInterruptedTurntableLeavesWholeFramesAlone) {
    const std::vector<std::string> command{
        "render", "synthetic:phantom?size=48", "--size",      "480,360",
        "-o",     file("f_####.png").string(), "--turntable", "9000"};
    const std::string messages = file("said").string();
    const pid_t child = ::fork();
    if (child == 0)
        ::_exit(become_program(command,
                               ::open(messages.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0666)));
    int status = 0;
    pid_t ended = 0; // before there was a frame
    // Whole frames wait under their temporary names (FilesTogether).
    const auto first = file("." + std::to_string(child) + ".tmp.f_0000.png");
    while (!fs::exists(first) && ended == 0) {
        std::this_thread::yield();
        ended = ::waitpid(child, &status, WNOHANG);
    }
    ASSERT_EQ(ended, 0);
    ::kill(child, SIGINT);
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 1);
    size_t frames = 0;
    for (const auto& entry : fs::directory_iterator(file(""))) {
        const std::string name = entry.path().filename().string();
        if (name == "said")
            continue;
        ASSERT_TRUE(name.starts_with("f_")) << name;
        EXPECT_EQ(png(name).size_px, glm::uvec2(480, 360));
        ++frames;
    }
    EXPECT_LT(frames, 9000u);
    EXPECT_THAT(bytes_of("said"),
                HasSubstr(std::to_string(frames) + " of 9000 pictures are written, each whole"));
}

// ffmpeg takes the frames, numbered from 0, in a folder that is gone afterwards.
TEST_F(FigureCommand, AMovieIsMadeByFfmpegWhereThereIsOne) {
    fs::create_directory(file("bin"));
    const std::string before = std::getenv("PATH");
    ::setenv("PATH", file("bin").c_str(), 1);
    ProgramRun ran = render("m.mp4", {"--turntable", "3"});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, AllOf(HasSubstr("expected the program ffmpeg on PATH"),
                                    HasSubstr("a name with ####")));
    // One that lists its input in its output, the last of its words.
    write(
        "bin/ffmpeg",
        "#!/bin/sh\nPATH=/usr/bin:/bin\nfor last; do :; done\n{ echo \"$@\"; ls; } > \"$last\"\n");
    fs::permissions(file("bin/ffmpeg"), fs::perms::owner_all);
    ran = render("m.mp4", {"--turntable", "3", "--fps", "12.5"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(bytes_of("m.mp4"), AllOf(HasSubstr("-framerate 12.5"), HasSubstr("-i %06d.png"),
                                         HasSubstr("\n000000.png\n000001.png\n000002.png\n")));
    fs::remove(file("m.mp4"));
    write("bin/ffmpeg", "#!/bin/sh\nexit 3\n");
    fs::permissions(file("bin/ffmpeg"), fs::perms::owner_all);
    ran = render("m.mp4", {"--turntable", "3"});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("ffmpeg failed with status 3"));
    ::setenv("PATH", before.c_str(), 1);
    for (const auto& entry : fs::recursive_directory_iterator(file("")))
        EXPECT_TRUE(entry.path().filename() == "bin" || entry.path().filename() == "ffmpeg" ||
                    entry.path().filename() == "stdout" || entry.path().filename() == "stderr")
            << entry.path();
}

} // namespace
} // namespace palpate
