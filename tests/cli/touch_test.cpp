// palpate touch, as a person runs it: what is felt and written. touch_carve_test.cpp has its edits.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "tests/cli/touch_command.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// TouchCommand takes over 5 s of a processor: the program is started for each option, and a run is
// a haptic loop of thousands of ticks.
TEST_F(TouchCommand, WritesTheColumnsThatProgramsRelyOn) {
    write_path();
    const ProgramRun done = run(arguments("none"));
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_THAT(bytes_of("r.csv"),
                testing::StartsWith("time_s,probe_x_mm,probe_y_mm,probe_z_mm,proxy_x_mm,proxy_y_mm,"
                                    "proxy_z_mm,force_x_n,force_y_n,force_z_n,energy_mj,cpu_us,"
                                    "volume_version,"));
    const auto t = table("r.csv");
    ASSERT_EQ(t.at("time_s").size(), 1001u); // 1 s at 1 kHz, both ends
    for (size_t i = 0; i <= 1000; i += 100) {
        EXPECT_NEAR(t.at("time_s")[i], 1e-3 * static_cast<double>(i), 1e-9);
        EXPECT_EQ(t.at("proxy_z_mm")[i], t.at("probe_z_mm")[i]); // nothing is felt
    }
    // 11 mm in 0.4 s: at 0.2 s half of it. Metres and back cost the last digits.
    EXPECT_NEAR(t.at("probe_z_mm")[200], 37.5, 1e-9);
    const json summary = json::parse(done.output);
    EXPECT_EQ(summary["energy_mj"], 0.0);
    EXPECT_EQ(summary["all_faults"], "none");
    EXPECT_EQ(summary["ticks"], 1001 + 2100);
}

// The sent force is the rendered force and what soft start and passivity added to it.
TEST_F(TouchCommand, TellsWhatTheSafetyChainAdds) {
    const ProgramRun done =
        run({"touch", "synthetic:ball", "--trajectory", "slide", "--at", "0,0,34", "--depth", "2",
             "--distance", "10", "--algorithm", "swept-tool", "--radius", "3", "--report",
             file("r.csv").string()});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    // The path's first pose is in contact: force begins where the hand comes out.
    EXPECT_THAT(done.messages, HasSubstr("force began 0.1"));
    const auto t = table("r.csv");
    double most_added = 0.0, most_step = 0.0;
    glm::dvec3 before(0.0);
    for (size_t i = 0; i < t.at("time_s").size(); ++i) {
        const auto of = [&](const std::string& name) {
            return glm::dvec3(t.at(name + "_x_n")[i], t.at(name + "_y_n")[i],
                              t.at(name + "_z_n")[i]);
        };
        const glm::dvec3 added = of("force") - t.at("share")[i] * of("rendered");
        EXPECT_NEAR(glm::length(added), t.at("damping_n")[i], 1e-9) << i;
        most_added = std::max(most_added, glm::length(added));
        most_step = std::max(most_step, glm::distance(added, before));
        before = added;
    }
    // 3 N s/m at up to 0.2 m/s come within 0.2 s, 0.003 N a tick, and change with the speed of a
    // hand by 0.002 m/s a tick, 0.006 N; beside it passivity's by 0.02 N.
    EXPECT_GT(most_added, 0.05);
    EXPECT_LT(most_step, 0.029);
}

// Noise is measured from the grey values that are felt, and from nothing else.
TEST_F(TouchCommand, TunesItselfToTheSamples) {
    write_path();
    std::vector<std::string> words = arguments("swept-point");
    words.insert(words.begin(), "--verbose");
    const ProgramRun grey = run(words);
    ASSERT_EQ(grey.exit_code, 0) << grey.messages;
    EXPECT_THAT(grey.messages, HasSubstr("normals blurred against noise by 0 samples"));
    // A press at the pole: the proxy rests on the sphere of 35 mm, within 0.005 of the spacing of
    // 1.587 mm, as sharp edges are met.
    const auto t = table("r.csv");
    size_t held = 0;
    for (size_t i = 0; i < t.at("time_s").size(); ++i) {
        if (!(t.at("depth_mm")[i] > 1.0))
            continue;
        ++held;
        EXPECT_NEAR(std::hypot(t.at("proxy_x_mm")[i], t.at("proxy_y_mm")[i], t.at("proxy_z_mm")[i]),
                    35.0, 0.005 * 1.5874);
    }
    EXPECT_GT(held, 100u);
}

