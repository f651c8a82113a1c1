// A project's folder: created, described, changed, and read by the other commands.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "engine/io/volume_io.h"
#include "engine/volume/content_hash.h"
#include "tests/cli/touch_command.h"

namespace palpate {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// ProjectCommand takes over 5 s of a processor: the program is started for each command and option.
class ProjectCommand : public TouchCommand {
 protected:
    std::string project() const { return file("p").string(); }
    ProgramRun run_project(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), {"project", project()});
        return run(arguments);
    }
    void create() const {
        write_two_labels();
        write_nrrd("ct.nrrd", "int16", [](int, int z) { return z < 0 ? 800 : -900; });
        const ProgramRun made = run_project(
            {"--new", file("ct.nrrd").string(), "--labels", file("labels.nrrd").string()});
        ASSERT_EQ(made.exit_code, 0) << made.messages;
    }
    void write_strokes() const {
        write("cut.jsonl",
              R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 4}, )"
              R"("operation": {"kind": "cut", "to_value": -1000}})"
              "\n{\"p_mm\": [0, 0, -2]}\n"
              R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 3}, )"
              R"("operation": {"kind": "draw", "label": 9}})"
              "\n{\"p_mm\": [1, 0, 3]}\n");
    }
    uint64_t hash_of(const std::string& name) const {
        const auto loaded = load_volume(file(name));
        EXPECT_TRUE(loaded) << loaded.error().message;
        return loaded ? content_hash(loaded->volume) : 0;
    }
    uint64_t hash_of_export(const std::string& volume) const {
        const ProgramRun done =
            run_project({"--export", volume, "-o", file("exported.nrrd").string()});
        EXPECT_EQ(done.exit_code, 0) << done.messages;
        return hash_of("exported.nrrd");
    }
};

TEST_F(ProjectCommand, StrokesAreStepsThatCanBeTakenBackAndSaved) {
    create();
    write_strokes();
    const uint64_t values = hash_of("ct.nrrd"), labels = hash_of("labels.nrrd");
    EXPECT_EQ(hash_of_export("volume"), values);
    EXPECT_EQ(hash_of_export("labels"), labels);
    ProgramRun done = run_project({"--strokes", file("cut.jsonl").string()});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    // The same as `palpate edit` does.
    const uint64_t cut = hash_of_export("volume"), drawn = hash_of_export("labels");
    EXPECT_NE(cut, values);
    EXPECT_NE(drawn, labels);
    done = run_project({});
    EXPECT_THAT(done.output, AllOf(HasSubstr("volume     volume: grey, 24 x 24 x 24"),
                                   HasSubstr("steps      2 since the last save"),
                                   HasSubstr("cut on volume\n"), HasSubstr("draw 9 on labels\n")));
    EXPECT_THAT(run_project({"--json"}).output, HasSubstr("\"saves\": 1"));
    ASSERT_EQ(run_project({"--undo", "2"}).exit_code, 0);
    EXPECT_EQ(hash_of_export("volume"), values);
    ASSERT_EQ(run_project({"--redo", "1", "--save"}).exit_code, 0);
    EXPECT_EQ(hash_of_export("volume"), cut);
    EXPECT_EQ(hash_of_export("labels"), labels);
    // Past the save, back and forth, and no further; each command opens the project anew.
    for (int round = 0; round < 2; ++round) {
        ASSERT_EQ(run_project({"--undo", "1"}).exit_code, 0);
        EXPECT_EQ(hash_of_export("volume"), values);
        done = run_project({"--undo", "1"});
        EXPECT_EQ(done.exit_code, 1);
        EXPECT_THAT(done.messages, HasSubstr("nothing is left to undo"));
        ASSERT_EQ(run_project({"--redo", "1"}).exit_code, 0);
        EXPECT_EQ(hash_of_export("volume"), cut);
        EXPECT_EQ(run_project({"--redo", "1"}).exit_code, 1);
    }
    ASSERT_EQ(run_project({"--undo", "1", "--redo", "1"}).exit_code, 0);
    EXPECT_EQ(hash_of_export("volume"), cut);
    ASSERT_EQ(run_project({"--strokes", file("cut.jsonl").string()}).exit_code, 0);
    EXPECT_EQ(hash_of_export("labels"), drawn);
    ASSERT_EQ(run_project({"--discard"}).exit_code, 0);
    EXPECT_EQ(hash_of_export("labels"), labels);
    EXPECT_EQ(hash_of_export("volume"), cut);
}

