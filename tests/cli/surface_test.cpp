// palpate surface, and palpate compare of meshes, as a person runs them.

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "tests/support/kill.h"
#include "tests/support/meshes.h"
#include "tests/support/paths.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// SurfaceCommand takes over 5 s of a processor: the program is started for each option.
class SurfaceCommand : public ProgramTest {
 protected:
    ProgramRun surface(const std::string& volume, const std::string& out,
                       std::vector<std::string> options) const {
        options.insert(options.begin(), {"surface", volume, "-o", file(out).string(), "--report",
                                         file("report.json").string()});
        std::filesystem::remove(file("report.json"));
        return run(options);
    }
    json report() const { return json::parse(bytes_of("report.json")); }
};

TEST_F(SurfaceCommand, IsoWritesAMeshAndSaysWhatItIs) {
    for (const char* topology_name : {"classic", "correct"}) {
        const ProgramRun ran = surface("synthetic:ball?size=48", "ball.ply",
                                       {"--iso", "500", "--topology", topology_name});
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_EQ(ran.output, "");
        EXPECT_THAT(
            ran.messages,
            testing::MatchesRegex("palpate: info: .*ball.ply: [0-9]+ triangles, [0-9]+ vertices, "
                                  "[0-9.]+ kB\n"));
        const json said = report();
        const Result<LoadedMesh> loaded = load_mesh(file("ball.ply"));
        ASSERT_TRUE(loaded);
        const MeshTopology found = topology(loaded->mesh);
        EXPECT_EQ(said["triangles"], found.triangles);
        EXPECT_EQ(said["vertices"], found.vertices);
        EXPECT_EQ(said["components"], 1);
        EXPECT_EQ(said["euler_number"], 2);
        EXPECT_EQ(said["open_edges"], 0);
        EXPECT_EQ(said["non_manifold_edges"], 0);
        EXPECT_NEAR(said["area_mm2"], found.area_mm2, 1e-3);
        EXPECT_NEAR(said["volume_mm3"], found.volume_mm3, 1e-2);
        EXPECT_EQ(loaded->mesh.normals.size(), loaded->mesh.positions.size());
        for (const char* stage : {"read", "extract", "check", "write", "total"})
            EXPECT_GE(said["ms"][stage], 0.0) << stage;
    }
}

// A ball of r mm: cut in half, of half the size, and hollow, by volumes and centres alone.
TEST_F(SurfaceCommand, MeshesForPrintAreCutScaledAndHollow) {
    const auto made = [&](std::vector<std::string> options) {
        options.insert(options.begin(), {"--iso", "500", "--closed"});
        const ProgramRun ran = surface("synthetic:ball?size=48", "ball.stl", options);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        const json said = report();
        EXPECT_EQ(said["open_edges"], 0);
        EXPECT_EQ(said["misoriented_edges"], 0);
        EXPECT_EQ(said["non_manifold_edges"], 0);
        return std::pair(said, ran.messages);
    };
    const auto volume_of = [](const json& said) { return said["volume_mm3"].get<double>(); };
    const double whole = volume_of(made({}).first);
    const double r = std::cbrt(whole * 3.0 / (4.0 * std::numbers::pi));
    const Mesh mesh = load_mesh(file("ball.stl"))->mesh;
    glm::dvec3 middle(0.0);
    for (const glm::vec3 p : mesh.positions)
        middle +=
            glm::dvec3(mesh.world_from_mesh * glm::dvec4(p, 1.0)) / double(mesh.positions.size());

    const std::string plane = fmt::format("{},{},{},1,2,-1", middle.x, middle.y, middle.z);
    const double half = volume_of(made({"--clip", plane}).first);
    // The cut is off by a sample, of 1 mm, at most.
    EXPECT_NEAR(half, 0.5 * whole, std::numbers::pi * r * r * 0.5);
    const Mesh cut = load_mesh(file("ball.stl"))->mesh; // a loop over it unnamed would outlive it
    for (const glm::vec3 p : cut.positions) {
        const glm::dvec3 n = glm::normalize(glm::dvec3(1, 2, -1));
        ASSERT_GE(glm::dot(glm::dvec3(p) - middle, n), -1.0);
    }
    EXPECT_NEAR(volume_of(made({"--scale", "0.5"}).first), whole / 8.0, 1e-4 * whole);

    const auto [hollow, words] = made({"--wall", "3", "--largest"});
    EXPECT_EQ(hollow["components"], 2);
    EXPECT_THAT(words, HasSubstr("watertight, 2 pieces"));
    const double inner = r - 3.0 - hollow["print"]["excess_mm"].get<double>();
    const double expected = whole - 4.0 / 3.0 * std::numbers::pi * inner * inner * inner;
    // A mesh of samples of 1 mm is off a ball by 3 / (8 r) at most, and the hollow by as much
    // again.
    EXPECT_NEAR(volume_of(hollow), expected,
                4.0 * std::numbers::pi * r * r * 2.0 * 3.0 / (8.0 * r));

    EXPECT_THAT(made({"--pieces-from", "0.001"}).second, HasSubstr("watertight, 1 piece, "));
    for (const auto& [options, says] : {std::pair(std::vector<std::string>{"--pieces-from", "1e6"},
                                                  "expected a piece of 1e+06 ml"),
                                        {{"--wall", "0"}, "--wall"},
                                        {{"--scale", "-1"}, "--scale"},
                                        {{"--clip", "1,2,3"}, "--clip"}}) {
        std::vector<std::string> all{"--iso", "500", "--closed"};
        all.insert(all.end(), options.begin(), options.end());
        const ProgramRun ran = surface("synthetic:ball?size=48", "no.stl", all);
        EXPECT_NE(ran.exit_code, 0);
        EXPECT_THAT(ran.messages, HasSubstr(says));
    }
}

