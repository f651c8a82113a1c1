// All commands share this: help that can be read, a version, and no file for two options.

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <cstring>

#include "tests/support/program.h"

namespace palpate {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kCommands{"compare", "devices", "doctor", "info",    "edit",
                                         "convert", "bench",   "render", "surface", "touch"};

using EveryCommand = ProgramTest;

// EveryCommand takes over 5 s of a processor: the program is started for each command and each pair
// of its options that name files.
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

TEST_F(EveryCommand, NamesTheVolumeInAFolderThatIsNoSeries) {
    std::filesystem::create_directories(file("study"));
    for (const char* name : {"study/b.nii", "study/a.nii.gz"})
        ASSERT_EQ(run({"convert", "synthetic:ball?size=8", file(name).string()}).exit_code, 0);
    write("study/notes.txt", "a\n");
    const ProgramRun ran = run({"info", file("study").string()});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("expected a folder of DICOM files"));
    EXPECT_THAT(ran.messages, HasSubstr("to read the volume in it, name its file: " +
                                        file("study/a.nii.gz").string()));
}

// A limit on the size of files stands for a full disk: of several outputs one does not fit, and
// none is there, or is another than before.
TEST_F(EveryCommand, WritesAllItsFilesOrNone) {
    const std::string v = "synthetic:phantom?size=32"; // no reader's process, which has files too
    write("cut.jsonl",
          R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 20}, )"
          R"("operation": {"kind": "cut"}})"
          "\n{\"p_mm\": [0, 0, 0]}\n");
    const auto path = [&](const char* name) { return file(name).string(); };
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"render", v, "--mode", "mip", "--size", "256,256",
                                   "--write-scene", path("small"), "-o", path("large.png")},
          {"surface", v, "--iso", "0", "--report", path("small"), "-o", path("large.ply")},
          {"edit", v, path("cut.jsonl"), "--report", path("small"), "-o", path("large.nrrd")},
          {"render", v, "--mode", "mip", "--size", "128,128", "--stereo", "separate",
           "--write-scene", path("small"), "-o", path("large.exr")}}) {
        SCOPED_TRACE(command.front());
        write("small", "as it was");
        const rlimit little{6000, old.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &little);
        const ProgramRun ran = run(command);
        ::setrlimit(RLIMIT_FSIZE, &old);
        EXPECT_EQ(ran.exit_code, 1);
        EXPECT_THAT(ran.messages, HasSubstr("large"));
        EXPECT_EQ(bytes_of("small"), "as it was");
        for (const auto& entry : std::filesystem::directory_iterator(file(""))) {
            const std::string name = entry.path().filename();
            EXPECT_TRUE(name.find("large") == name.npos || name == "large.nrrd.journal") << name;
        }
        std::filesystem::remove(file("large.nrrd.journal")); // of the edit, which goes on from it
    }
}