// A project is read, with its unsaved steps, if a volume or a scene is expected.
TEST_F(ProjectCommand, OtherCommandsReadIt) {
    create();
    write_strokes();
    ASSERT_EQ(run_project({"--strokes", file("cut.jsonl").string()}).exit_code, 0);
    const uint64_t cut = hash_of_export("volume");
    ProgramRun done = run({"convert", project(), file("all.nrrd").string()});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(hash_of("all.nrrd"), cut);
    EXPECT_THAT(done.messages, HasSubstr("with 2 steps since its last save"));
    done = run({"info", project(), "--frame", "0"});
    EXPECT_THAT(done.output, HasSubstr("24 x 24 x 24"));
    EXPECT_THAT(done.messages, HasSubstr("have no effect on a project"));
    EXPECT_THAT(run_project({"--save", "--json"}).messages, HasSubstr("--json"));
    ASSERT_EQ(run_project({"--strokes", file("cut.jsonl").string()}).exit_code, 0);
    EXPECT_EQ(run({"surface", project(), "--iso", "0", "-o", file("s.ply").string()}).exit_code, 0);
    done = run({"surface", project(), "--labels", "-o", file("l.ply").string()});
    EXPECT_EQ(done.exit_code, 0) << done.messages;
    for (const std::string& input : {project(), project() + "/project.json"}) {
        done = run({"render", input, "--size", "64,64", "-o", file("p.png").string(),
                    "--write-scene", file("scene.json").string()});
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        EXPECT_FALSE(bytes_of("p.png").empty());
    }
    // A window has shown seeds, and another volume that is not there.
    nlohmann::json described = nlohmann::json::parse(bytes_of("p/project.json"));
    described["scene"]["overlay_layer"] = nlohmann::json::object();
    described["scene"]["fusion_layer"] = {{"opacity", 0.25}};
    write("p/project.json", described.dump());
    done = run({"render", project(), "--size", "64,64", "-o", file("again.png").string()});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(bytes_of("again.png"), bytes_of("p.png"));
    // The hand feels what is left: the floor at z = 0 has a hole of 6 mm below the origin.
    write("down.csv", "time_s,x_mm,y_mm,z_mm\n0,0,0,6\n0.5,0,0,-2\n1,0,0,6\n");
    for (const std::string& scene : {project(), file("ct.nrrd").string()}) {
        done = run({"touch", scene, "--path", file("down.csv").string(), "--device", "exact",
                    "--iso", "0", "--report", file("r.csv").string()});
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        const std::vector<double> force = table("r.csv").at("force_z_n");
        const double most = *std::max_element(force.begin(), force.end());
        EXPECT_EQ(most < 0.1, scene == project()) << most;
    }
    // And an edit of one leaves it as it is.
    write("one.jsonl", R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 4}, )"
                       R"("operation": {"kind": "cut"}})"
                       "\n{\"p_mm\": [6, 6, -4]}\n");
    const uint64_t before = hash_of_export("volume");
    done = run({"edit", project(), file("one.jsonl").string(), "-o", file("e.nrrd").string()});
    EXPECT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_NE(hash_of("e.nrrd"), before);
    EXPECT_EQ(hash_of_export("volume"), before);
}

TEST_F(ProjectCommand, TellsWhichStepsAreInEffectAndWhichMissed) {
    create();
    write_strokes();
    write("far.jsonl", R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", "radius_mm": 4}, )"
                       R"("operation": {"kind": "cut"}})"
                       "\n{\"p_mm\": [600, 0, 0]}\n");
    ASSERT_EQ(run_project({"--strokes", file("cut.jsonl").string()}).exit_code, 0);
    ProgramRun done = run_project({"--strokes", file("far.jsonl").string()});
    EXPECT_EQ(done.exit_code, 0);
    EXPECT_THAT(done.messages, AllOf(HasSubstr("far.jsonl: stroke 1 changed no sample"),
                                     HasSubstr("the volume lies elsewhere")));
    EXPECT_THAT(run_project({}).output, AllOf(HasSubstr("steps      3 since the last save\n"),
                                              HasSubstr("it changed no sample: its tool stays")));
    ASSERT_EQ(run_project({"--undo", "2"}).exit_code, 0);
    done = run_project({});
    EXPECT_THAT(done.output, AllOf(HasSubstr("steps      3 since the last save, 1 in effect\n"),
                                   HasSubstr("cut on volume\n"),
                                   HasSubstr("draw 9 on labels; undone, not in effect\n")));
    const auto json = nlohmann::json::parse(run_project({"--json"}).output);
    EXPECT_EQ(json["steps"].size(), 3u);
    EXPECT_EQ(json["steps"][0]["title"], "cut on volume");
    EXPECT_EQ(json["steps"][0]["in_effect"], true);
    EXPECT_EQ(json["steps"][0]["why_idle"], "");
    EXPECT_EQ(json["steps"][1]["in_effect"], false);
    EXPECT_NE(json["steps"][2]["why_idle"], "");
    EXPECT_THAT(run({"convert", project(), file("c.nrrd").string()}).messages,
                HasSubstr("with 1 step since its last save"));
}