TEST_F(TouchCommand, TheSameRunGivesTheSameReportProcessorTimesApart) {
    write_path();
    const auto without_cpu = [&] {
        std::string text;
        auto t = table("r.csv");
        t.erase("cpu_us");
        for (const auto& [name, values] : t) {
            text += name;
            for (const double v : values)
                text += "," + std::to_string(std::hash<double>()(v));
        }
        return text;
    };
    std::vector<std::string> command = arguments("none");
    command[9] = "touch"; // with hand and device in the loop
    ASSERT_EQ(run(command).exit_code, 0);
    const std::string first = without_cpu();
    ASSERT_EQ(run(command).exit_code, 0);
    EXPECT_EQ(without_cpu(), first);
}

TEST_F(TouchCommand, WritesAPageThatNeedsNothingElseAndALogThatPlays) {
    write_path();
    std::vector<std::string> command = arguments("none");
    command.insert(command.end(),
                   {"--page", file("page.html").string(), "--record", file("log.csv").string()});
    const ProgramRun done = run(command);
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    const std::string page = bytes_of("page.html");
    EXPECT_THAT(page, HasSubstr("Force on the hand, N"));
    EXPECT_THAT(page, HasSubstr("Position, mm"));
    EXPECT_THAT(page, HasSubstr("Work done on the hand, mJ"));
    EXPECT_THAT(page, HasSubstr("Penetration of the probe, mm"));
    EXPECT_THAT(page, testing::Not(HasSubstr("http")));
    EXPECT_THAT(page, testing::Not(HasSubstr("nan")));
    EXPECT_THAT(bytes_of("log.csv"), testing::StartsWith("time_ns,x_m,y_m,z_m,"));
}

// Haptic parameters of a scene file; options count more.
TEST_F(TouchCommand, ASceneFileHasHapticKeys) {
    write_path();
    write("scene.json", R"({"volume": "synthetic:ball?size=64",
                            "touch": {"iso": 500, "stiffness_n_per_m": 250}})");
    const auto force_at_rest = [&](std::vector<std::string> more) {
        std::vector<std::string> command{"touch",    file("scene.json").string(),
                                         "--path",   file("path.csv").string(),
                                         "--device", "exact",
                                         "--report", file("r.csv").string()};
        command.insert(command.end(), more.begin(), more.end());
        const ProgramRun done = run(command);
        EXPECT_EQ(done.exit_code, 0) << done.messages;
        return table("r.csv").at("force_z_n")[500];
    };
    const double soft = force_at_rest({}), stiff = force_at_rest({"--stiffness", "500"});
    EXPECT_NEAR(soft, 0.25 * 3.0, 0.05);
    EXPECT_NEAR(stiff, 2.0 * soft, 0.01);
    write("scene.json", R"({"volume": "synthetic:ball?size=64", "touch": {"stiffness": 250}})");
    const ProgramRun wrong = run({"touch", file("scene.json").string(), "--path",
                                  file("path.csv").string(), "--report", file("r.csv").string()});
    EXPECT_EQ(wrong.exit_code, 1);
    EXPECT_NE(wrong.messages.find("touch: unknown key \"stiffness\""), std::string::npos)
        << wrong.messages;
}