// The same file from either, and the report says who made it.
TEST_F(SurfaceCommand, TheGraphicsDeviceMakesTheSameMesh) {
    const std::string volume = "synthetic:ball?size=40";
    ASSERT_EQ(surface(volume, "cpu.ply", {"--iso", "500", "--on", "cpu"}).exit_code, 0);
    EXPECT_EQ(report()["extraction"]["on"], "cpu");
    const ProgramRun ran = surface(volume, "gpu.ply", {"--iso", "500", "--on", "gpu"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json told = report()["extraction"];
    EXPECT_EQ(told["on"], "gpu");
    EXPECT_FALSE(told["device"].get<std::string>().empty());
    for (const char* pass : {"cull", "count", "emit", "upload and extract", "read back"})
        EXPECT_GE(told["ms"][pass], 0.0) << pass;
    EXPECT_EQ(bytes_of("gpu.ply"), bytes_of("cpu.ply"));
    ASSERT_EQ(surface(volume, "auto.ply", {"--iso", "500"}).exit_code, 0);
    EXPECT_FALSE(report()["extraction"]["why"].get<std::string>().empty());
    EXPECT_EQ(bytes_of("auto.ply"), bytes_of("cpu.ply"));
}

TEST_F(SurfaceCommand, WhatTheGraphicsDeviceDoesNotDoIsRefusedInASentence) {
    const ProgramRun ran = surface("synthetic:ball?size=20", "a.ply",
                                   {"--iso", "500", "--on", "gpu", "--topology", "correct"});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("expected the topology classic"));
}

TEST_F(SurfaceCommand, LabelsShareWallsOrStandAlone) {
    const std::string labels = "synthetic:checkerboard?size=24,20,16";
    ASSERT_EQ(surface(labels, "shared.ply", {"--labels"}).exit_code, 0);
    const json shared = report();
    ASSERT_FALSE(shared["labels"].empty());
    EXPECT_EQ(shared["open_edges"], 0);
    EXPECT_EQ(shared["non_manifold_edges"], 0); // faults of labels, not lines where walls meet
    for (const json& label : shared["labels"]) {
        EXPECT_EQ(label["open_edges"], 0) << label["label"];
        EXPECT_EQ(label["non_manifold_edges"], 0) << label["label"];
        EXPECT_NEAR(label["volume_mm3"].get<double>() / label["volume_fp64_mm3"].get<double>(), 1.0,
                    1e-5);
        EXPECT_GT(label["voxels"], 0);
    }
    const Result<LoadedMesh> mesh = load_mesh(file("shared.ply"));
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->mesh.outer_labels.size(), mesh->mesh.triangles.size());

    ASSERT_EQ(surface(labels, "alone.ply", {"--labels", "--walls", "separate"}).exit_code, 0);
    const json alone = report();
    ASSERT_EQ(alone["labels"].size(), shared["labels"].size());
    for (size_t n = 0; n < alone["labels"].size(); ++n) {
        EXPECT_EQ(alone["labels"][n]["voxels"], shared["labels"][n]["voxels"]);
        EXPECT_EQ(alone["labels"][n]["open_edges"], 0);
        EXPECT_FALSE(alone["labels"][n].contains("volume_fp64_mm3"));
    }
    EXPECT_EQ(surface(labels, "smooth.vtp", {"--labels", "--smooth", "bounded"}).exit_code, 0);
    EXPECT_EQ(report()["labels"].size(), shared["labels"].size());
}