// A size that a person asks for is held against the memory there is before anything is allocated:
// what would take terabytes is refused in a moment, and so is what --max-memory does not allow.
TEST_F(EveryCommand, RefusesASizeBeforeItIsAllocated) {
    ASSERT_EQ(run({"convert", "synthetic:ball?size=24", file("v.nrrd").string()}).exit_code, 0);
    const std::string v = file("v.nrrd").string(), out = file("o.nrrd").string();
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"convert", v, out, "--spacing", "0.01"},
          {"filter", v, "--resample", "0.01,cubic", "-o", out},
          {"filter", v, "--resample", "0.01,nearest", "-o", out},
          {"filter", v, "--pad", "4096,4096,4096", "-o", out, "--max-memory", "100000"},
          {"convert", "synthetic:ball?size=4096", out, "--max-memory", "1000"},
          {"convert", v, out, "--spacing", "1", "--max-memory", "2"},
          {"filter", v, "--resample", "1,linear", "-o", out, "--max-memory", "2"},
          {"filter", v, "--pad", "64,64,64", "-o", out, "--max-memory", "1"},
          {"info", "synthetic:ball?size=512", "--max-memory", "100"},
          {"render", v, "--size", "2000,2000", "-o", file("p.png").string(), "--max-memory", "100"},
          {"render", v, "--size", "1400,1400", "--stereo", "side_by_side", "-o",
           file("p.png").string(), "--max-memory", "300"},
          {"render", v, "--size", "2000,2000", "--turntable", "4", "-o", file("p_#.png").string(),
           "--max-memory", "100"}}) {
        const ProgramRun ran = run(command);
        EXPECT_EQ(ran.exit_code, 1) << testing::PrintToString(command);
        EXPECT_THAT(ran.messages, testing::AllOf(HasSubstr(" of memory, and the limit is "),
                                                 testing::AnyOf(HasSubstr("(--max-memory)"),
                                                                HasSubstr("of this machine's"))))
            << testing::PrintToString(command);
    }
    EXPECT_EQ(run({"convert", v, out, "--spacing", "4", "--max-memory", "2"}).exit_code, 0);
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
    std::filesystem::create_symlink(file("one.json"), file("symbolic.json"));
    const std::string symbolic = file("symbolic.json").string();
    const std::string layout = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n";
    write("one.raw", "");
    write("one.nhdr", layout + "data file: one.raw\n");
    write("apart.nhdr", layout + "data file: voxels.raw\n");
    write("apart.mhd",
          "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n"
          "ElementDataFile = voxels.raw\n");
    write("voxels.raw", "12345678");
    const std::string raw = file("one.raw").string(), header = file("one.nhdr").string();
    write("ct_1.png", "");
    write("out/2.dcm", "");
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
        {{"edit", one, other, "-o", one}, "V and -o"},
        {{"edit", one, other, "-o", alias}, "V and -o"},
        {{"edit", one, other, "-o", linked}, "V and -o"},
        {{"edit", symbolic, other, "-o", one}, "V and -o"},
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
        {{"touch", volume, "--path", other, "--tool", other, "--edit", one, "--record", one},
         "--record and --edit"},
        {{"touch", volume, "--path", other, "--field", one, other, other, "--report", one},
         "--report and --field"},
        {{"touch", volume, "--path", other, "--page", one, "--profile", one},
         "--page and --profile"},
        {{"touch", scene, "--path", other, "-o", one}, "-o and the volume of SCENE"},
        // The voxels of a header lie where it says; slices of a pattern are each read.
        {{"edit", file("apart.nhdr").string(), other, "-o", file("voxels.mhd").string()},
         "the voxels of V and the voxels of -o"},
        {{"convert", file("apart.mhd").string(), file("voxels.mhd").string()},
         "the voxels of V and the voxels of OUT"},
        {{"render", file("ct_*.png").string(), "-o", file("ct_1.png").string()}, "SCENE and -o"},
        {{"surface", file("ct_%d.png").string(), "--iso", "1", "-o", mesh, "--report",
          file("ct_1.png").string()},
         "V and --report"},
        // These files are written beside the one that an option names.
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
    EXPECT_EQ(bytes_of("voxels.raw"), "12345678");
    // A file of a folder that is read, beside a new one in it.
    const ProgramRun inside =
        run({"info", file("out").string(), "--profile", file("out/2.dcm").string()});
    EXPECT_EQ(inside.exit_code, 1);
    EXPECT_THAT(inside.messages, HasSubstr("V and --profile: expected a new file or one outside"));
    EXPECT_EQ(bytes_of("out/2.dcm"), "");
    // Reading twice is no harm.
    EXPECT_THAT(run({"compare", one, one}).messages, testing::Not(HasSubstr("a file for each")));
}