// Along x over two labels side by side: 1 for x < 0, 2 beyond, both below z = 0.
TEST_F(TouchCommand, LabelsAreFeltEachInItsOwnWay) {
    write_two_labels();
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,-6,0,3\n0.2,-6,0,-1\n1.2,6,0,-1\n");
    std::vector<std::string> command = arguments("swept-point");
    command[1] = file("labels.nrrd").string();
    command.insert(command.end(), {"--label-feel", "1,300", "--label-feel", "2,900"});
    const ProgramRun done = run(command);
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    const auto t = table("r.csv");
    // The surface lies between the samples at -1 mm and 0: within 0.4 of a sample of -0.5 mm.
    for (const auto& [tick, stiffness] : {std::pair{300, 300.0}, std::pair{1100, 900.0}}) {
        const auto i = static_cast<size_t>(tick);
        const double depth_mm = t.at("proxy_z_mm")[i] - t.at("probe_z_mm")[i];
        EXPECT_NEAR(depth_mm, 0.5, 0.4) << tick;
        EXPECT_NEAR(t.at("force_z_n")[i], 1e-3 * stiffness * depth_mm, 1e-3) << tick;
    }
}

// A label map with samples of its own, turned and finer, over another volume: what it shows lies
// where it says, and so do changes of it.
TEST_F(TouchCommand, LabelsOnAnotherGridAreFeltWhereTheyLie) {
    // x runs backwards and z by half millimetres: solid below z = 10.25 mm.
    std::string text =
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 20 20 40\nspace: left-posterior-superior\n"
        "space directions: (-1,0,0) (0,1,0) (0,0,0.5)\nspace origin: (10,-10,0)\n"
        "encoding: ascii\n\n";
    for (int z = 0; z < 40; ++z)
        for (int i = 0; i < 400; ++i)
            text += z <= 20 ? "1 " : "0 ";
    write("labels.nrrd", text);
    write("path.csv",
          "time_s,x_mm,y_mm,z_mm,button\n0,0,0,16,0\n0.4,0,0,9,0\n0.6,0,0,9,1\n1,0,0,9,1\n");
    std::vector<std::string> command = arguments("swept-point");
    command.insert(command.end(),
                   {"--labels", file("labels.nrrd").string(), "--source", "labels", "--edit",
                    R"({"kind": "erase"})", "--tool", R"({"kind": "ball", "radius_mm": 4})", "-o",
                    file("out.nrrd").string()});
    const ProgramRun done = run(command);
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    EXPECT_THAT(done.messages, HasSubstr("the label map's samples lie elsewhere than the volume's: "
                                         "each is felt and changed where it lies"));
    const auto t = table("r.csv");
    // Within 0.4 of a sample of the middle between those at 10 mm and 10.5.
    EXPECT_NEAR(t.at("proxy_z_mm")[450], 10.25, 0.2);
    EXPECT_NEAR(t.at("force_z_n")[450], 0.5 * 1.25, 0.1); // 500 N/m
    EXPECT_EQ(t.at("force_z_n").back(), 0.0);             // erased
    const json info = json::parse(run({"info", "--json", file("out.nrrd").string()}).output);
    EXPECT_EQ(info["size"], json({20, 20, 40}));
}

TEST_F(TouchCommand, ALabelYieldsAtItsOwnThreshold) {
    write_two_labels();
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,-6,0,3\n0.4,-6,0,-5\n0.8,-6,0,-5\n");
    std::vector<std::string> command = arguments("swept-point");
    command[1] = file("labels.nrrd").string();
    command.insert(command.end(), {"--label-feel", "1,500,0,0.8"});
    ASSERT_EQ(run(command).exit_code, 0);
    // 4 mm at 500 N/m would be 2 N: it rests at T0, within the 3 % that yielding is held to.
    EXPECT_NEAR(table("r.csv").at("force_z_n").back(), 0.8, 0.03 * 0.8);
}