// The strokes of a touch are steps of the project: kept, undone and saved later.
TEST_F(ProjectCommand, ATouchThatEditsWritesItsStrokesIntoTheProject) {
    create();
    write("path.csv",
          "time_s,x_mm,y_mm,z_mm,button\n0,-6,0,-3,1\n0.2,6,0,-3,0\n0.3,0,6,-3,1\n"
          "0.4,0,8,-3,0\n");
    const std::vector<std::string> touch{
        "touch",    project(), "--path",      file("path.csv").string(),
        "--device", "exact",   "--algorithm", "none"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), touch.begin(), touch.end());
        return run(more);
    };
    const uint64_t values = hash_of_export("volume"), labels = hash_of_export("labels");
    ASSERT_EQ(with({}).exit_code, 0); // felt alone
    EXPECT_EQ(hash_of_export("volume"), values);
    ProgramRun done = with({"--drill", "3", "-o", file("out.nrrd").string()});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_THAT(done.messages, HasSubstr("2 steps more"));
    const uint64_t drilled = hash_of_export("volume");
    EXPECT_NE(drilled, values);
    EXPECT_EQ(hash_of("out.nrrd"), drilled);
    EXPECT_FALSE(std::filesystem::exists(file("out.nrrd.journal")));
    EXPECT_EQ(hash_of_export("labels"), labels);
    // A touch of the file itself gives the same.
    done = run({"touch", file("ct.nrrd").string(), "--path", file("path.csv").string(), "--device",
                "exact", "--algorithm", "none", "--drill", "3", "-o", file("file.nrrd").string()});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(hash_of("file.nrrd"), drilled);
    done = with({"--edit", R"({"kind": "draw", "label": 7})", "--tool",
                 R"({"kind": "ball", "radius_mm": 2})"});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_NE(hash_of_export("labels"), labels);
    EXPECT_EQ(hash_of_export("volume"), drilled);
    EXPECT_THAT(run_project({}).output,
                AllOf(HasSubstr("steps      4 since the last save\n"), HasSubstr("cut on volume"),
                      HasSubstr("draw 7 on labels")));
    ASSERT_EQ(run_project({"--undo", "2"}).exit_code, 0);
    EXPECT_EQ(hash_of_export("labels"), labels);
    ASSERT_EQ(run_project({"--save"}).exit_code, 0);
    EXPECT_EQ(hash_of_export("volume"), drilled);
    done = with({"--drill", "3", "--labels", file("labels.nrrd").string()});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("leave out --labels"));
    EXPECT_THAT(with({"--drill", "3", "--journal"}).messages,
                HasSubstr("without effect here: --journal"));
}

// All that a command asks for, or nothing of it: too many undos, a stroke that does not fit behind
// some that do, an export that cannot be written, in any order and together with others.
TEST_F(ProjectCommand, DoesAllOrNothing) {
    create();
    write_strokes();
    ASSERT_EQ(run_project({"--strokes", file("cut.jsonl").string()}).exit_code, 0);
    write("third.jsonl", bytes_of("cut.jsonl") +
                             R"({"stroke": 1, "units": "mm", "shape": {"kind": "ball", )"
                             R"("radius_mm": 3}, "operation": {"kind": "cut", "to_value": 1e9}})"
                             "\n{\"p_mm\": [0, 0, 0]}\n");
    const auto all_files = [&] {
        std::map<std::string, std::string> all;
        for (const auto& entry : std::filesystem::directory_iterator(project()))
            all[entry.path().filename()] = bytes_of("p/" + entry.path().filename().string());
        return all;
    };
    const auto before = all_files();
    const std::string good = file("cut.jsonl").string(), bad = file("third.jsonl").string(),
                      out = file("x.nrrd").string();
    for (const std::vector<std::string>& asked :
         {std::vector<std::string>{"--undo", "5"},
          {"--undo", "2", "--redo", "3"},
          {"--redo", "1"},
          {"--strokes", bad},
          {"--strokes", bad, "--save"},
          {"--strokes", bad, "--discard"},
          {"--strokes", good, "--undo", "9", "--save"},
          {"--strokes", good, "--undo", "9", "--discard"},
          {"--strokes", good, "--export", "nose", "-o", out},
          {"--discard", "--export", "nose", "-o", out},
          {"--undo", "3", "--export", "volume", "-o", out}}) {
        const ProgramRun done = run_project(asked);
        EXPECT_EQ(done.exit_code, 1) << testing::PrintToString(asked);
        EXPECT_EQ(all_files(), before) << testing::PrintToString(asked);
        EXPECT_FALSE(std::filesystem::exists(out));
    }
    EXPECT_THAT(run_project({"--undo", "5"}).messages,
                HasSubstr("nothing is left to undo: expected at most --undo 2, found 5; nothing is "
                          "changed"));
    // A project that is created and cannot be changed as asked is not there.
    const std::string fresh = file("q").string();
    EXPECT_EQ(run({"project", fresh, "--new", file("ct.nrrd").string(), "--undo", "1"}).exit_code,
              1);
    EXPECT_FALSE(std::filesystem::exists(fresh));
    // And all of it where it can be: from the last save on, kept by a save, written to a file.
    const ProgramRun done = run_project(
        {"--discard", "--strokes", good, "--undo", "1", "--export", "volume", "-o", out});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(hash_of("x.nrrd"), hash_of_export("volume"));
    EXPECT_NE(hash_of("x.nrrd"), hash_of("ct.nrrd"));
    EXPECT_EQ(hash_of_export("labels"), hash_of("labels.nrrd"));
    ASSERT_EQ(run_project({"--redo", "1", "--save"}).exit_code, 0);
    EXPECT_NE(hash_of_export("labels"), hash_of("labels.nrrd"));
    EXPECT_THAT(run_project({}).output, HasSubstr("steps      0 since the last save"));
}