TEST_F(EveryCommand, WritesReportsToStandardOutput) {
    write("labels.jsonl",
          R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 3},)"
          R"( "operation": {"kind": "cut", "to_value": 0}})"
          "\n{\"p_mm\": [0, 0, 0]}\n");
    const std::string volume = "synthetic:ball?size=16", picture = file("p.png").string();
    struct Case {
        std::vector<std::string> arguments;
        const char* begins;
    };
    for (const Case& c : {
             Case{{"edit", volume, file("labels.jsonl").string(), "-o", file("o.nrrd").string(),
                   "--report", "-"},
                  "{\n  \"steps\""},
             Case{
                 {"surface", volume, "--iso", "500", "-o", file("m.ply").string(), "--report", "-"},
                 "{\n  \"triangles\""},
             Case{{"touch", volume, "--trajectory", "press", "--duration", "0.01", "--report", "-"},
                  "time_s,"},
             Case{{"render", volume, "--size", "16,16", "-o", picture, "--stats", "-"},
                  "{\n  \"device\""},
             Case{{"render", volume, "--size", "16,16", "-o", picture, "--write-scene", "-"},
                  "{\n"},
         }) {
        const ProgramRun ran = run(c.arguments);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_EQ(ran.output.substr(0, std::strlen(c.begins)), c.begins);
        EXPECT_FALSE(std::filesystem::exists("-"));
    }
    const ProgramRun both = run(
        {"render", volume, "--size", "16,16", "-o", picture, "--stats", "-", "--write-scene", "-"});
    EXPECT_EQ(both.exit_code, 1);
    EXPECT_THAT(both.messages, HasSubstr("--stats and --write-scene: expected one of them"));
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"convert", volume, "-"},
          {"info", volume, "--profile", "-"},
          {"touch", volume, "--trajectory", "press", "--page", "-"}}) {
        const ProgramRun named = run(arguments);
        EXPECT_EQ(named.exit_code, 1);
        EXPECT_THAT(named.messages, HasSubstr("expected the name of a file, found '-'"));
        EXPECT_FALSE(std::filesystem::exists("-"));
    }
}

TEST_F(EveryCommand, SaysWhatIsExpectedInPlaceOfAWordItDoesNotKnow) {
    ProgramRun wrong = run({"stats", "x"});
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_THAT(
        wrong.messages,
        HasSubstr("expected a command, one of batch, compare, devices, doctor, info, edit, filter, "
                  "convert, "
                  "bench, measure, project, render, seeds, segment, surface, touch, view, found "
                  "'stats'"));
    wrong = run({});
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_THAT(wrong.messages, HasSubstr("found none"));
    const std::string volume = "synthetic:ball?size=8";
    struct Case {
        std::vector<std::string> arguments;
        const char* words;
    };
    for (const Case& c : {
             Case{{"touch", volume, "--trajectory", "press", "--algorithm", "magic"},
                  "--algorithm: expected one of none, "},
             Case{{"touch", volume, "--trajectory", "hop"},
                  "--trajectory: expected one of press, touch"},
             Case{{"touch", volume, "--trajectory", "press", "--device", "toaster"},
                  "--device: expected a device, one of falcon, touch, omega"},
             Case{{"render", volume, "-o", "p.png", "--view", "inside"},
                  "--view: expected one of oblique, front"},
             Case{{"render", volume, "-o", "p.png", "--stereo", "3d"}, "--stereo: expected one of"},
             Case{{"edit", volume, "-o", "o.nrrd"}, "expected STROKES, or --recover"},
         }) {
        wrong = run(c.arguments);
        EXPECT_EQ(wrong.exit_code, 2) << c.words;
        EXPECT_THAT(wrong.messages, HasSubstr(c.words));
    }
}

TEST_F(EveryCommand, SaysWhatMeshesAreForWhereVolumesAreExpected) {
    write("m.ply", "ply\n");
    const std::string mesh = file("m.ply").string(), out = file("o.nrrd").string();
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"render", mesh, "-o", file("p.png").string()},
          {"render", "synthetic:ball", "--labels", mesh, "-o", file("p.png").string()},
          {"info", mesh},
          {"convert", mesh, out},
          {"touch", mesh, "--trajectory", "press"},
          {"surface", mesh, "--iso", "1", "-o", file("n.ply").string()}}) {
        const ProgramRun refused = run(arguments);
        EXPECT_EQ(refused.exit_code, 1);
        EXPECT_THAT(refused.messages, HasSubstr("found the name of a mesh; to draw it: palpate "
                                                "render VOLUME --surface " +
                                                mesh));
    }
    const ProgramRun kinds = run({"compare", file("p.png").string(), mesh});
    EXPECT_EQ(kinds.exit_code, 1);
    EXPECT_THAT(kinds.messages, HasSubstr("found a picture (" + file("p.png").string() +
                                          ") and a mesh (" + mesh + ")"));
}

} // namespace
} // namespace palpate