TEST_F(SurfaceCommand, SmoothsAndDecimates) {
    const std::vector<std::string> ball{"--iso", "500"};
    ASSERT_EQ(surface("synthetic:ball?size=32", "full.ply", ball).exit_code, 0);
    const json full = report();
    for (const char* filter : {"mean", "taubin", "sinc"}) {
        ASSERT_EQ(surface("synthetic:ball?size=32", "smooth.stl",
                          {"--iso", "500", "--smooth", filter, "--passes", "5"})
                      .exit_code,
                  0);
        const json said = report();
        EXPECT_EQ(said["triangles"], full["triangles"]);
        EXPECT_EQ(said["smoothing"]["volume_before_mm3"], full["volume_mm3"]);
        EXPECT_EQ(said["smoothing"]["volume_after_mm3"], said["volume_mm3"]);
        EXPECT_GT(said["smoothing"]["largest_shift_mm"], 0.0);
    }
    ASSERT_EQ(surface("synthetic:ball?size=32", "few.ply", {"--iso", "500", "--decimate", "0.5"})
                  .exit_code,
              0);
    const json few = report();
    EXPECT_LT(few["triangles"], full["triangles"].get<double>() / 2);
    EXPECT_LE(few["decimation"]["hausdorff_mm"], 0.5);
    EXPECT_EQ(few["decimation"]["triangles_before"], full["triangles"]);
    EXPECT_EQ(few["euler_number"], 2);
    EXPECT_EQ(few["decimation"]["error_mm"], 0.5);
    // Another measurement, by another command, of the two files.
    const ProgramRun compared =
        run({"compare", file("full.ply").string(), file("few.ply").string(), "--hausdorff", "0.5"});
    EXPECT_EQ(compared.exit_code, 0) << compared.messages;
}

// Hundreds of components of noise about a ball: each keeps what it is, and nothing holds up the
// rest.
TEST_F(SurfaceCommand, DecimatesNoisyVolumes) {
    const std::vector<std::string> iso{"--iso", "300"};
    ASSERT_EQ(surface("synthetic:phantom?size=48", "full.ply", iso).exit_code, 0);
    const json full = report();
    ProgramRun ran =
        surface("synthetic:phantom?size=48", "half.ply", {"--iso", "300", "--decimate-to", "50%"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.messages, testing::Not(HasSubstr("warning")));
    const json half = report();
    EXPECT_EQ(half["triangles"], (full["triangles"].get<uint64_t>() / 2 + 1) / 2 * 2);
    for (const char* same : {"components", "euler_number", "open_edges", "non_manifold_edges"})
        EXPECT_EQ(half[same], full[same]) << same;
    EXPECT_FALSE(half["decimation"].contains("error_mm"));
    ran = surface("synthetic:phantom?size=48", "same.ply",
                  {"--iso", "300", "--decimate", "0.0001", "--decimate-to", "500"});
    ASSERT_EQ(ran.exit_code, 0);
    EXPECT_THAT(ran.messages, HasSubstr("warning: --decimate 0.0001 --decimate-to 500: "));
    EXPECT_THAT(ran.messages, HasSubstr("would move the surface too far"));
    for (const char* wrong : {"0", "101%", "half", "-5", "50.5", "%"})
        EXPECT_EQ(
            surface("synthetic:ball?size=16", "a.ply", {"--iso", "500", "--decimate-to", wrong})
                .exit_code,
            2)
            << wrong;
}

// A report that cannot be written leaves no mesh either.
TEST_F(SurfaceCommand, MeshAndReportComeTogetherOrNotAtAll) {
    const std::string command = "'" + std::string(kProgram) +
                                "' surface 'synthetic:ball?size=16' --iso 500 --report - -o '" +
                                file("a.ply").string() + "' > /dev/full 2> '" +
                                file("messages").string() + "'";
    EXPECT_NE(std::system(command.c_str()), 0);
    EXPECT_THAT(bytes_of("messages"), HasSubstr("standard output cannot be written"));
    for (const auto& entry : std::filesystem::directory_iterator(file("")))
        EXPECT_EQ(entry.path().filename(), "messages");
}

TEST_F(SurfaceCommand, SaysWhichOptionsChangeNothing) {
    const ProgramRun ran =
        run({"surface", "synthetic:ball?size=16", "--iso", "500", "-o", file("a.obj").string(),
             "--passes", "4", "--walls", "separate", "--ascii"});
    EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.messages,
                HasSubstr("without effect here: --walls (with --iso), --passes (without --smooth), "
                          "--ascii (of .ply and .stl alone)\n"));
    const ProgramRun useful =
        run({"surface", "synthetic:ball?size=16", "--iso", "500", "-o", file("a.ply").string(),
             "--smooth", "mean", "--passes", "4", "--ascii", "--closed", "--normals", "none"});
    EXPECT_EQ(useful.exit_code, 0);
    EXPECT_THAT(useful.messages, testing::Not(HasSubstr("without effect")));
}