// Steps are not lost without a word where the beginning of their journal is.
TEST_F(ProjectCommand, TellsOfAJournalThatLostItsBeginning) {
    create();
    write_strokes();
    ASSERT_EQ(run_project({"--strokes", file("cut.jsonl").string()}).exit_code, 0);
    std::string damaged = bytes_of("p/journal-1");
    std::fill_n(damaged.begin(), 18, '\0');
    write("p/journal-1", damaged);
    for (const std::vector<std::string>& asked :
         {std::vector<std::string>{}, {"--undo", "1"}, {"--save"}}) {
        const ProgramRun done = run_project(asked);
        EXPECT_EQ(done.exit_code, 1);
        EXPECT_THAT(done.messages, AllOf(HasSubstr("journal-1: damaged at byte 0"),
                                         HasSubstr("2 steps that could be read")));
        EXPECT_EQ(bytes_of("p/journal-1"), damaged);
    }
    ASSERT_EQ(run_project({"--discard"}).exit_code, 0);
    EXPECT_EQ(bytes_of("p/journal-1.set-aside"), damaged);
    EXPECT_EQ(hash_of_export("volume"), hash_of("ct.nrrd"));
}

// Any label goes into any map, and an undo makes it what it was.
TEST_F(ProjectCommand, LabelsAbove255MakeTheMapU16) {
    create();
    std::string strokes;
    for (const int label : {5, 300, 65535})
        strokes += fmt::format(R"({{"stroke": 1, "units": "mm", "shape": {{"kind": "ball", )"
                               R"("radius_mm": 3}}, "operation": {{"kind": "draw", )"
                               R"("label": {}}}}})"
                               "\n{{\"p_mm\": [{}, 0, 3]}}\n",
                               label, label % 7 - 3);
    write("high.jsonl", strokes);
    ASSERT_EQ(run_project({"--strokes", file("high.jsonl").string()}).exit_code, 0);
    EXPECT_THAT(run_project({}).output, AllOf(HasSubstr("draw 65535 on labels"), HasSubstr("u16")));
    ASSERT_EQ(run_project({"--undo", "2"}).exit_code, 0);
    EXPECT_THAT(run_project({}).output,
                testing::ContainsRegex("labels: labels, 24 x 24 x 24, .*, u8"));
    ASSERT_EQ(run_project({"--redo", "2", "--save"}).exit_code, 0);
    EXPECT_THAT(run_project({}).output,
                testing::ContainsRegex("labels: labels, 24 x 24 x 24, .*, u16"));
    const uint64_t saved = hash_of_export("labels");
    const ProgramRun done = run({"edit", file("labels.nrrd").string(), file("high.jsonl").string(),
                                 "-o", file("e.nrrd").string()});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_EQ(hash_of("e.nrrd"), saved);
}

TEST_F(ProjectCommand, SaysWhatIsWrong) {
    ProgramRun done = run_project({});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("expected the folder of a project; --new SCENE creates"));
    create();
    done = run_project({"--new", file("ct.nrrd").string()});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages, HasSubstr("expected no such file or folder yet, found one"));
    done = run_project({"--export", "nose", "-o", file("x.nrrd").string()});
    EXPECT_EQ(done.exit_code, 1);
    EXPECT_THAT(done.messages,
                HasSubstr("expected one of the volumes 'volume', 'labels', found 'nose'"));
    EXPECT_EQ(run_project({"--export", "volume"}).exit_code, 2);
    EXPECT_EQ(run_project({"--labels", file("labels.nrrd").string()}).exit_code, 2);
    std::filesystem::remove(file("p/labels-1.pbv"));
    for (const char* command : {"info", "project"}) {
        done = run({command, project()});
        EXPECT_EQ(done.exit_code, 1);
        EXPECT_THAT(done.messages, HasSubstr("labels-1.pbv"));
    }
}

} // namespace
} // namespace palpate
