// Refusals and warnings of palpate touch.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/touch_command.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST_F(TouchCommand, SaysWhatCannotBeFelt) {
    write_path();
    const auto message = [&](const char* algorithm, const std::vector<std::string>& more) {
        std::vector<std::string> command = arguments(algorithm);
        command.insert(command.end(), more.begin(), more.end());
        const ProgramRun bad = run(command);
        EXPECT_EQ(bad.exit_code, 1);
        return bad.messages;
    };
    EXPECT_THAT(message("swept-point", {"--source", "labels"}),
                HasSubstr("--source: expected --labels"));
    write("hop.json", R"({"kind": "hop"})");
    EXPECT_THAT(message("swept-point", {"--edit", file("hop.json").string(), "--tool",
                                        R"({"kind": "ball", "radius_mm": 4})"}),
                AllOf(HasSubstr("--edit: "), HasSubstr("hop.json:1: kind: expected")));
}

TEST_F(TouchCommand, SaysWhatIsWrong) {
    write_path();
    EXPECT_EQ(run({"touch", "synthetic:ball"}).exit_code, 2); // no motion
    EXPECT_EQ(run({"touch", "synthetic:ball", "--path", "a", "--trajectory", "press"}).exit_code,
              2);
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,0,zero,0\n");
    const ProgramRun bad = run(arguments("none"));
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_THAT(bad.messages, HasSubstr("path.csv:2: y_mm: expected a number, found 'zero'"));
}

// Before the run, not after an hour of it.
TEST_F(TouchCommand, RefusesWhatCannotBeWritten) {
    write_path();
    std::vector<std::string> named = arguments("none");
    named.insert(named.end(), {"-o", file("drilled.foo").string()});
    const ProgramRun unknown = run(named);
    EXPECT_EQ(unknown.exit_code, 1);
    EXPECT_THAT(unknown.messages, HasSubstr("drilled.foo: expected an extension .nii"));
    EXPECT_FALSE(std::filesystem::exists(file("r.csv")));
    write_path();
    for (const char* option : {"--report", "--page", "--record", "-o"})
        for (const char* path : {"no/such/folder.csv", "-", "/dev/stdout"}) {
            if (option == std::string("--report") && path == std::string("-"))
                continue; // standard output, in place of the summary
            const ProgramRun bad =
                run({"touch", "synthetic:ball?size=8", "--trajectory", "press", option, path});
            EXPECT_EQ(bad.exit_code, 1) << option << " " << path;
            EXPECT_EQ(bad.output, "");
            EXPECT_EQ(std::count(bad.messages.begin(), bad.messages.end(), '\n'), 1)
                << bad.messages;
        }
    EXPECT_FALSE(std::filesystem::exists("-"));
    EXPECT_TRUE(std::filesystem::is_symlink("/dev/stdout"));
}

TEST_F(TouchCommand, RefusesWhatIsBeyondAllBounds) {
    write_path();
    for (const auto& [option, value] :
         std::vector<std::pair<std::string, std::string>>{{"--friction", "-1"},
                                                          {"--friction", "0.3,101"},
                                                          {"--stiffness", "1.1e6"},
                                                          {"--yield", "1e5"},
                                                          {"--viscosity", "1e30"},
                                                          {"--damping", "1e6"},
                                                          {"--radius", "1e9"},
                                                          {"--samples", "0"},
                                                          {"--iso", "1e31"},
                                                          {"--label-feel", "5,1e30"},
                                                          {"--transfer-across", "1e9"},
                                                          {"--opacity", "0:0,1e31:1"}}) {
        std::vector<std::string> command = arguments("swept-point");
        command.push_back(option + "=" + value);
        const ProgramRun bad = run(command);
        EXPECT_EQ(bad.exit_code, 2) << option << bad.messages;
        EXPECT_THAT(bad.messages, HasSubstr(option + ": ")) << value;
    }
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,0,0,43\n8000,0,0,30\n");
    const ProgramRun long_one = run(arguments("none"));
    EXPECT_EQ(long_one.exit_code, 1);
    EXPECT_THAT(long_one.messages, HasSubstr("expected a path of at most 3600 s, found 8000 s"));
}

