// What every command has in common: help that can be read, a version, and no file for two options.

#include <gmock/gmock.h>

#include <cctype>

#include "tests/support/program.h"

namespace palpate {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kCommands{"compare", "doctor", "info",    "edit", "convert",
                                         "bench",   "render", "surface", "touch"};

using EveryCommand = ProgramTest;

TEST_F(EveryCommand, HelpIsPrintableText) {
    std::string whole = run({"--help"}).output;
    for (const std::string& command : kCommands) {
        EXPECT_THAT(whole, HasSubstr("  " + command)); // none is missing in this list
        const ProgramRun help = run({command, "--help"});
        EXPECT_EQ(help.exit_code, 0);
        EXPECT_GT(help.output.size(), 50u);
        for (size_t i = 0; i < help.output.size(); ++i) {
            const auto c = static_cast<unsigned char>(help.output[i]);
            ASSERT_TRUE(c == '\n' || (c < 128 && std::isprint(c)))
                << command << ": byte " << int(c) << " behind \""
                << help.output.substr(i < 40 ? 0 : i - 40, std::min<size_t>(i, 40)) << "\"";
        }
    }
    const std::string surface = run({"surface", "--help"}).output;
    EXPECT_THAT(surface, HasSubstr("{classic,correct}"));
    EXPECT_THAT(surface, HasSubstr("{gradient,none,triangles}"));
    const ProgramRun wrong = run({"surface", "synthetic:ball", "--iso", "1", "-o",
                                  file("a.ply").string(), "--normals", "1"});
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_THAT(wrong.messages, HasSubstr("expected one of gradient,none,triangles, found '1'"));
}

TEST_F(EveryCommand, TellsItsVersion) {
    const ProgramRun told = run({"--version"});
    EXPECT_EQ(told.exit_code, 0) << told.messages;
    EXPECT_THAT(told.output, testing::MatchesRegex("palpate [0-9]+\\.[0-9]+\\.[0-9]+"
                                                   "( \\([0-9a-f]+(-dirty)?\\))?\n"));
    EXPECT_EQ(told.messages, "");
}

TEST_F(EveryCommand, WritesNoFileThatAnotherOptionNames) {
    const std::string one = file("one.json").string(); // of an extension that suits many
    const std::string other = file("other").string(), mesh = file("mesh.ply").string();
    const std::string alias = file("./one.json").string();
    std::filesystem::create_hard_link((write("one.json", "{}"), file("one.json")),
                                      file("linked.json"));
    std::filesystem::create_directory(file("out"));
    const std::string linked = file("linked.json").string();
    const std::string volume = "synthetic:ball?size=8";
    write("scene.json", R"({"volume": "one.json", "surfaces": [{"mesh": "mesh.ply"}]})");
    const std::string scene = file("scene.json").string();
    write("stereo.json", R"({"volume": "one.json", "stereo": {"layout": "separate"}})");
    const std::string stereo = file("stereo.json").string();
    write("detached.json", R"({"volume": "one.nhdr"})");
    const std::string detached = file("detached.json").string();
    write("one.raw", "");
    write("one.nhdr", "");
    const std::string raw = file("one.raw").string(), header = file("one.nhdr").string();
    struct Case {
        std::vector<std::string> arguments;
        const char* options;
    };
    const std::vector<Case> cases{
        {{"compare", one, other, "--profile", one}, "A and --profile"},
        {{"compare", other, one, "--profile", one}, "B and --profile"},
        {{"info", one, "--profile", alias}, "V and --profile"},
        {{"info", one, "--profile", linked}, "V and --profile"},
        {{"convert", one, one}, "V and OUT"},
        {{"convert", volume, one, "--profile", one}, "OUT and --profile"},
        {{"edit", volume, one, "-o", one}, "STROKES and -o"},
        {{"edit", volume, other, "--guide", one, "-o", one}, "--guide and -o"},
        {{"edit", one, other, "-o", other + ".nii", "--report", one}, "V and --report"},
        {{"edit", volume, other, "-o", one, "--report", one}, "-o and --report"},
        {{"edit", one, other, "-o", one, "--report", one}, "-o and --report"},
        {{"edit", volume, other, "-o", one, "--report", one + ".journal"},
         "the journal of -o and --report"},
        {{"edit", volume, one, "-o", other, "--profile", one}, "STROKES and --profile"},
        {{"bench", "upload", "--ct", one, "--profile", one, "-o", file("out").string()},
         "--ct and --profile"},
        {{"bench", "upload", "--labels", one, "--profile", one, "-o", file("out").string()},
         "--labels and --profile"},
        {{"bench", "upload", "--profile", file("out/upload.json").string(), "-o",
          file("out").string()},
         "the result in --out and --profile"},
        {{"bench", "upload", "--profile", file("out/index.html").string(), "-o",
          file("out").string()},
         "the page in --out and --profile"},
        {{"render", volume, "-o", other + ".png", "--surface", mesh, "--stats", mesh},
         "--stats and --surface"},
        {{"render", volume, "-o", other + ".png", "--surface", mesh, "--profile", mesh},
         "--surface and --profile"},
        {{"render", volume, "-o", other + ".png", "--labels", one, "--write-scene", one},
         "--labels and --write-scene"},
        {{"render", volume, "-o", other + ".png", "--tf", one, "--stats", one}, "--tf and --stats"},
        {{"render", volume, "-o", other + ".png", "--stats", one, "--profile", one},
         "--stats and --profile"},
        {{"render", scene, "-o", other + ".png", "--stats", one},
         "--stats and the volume of SCENE"},
        {{"render", scene, "-o", other + ".png", "--stats", mesh},
         "--stats and a surface of SCENE"},
        {{"render", scene, "-o", other + ".png", "--write-scene", scene},
         "SCENE and --write-scene"},
        {{"surface", one, "--iso", "1", "-o", mesh, "--report", one}, "V and --report"},
        {{"surface", volume, "--iso", "1", "-o", mesh, "--profile", mesh}, "-o and --profile"},
        {{"touch", volume, "--path", one, "--report", one}, "--path and --report"},
        {{"touch", volume, "--labels", one, "--path", other, "-o", one}, "--labels and -o"},
        {{"touch", volume, "--path", other, "--mesh", mesh, "--page", mesh}, "--page and --mesh"},
        {{"touch", volume, "--path", other, "--edit", one, "--record", one}, "--record and --edit"},
        {{"touch", volume, "--path", other, "--field", one, other, other, "--report", one},
         "--report and --field"},
        {{"touch", volume, "--path", other, "--page", one, "--profile", one},
         "--page and --profile"},
        {{"touch", scene, "--path", other, "-o", one}, "-o and the volume of SCENE"},
        // What is written beside what an option names.
        {{"convert", header, file("one.mhd").string()}, "the voxels of V and the voxels of OUT"},
        {{"convert", volume, file("one.mhd").string(), "--profile", raw},
         "the voxels of OUT and --profile"},
        {{"edit", volume, other, "-o", file("one.mhd").string(), "--report", raw},
         "the voxels of -o and --report"},
        {{"render", detached, "-o", other + ".png", "--stats", raw},
         "--stats and the voxels of the volume of SCENE"},
        {{"render", volume, "--stereo", "separate", "-o", file("p.png").string(), "--preview",
          file("p.png").string()},
         "-o and --preview"},
        {{"render", volume, "--stereo", "separate", "-o", file("p.png").string(), "--stats",
          file("p_right.png").string()},
         "-o and --stats"},
        {{"render", stereo, "-o", file("p.png").string(), "--profile", file("p_left.png").string()},
         "-o and --profile"},
    };
    for (const Case& c : cases) {
        const ProgramRun ran = run(c.arguments);
        EXPECT_EQ(ran.exit_code, 1) << c.options << ran.messages;
        EXPECT_THAT(ran.messages, HasSubstr(std::string(c.options) + ": expected a file for each"));
        EXPECT_EQ(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 1) << ran.messages;
        EXPECT_EQ(ran.output, "");
        EXPECT_EQ(bytes_of("one.json"), "{}");
    }
    // Reading twice is no harm.
    EXPECT_THAT(run({"compare", one, one}).messages, testing::Not(HasSubstr("a file for each")));
}

} // namespace
} // namespace palpate