TEST_F(TouchCommand, AMeshIsFelt) {
    write_path();
    const ProgramRun made =
        run({"surface", "synthetic:ball?size=64", "--iso", "500", "-o", file("ball.ply").string()});
    ASSERT_EQ(made.exit_code, 0) << made.messages;
    for (const bool from_file : {false, true}) {
        std::vector<std::string> command = arguments("swept-mesh");
        if (from_file)
            command.insert(command.end(), {"--mesh", file("ball.ply").string()});
        const ProgramRun done = run(command);
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        const auto t = table("r.csv");
        // At 0.5 s the probe is at 32 mm; the ball's top is where the program itself meets it.
        EXPECT_NEAR(t.at("force_z_n")[500], 0.5 * (t.at("proxy_z_mm")[500] - 32.0), 1e-6);
        EXPECT_GT(t.at("force_z_n")[500], 1.0) << from_file;
    }
}

TEST_F(TouchCommand, AVectorFieldPullsAlongItself) {
    // From beyond the field, where nothing is felt: a force at the start would never begin.
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,0,0,20\n0.4,0,0,0\n1,0,0,0\n");
    for (const auto& [name, value] :
         {std::pair{"a.nrrd", 0.6}, std::pair{"b.nrrd", 0.0}, std::pair{"c.nrrd", 0.8}})
        write_nrrd(name, "float", [value = value](int, int) { return value; });
    std::vector<std::string> command = arguments("wish-2008-vector");
    command.insert(command.end(), {"--transfer", "0.7", "--field",
                                   file("a.nrrd").string() + "," + file("b.nrrd").string() + "," +
                                       file("c.nrrd").string()});
    const ProgramRun done = run(command);
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    const auto t = table("r.csv");
    EXPECT_EQ(t.at("force_z_n")[50], 0.0);
    EXPECT_NEAR(t.at("force_x_n")[500], 0.7 * 0.6, 1e-3);
    EXPECT_NEAR(t.at("force_z_n")[500], 0.7 * 0.8, 1e-3);
}

// The hand goes up from z = -6 mm to 8 mm; labels end at -0.5 mm.
TEST_F(TouchCommand, GuidesTheHand) {
    write("up.csv", "time_s,x_mm,y_mm,z_mm\n0,0,0,-6\n1,0,0,8\n2,0,0,8\n");
    write_two_labels();
    const auto guided = [&](const std::vector<std::string>& guide) {
        std::vector<std::string> arguments{
            "touch",    "synthetic:ball?size=64", "--path",   file("up.csv").string(),
            "--report", file("r.csv").string(),   "--device", "exact"};
        arguments.insert(arguments.end(), guide.begin(), guide.end());
        return run(arguments);
    };
    const ProgramRun labels =
        guided({"--labels", file("labels.nrrd").string(), "--guide", "labels"});
    ASSERT_EQ(labels.exit_code, 0) << labels.messages;
    EXPECT_LE(json::parse(labels.output)["energy_mj"].get<double>(), 0.0);
    EXPECT_NEAR(table("r.csv").at("proxy_z_mm").back(), -0.5, 1e-3);

    const ProgramRun plane = guided({"--guide", "plane:0,0,-6,0,0,1", "--iso", "3"});
    ASSERT_EQ(plane.exit_code, 0) << plane.messages;
    EXPECT_THAT(plane.messages, HasSubstr("--iso"));
    EXPECT_NEAR(table("r.csv").at("proxy_z_mm").back(), -6.0, 1e-3);

    const ProgramRun edges = guided({"--guide", "edges", "--yield", "2"});
    ASSERT_EQ(edges.exit_code, 0) << edges.messages;

    EXPECT_THAT(guided({"--guide", "plane:1,2,3"}).messages, HasSubstr("six numbers, found 3"));
    EXPECT_THAT(guided({"--algorithm", "guide-onto"}).messages, HasSubstr("needs a --guide"));
    EXPECT_THAT(guided({"--guide", "edges", "--algorithm", "swept-point"}).messages,
                HasSubstr("not by swept-point"));
    EXPECT_THAT(guided({"--guide", "labels"}).messages, HasSubstr("--guide labels: expected"));
}

} // namespace
} // namespace palpate