TEST_F(TouchCommand, SaysWhatChangesNothingAndThatNothingWasFelt) {
    write_path();
    const auto said = [&](const char* algorithm, const std::vector<std::string>& more) {
        std::vector<std::string> command = arguments(algorithm);
        command.insert(command.end(), more.begin(), more.end());
        const ProgramRun ran = run(command);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return ran.messages;
    };
    EXPECT_THAT(said("swept-point", {"--radius", "5", "--mesh", "no.ply", "--depth", "3"}),
                AllOf(HasSubstr("without effect here: --radius (of vidholm-2004, eriksson-2006* "
                                "and swept-tool), --mesh (of swept-mesh)\n"),
                      HasSubstr("without effect here: --depth (without --trajectory)\n")));
    EXPECT_THAT(said("swept-tool", {"--radius", "1"}),
                testing::Not(HasSubstr("without effect here")));
    EXPECT_THAT(said("wish-2008-surface", {}), HasSubstr("nothing was felt: --transfer"));
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,0,0,43\n0.1,0,0,40\n");
    EXPECT_THAT(said("swept-point", {}),
                AllOf(HasSubstr("nothing was touched"), HasSubstr("superior 40 .. 43 mm"),
                      HasSubstr("the volume within left")));
    EXPECT_EQ(said("none", {}),
              "palpate: warning: without effect here: --iso (with --algorithm none)\n");
    const auto phantom = [&](const char* iso) {
        return run({"touch", "synthetic:phantom?size=64", "--trajectory", "touch", "--duration",
                    "0.1", "--iso", iso})
            .messages;
    };
    EXPECT_THAT(phantom("45"),
                HasSubstr("its surface belongs to grains")); // amid the tissue's noise
    EXPECT_THAT(phantom("300"), testing::Not(HasSubstr("grains")));
}

// Which options make a trajectory is not listed anywhere: those that leave the path as it is have
// no effect.
TEST_F(TouchCommand, SaysWhichOptionsATrajectoryDoesNotTake) {
    const auto idle = [&](const char* trajectory) {
        const ProgramRun ran = run({"touch",        "synthetic:ball?size=16",
                                    "--trajectory", trajectory,
                                    "--algorithm",  "none",
                                    "--direction",  "0,1,0",
                                    "--depth",      "2",
                                    "--distance",   "3",
                                    "--speed",      "5",
                                    "--frequency",  "50",
                                    "--duration",   "0.05",
                                    "--seed",       "4"});
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return ran.messages;
    };
    EXPECT_THAT(idle("press"),
                HasSubstr("here: --frequency (not of press), --seed (not of press)\n"));
    EXPECT_THAT(idle("cross"),
                HasSubstr("here: --depth (not of cross), --frequency (not of cross), "
                          "--duration (not of cross), --seed (not of cross)\n"));
    EXPECT_THAT(idle("walk"), HasSubstr("here: --direction (not of walk), --depth (not of walk), "
                                        "--speed (not of walk), --frequency (not of walk)\n"));
    EXPECT_THAT(idle("reach"), HasSubstr("here: --frequency (not of reach)\n"));
}

TEST_F(TouchCommand, SaysWhatIsNowhereOrTooFar) {
    write_two_labels();
    const std::string labels = file("labels.nrrd").string();
    const ProgramRun felt = run({"touch", labels, "--trajectory", "press", "--duration", "0.01",
                                 "--label-feel", "2,300", "--label-feel", "7,500"});
    EXPECT_EQ(felt.exit_code, 0);
    EXPECT_THAT(felt.messages, HasSubstr("--label-feel: no sample has label 7"));
    const ProgramRun wide =
        run({"touch", "synthetic:ball?size=32", "--trajectory", "press", "--duration", "0.01",
             "--algorithm", "vidholm-2004", "--radius", "500", "--iso", "500"});
    EXPECT_THAT(wide.messages,
                HasSubstr("the 340 --samples of a --radius of 500 mm lie about 96 mm "
                          "apart, and what is smaller may pass between them"));
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,0,0,43\n0.1,0,1e30,40\n");
    const ProgramRun far = run(arguments("none"));
    EXPECT_EQ(far.exit_code, 1);
    EXPECT_THAT(far.messages,
                HasSubstr("path.csv:3: x_mm, y_mm, z_mm: expected a place within 1e+08 mm"));
    EXPECT_EQ(
        run({"touch", "synthetic:ball", "--trajectory", "press", "--at", "0,0,1e30"}).exit_code, 2);
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,0,0,43\n0.1,0,0,30\n");
    std::vector<std::string> command = arguments("swept-point");
    command.insert(command.end(), {"--drill", "3"});
    EXPECT_THAT(run(command).messages,
                HasSubstr("--edit or --drill changed no sample: the path presses no button 0"));
}

} // namespace
} // namespace palpate