TEST_F(SurfaceCommand, ReportsGoToStandardOutputToo) {
    const ProgramRun ran = run({"surface", "synthetic:torus?size=32", "--iso", "500", "-o",
                                file("torus.obj").string(), "--report", "-"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_EQ(json::parse(ran.output)["euler_number"], 0);
    EXPECT_THAT(bytes_of("torus.obj"), HasSubstr("\nvn "));
}

// A volume of 4^3 floats, or a label map of as many bytes; no header line is missing.
std::string nrrd_of(const std::vector<float>& values) {
    std::string text =
        "NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 4 4\n"
        "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n"
        "endian: little\n\n";
    return text.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
}

TEST_F(SurfaceCommand, WhereThereIsNoSurfaceThereIsNoFile) {
    const std::string whole = nrrd_of(std::vector<float>(64, 5.0f));
    write("flat.nrrd", whole);
    write("zero.nrrd", nrrd_of(std::vector<float>(64, 0.0f)));
    write("cut.nrrd", whole.substr(0, whole.size() - 10));
    write("long.nrrd",
          "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 70000 1 1\n"
          "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\n" +
              std::string(70000, '\1'));
    const std::string flat = file("flat.nrrd").string(), ball = "synthetic:ball?size=16";
    const std::string nowhere = file("no/such/r.json").string();
    for (const auto& [ran, part] :
         {std::pair(surface(flat, "a.ply", {"--iso", "5"}), "on both sides of 5"),
          {surface(file("zero.nrrd").string(), "a.ply", {"--labels"}), "labels other than 0"},
          {surface(file("zero.nrrd").string(), "a.ply", {"--labels", "--walls", "separate"}),
           "labels other than 0"},
          {surface(file("cut.nrrd").string(), "a.ply", {"--iso", "5"}), "cut.nrrd"},
          {surface(ball, "a.ply", {"--iso", "1e30"}), "within"},
          {surface(file("long.nrrd").string(), "a.ply", {"--labels"}), "fewer than 65535 samples"},
          {run({"surface", ball, "--iso", "500", "-o", file("a.ply").string(), "--report",
                file("./a.ply").string()}),
           "--report: expected a file for each"},
          {run({"surface", ball, "--iso", "500", "-o", file("a.ply").string(), "--report",
                nowhere}),
           "no/such"},
          {run({"surface", ball, "--iso", "500", "-o", "/proc/a.ply"}), "cannot be written"},
          {run({"surface", ball, "--iso", "500", "-o", file("a.ply").string(), "--report",
                "/dev/full"}),
           "found a folder or device"}}) {
        EXPECT_EQ(ran.exit_code, 1) << ran.messages;
        EXPECT_EQ(ran.output, "");
        EXPECT_THAT(ran.messages, HasSubstr(part));
        EXPECT_EQ(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 1) << ran.messages;
    }
    EXPECT_EQ(surface(flat, "box.ply", {"--iso", "5", "--closed"}).exit_code, 0);
    // Nothing but what was put here: no mesh, nor a part of one under another name.
    for (const auto& entry : std::filesystem::directory_iterator(file("")))
        EXPECT_THAT((std::set<std::string>{"box.ply", "flat.nrrd", "zero.nrrd", "cut.nrrd",
                                           "long.nrrd", "report.json", "stdout", "stderr"}),
                    ::testing::Contains(entry.path().filename().string()));
}

// A disk with room for a part of the mesh: no file may be longer than 8 KiB. What is written there
// beyond fails as on a full disk; the mesh has 60.
TEST_F(SurfaceCommand, AFullDiskLeavesNothing) {
    const std::string command = fmt::format(
        "cd '{}' && trap '' XFSZ && ulimit -f 16 && '{}' --quiet surface 'synthetic:ball?size=24' "
        "--iso 500 -o full.ply 2>stderr",
        file("").string(), kProgram);
    const int status = std::system(command.c_str());
    EXPECT_EQ(WEXITSTATUS(status), 1);
    const std::string messages = bytes_of("stderr");
    EXPECT_THAT(messages, HasSubstr("full.ply"));
    EXPECT_EQ(std::count(messages.begin(), messages.end(), '\n'), 1) << messages;
    for (const auto& entry : std::filesystem::directory_iterator(file("")))
        EXPECT_EQ(entry.path().filename(), "stderr");
}

TEST_F(SurfaceCommand, RefusesInOneSentence) {
    write("broken.nrrd", "NRRD0004\n");
    for (const auto& [ran, part] :
         {std::pair(surface("synthetic:ball?size=16", "a.xyz", {"--iso", "500"}), ".ply, .stl"),
          {surface("synthetic:ball?size=16", "a.ply", {"--iso", "5000"}), "iso-value within"},
          {surface(file("absent.nii").string(), "a.ply", {"--iso", "5"}), "absent.nii"},
          {surface(file("broken.nrrd").string(), "a.ply", {"--labels"}), "broken.nrrd"},
          {surface("synthetic:ball?size=16", "a.ply", {"--labels"}), "expected labels"},
          {surface("synthetic:ball?size=16", "no/such/a.ply", {"--iso", "500"}), "no/such"}}) {
        EXPECT_EQ(ran.exit_code, 1) << ran.messages;
        EXPECT_EQ(ran.output, "");
        EXPECT_THAT(ran.messages, HasSubstr(part));
        EXPECT_EQ(std::count(ran.messages.begin(), ran.messages.end(), '\n'), 1) << ran.messages;
        EXPECT_FALSE(std::filesystem::exists(file("a.ply")));
        EXPECT_FALSE(std::filesystem::exists(file("report.json")));
    }
    for (const std::vector<std::string>& wrong :
         std::vector<std::vector<std::string>>{{},
                                               {"--iso", "5", "--labels"},
                                               {"--iso", "high"},
                                               {"--iso", "5", "--smooth", "ironed"},
                                               {"--iso", "5", "--decimate", "-1"},
                                               {"--iso", "5", "--topology", "flat"}})
        EXPECT_EQ(surface("synthetic:ball?size=16", "a.ply", wrong).exit_code, 2);
}

// Whenever it is: either all of it was done, or there is no file and a sentence says so.
TEST_F(SurfaceCommand, InterruptedItLeavesAllOrNothing) {
    const int messages = ::open(file("messages").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    for (const std::vector<std::string>& options :
         {std::vector<std::string>{"synthetic:gyroid?size=160", "--smooth", "sinc"},
          {"synthetic:gyroid?size=24", "--decimate", "0.5"}}) // most of which is measuring
        interrupt_at_many_moments(
            3,
            [&] {
                std::vector<std::string> words{"surface",  "--iso", "500",
                                               "--closed", "-o",    file("g.ply").string()};
                words.insert(words.end(), options.begin(), options.end());
                return become_program(words, messages);
            },
            [&](bool is_done) {
                EXPECT_TRUE(!is_done || std::filesystem::exists(file("g.ply")));
                if (std::filesystem::exists(file("g.ply"))) {
                    EXPECT_TRUE(load_mesh(file("g.ply")));
                }
                for (const auto& entry : std::filesystem::directory_iterator(file("")))
                    EXPECT_EQ(entry.path().string().find(".tmp."), std::string::npos)
                        << entry.path();
                std::filesystem::remove(file("g.ply"));
            });
    ::close(messages);
    EXPECT_THAT(bytes_of("messages"),
                testing::AnyOf(HasSubstr("interrupted"), HasSubstr("stopped")));
}

class CompareMeshesCommand : public ProgramTest {
 protected:
    CompareMeshesCommand() {
        EXPECT_TRUE(save_mesh(file("a.ply"), meshes::ball(10.0, 3)));
        EXPECT_TRUE(save_mesh(file("b.stl"), meshes::ball(10.5, 3)));
    }
    ProgramRun compare(const std::string& a, const std::string& b,
                       std::vector<std::string> options = {}) const {
        options.insert(options.begin(), {"compare", file(a).string(), file(b).string()});
        return run(options);
    }
};

TEST_F(CompareMeshesCommand, GivesMetricsAndPass) {
    const ProgramRun same = compare("a.ply", "a.ply");
    EXPECT_EQ(same.exit_code, 0) << same.messages;
    const json zero = json::parse(same.output);
    EXPECT_EQ(zero["kind"], "mesh");
    EXPECT_TRUE(zero["pass"]);
    EXPECT_LT(zero["hausdorff_mm"], 1e-9);

    const ProgramRun apart = compare("a.ply", "b.stl");
    EXPECT_EQ(apart.exit_code, 1);
    EXPECT_THAT(apart.messages, HasSubstr("the Hausdorff distance in mm is"));
    const json said = json::parse(apart.output);
    EXPECT_FALSE(said["pass"]);
    // The same facets about one centre, 0.5 mm apart at their corners and a little less between.
    EXPECT_NEAR(said["hausdorff_mm"], 0.5, 0.02);
    EXPECT_NEAR(said["rms_mm"], 0.5, 0.02);
    EXPECT_EQ(said["triangles"], json({512, 512}));
    EXPECT_EQ(said["euler_number"], json({2, 2}));
    for (const char* key : {"hausdorff_tolerance_mm", "normal_rms_deg", "forward", "backward",
                            "area_mm2", "volume_mm3", "components", "open_edges", "failed"})
        EXPECT_TRUE(said.contains(key)) << key;
    EXPECT_EQ(compare("a.ply", "b.stl", {"--hausdorff", "0.6"}).exit_code, 0);
    EXPECT_EQ(compare("a.ply", "b.stl", {"--hausdorff", "0.4"}).exit_code, 1);
    // The told distance lies between two bounds. A limit between them is settled by narrowing them,
    // and passes by the upper one alone. Limits a part in 1e4 of their distance to each side of it.
    const double least = said["hausdorff_mm"], most = said["hausdorff_most_mm"];
    EXPECT_LE(least, most);
    EXPECT_LE(most - least, said["hausdorff_tolerance_mm"].get<double>() * (1 + 1e-9));
    const auto by_limit = [&](double limit) {
        const ProgramRun ran = compare("a.ply", "b.stl", {"--hausdorff", fmt::format("{}", limit)});
        const json found = json::parse(ran.output);
        EXPECT_EQ(ran.exit_code, found["hausdorff_most_mm"].get<double>() <= limit ? 0 : 1);
        EXPECT_EQ(ran.exit_code, found["hausdorff_mm"].get<double>() > limit ? 1 : ran.exit_code);
        return ran.exit_code;
    };
    EXPECT_EQ(by_limit(least - 1e-9), 1);
    EXPECT_EQ(by_limit(most + 1e-9), 0);
    by_limit(0.5 * (least + most));
    for (const char* name : {"m.obj", "m.vtp"}) {
        const Result<LoadedMesh> mesh = load_mesh(file("a.ply"));
        ASSERT_TRUE(mesh && save_mesh(file(name), mesh->mesh));
        EXPECT_EQ(compare("a.ply", name).exit_code, 0) << name;
    }
    EXPECT_EQ(compare("a.ply", "b.stl", {"--rms-distance", "0.55"}).exit_code, 0);
    // Facets of half the size are tilted against their coarser ones.
    ASSERT_TRUE(save_mesh(file("c.ply"), meshes::ball(10.0, 2)));
    EXPECT_EQ(compare("a.ply", "c.ply", {"--normal-angle", "1"}).exit_code, 1);
    EXPECT_EQ(compare("a.ply", "c.ply", {"--normal-angle", "30"}).exit_code, 0);
    EXPECT_EQ(compare("a.ply", "b.stl", {"--bound", "0.6"}).exit_code, 0);
}

TEST_F(CompareMeshesCommand, RefusesInOneSentence) {
    write("broken.ply", bytes_of("a.ply").substr(0, 300));
    ASSERT_TRUE(save_mesh(file("empty.ply"), Mesh{}));
    for (const ProgramRun& refused :
         {compare("a.ply", "broken.ply"), compare("a.ply", "absent.stl"), compare("a.ply", "v.nii"),
          compare("a.ply", "empty.ply"), compare("a.ply", "a.ply", {"--dice", "1"})}) {
        EXPECT_EQ(refused.exit_code, 1);
        EXPECT_EQ(refused.output, "");
        EXPECT_EQ(std::count(refused.messages.begin(), refused.messages.end(), '\n'), 1)
            << refused.messages;
    }
}

} // namespace
} // namespace palpate
