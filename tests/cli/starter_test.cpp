// The files for a first try: palpate edit --write-strokes and palpate touch --write-path.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"
#include "tests/cli/touch_command.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class StarterFiles : public TouchCommand {
 protected:
    // Volumes of unlike size, type and spacing, by the names they are read by.
    std::vector<std::string> volumes() const {
        EXPECT_TRUE(save_volume(file("phantom.nrrd"),
                                synthetic::sample_ct_phantom(make_grid(
                                    {100, 90, 40}, {2, 2, 5}, glm::dvec3(-100, -90, -100)))));
        // A block of 4 mm in a corner of a box of 6 mm, which no line through the middle meets.
        EXPECT_TRUE(save_volume(
            file("corner.nii"),
            make_volume(make_grid({24, 24, 12}, {0.25, 0.25, 0.5}, glm::dvec3(300, -20, 7)),
                        ScalarType::u8, [](glm::uvec3 i) {
                            const bool in = i.x > 15 && i.x < 22 && i.y > 15 && i.y < 22;
                            return in && i.z > 7 && i.z < 11 ? 200.0 : 3.0;
                        })));
        return {"synthetic:ball?size=64", file("phantom.nrrd").string(),
                file("corner.nii").string()};
    }
};

TEST_F(StarterFiles, StrokesThatAreWrittenRunAsTheyAre) {
    for (const std::string& volume : volumes()) {
        const std::string strokes = file("strokes.jsonl").string();
        const ProgramRun made = run({"edit", volume, "--write-strokes", strokes});
        ASSERT_EQ(made.exit_code, 0) << made.messages;
        EXPECT_EQ(made.messages.find("warning"), std::string::npos) << made.messages;
        const ProgramRun done = run({"edit", volume, strokes, "-o", file("out.nrrd").string(),
                                     "--report", file("report.json").string()});
        ASSERT_EQ(done.exit_code, 0) << volume << ": " << done.messages;
        EXPECT_EQ(done.messages.find("warning"), std::string::npos) << done.messages;
        const json report = json::parse(bytes_of("report.json"));
        ASSERT_EQ(report["steps"].size(), 2u);
        for (const json& step : report["steps"])
            EXPECT_GT(step["removed_mm3"], 0.0) << volume;

        // The counts of the report, from the files alone.
        ASSERT_EQ(run({"convert", volume, file("in.nrrd").string()}).exit_code, 0);
        const Volume before = load_volume(file("in.nrrd"))->volume,
                     after = load_volume(file("out.nrrd"))->volume;
        const double solid = report["solid"];
        uint64_t changed = 0, removed = 0;
        for (uint32_t z = 0; z < before.size().z; ++z)
            for (uint32_t y = 0; y < before.size().y; ++y)
                for (uint32_t x = 0; x < before.size().x; ++x) {
                    const float was = before.value({x, y, z}), is = after.value({x, y, z});
                    changed += was != is;
                    removed += was >= solid && is < solid;
                }
        const glm::dvec3 mm = spacing_mm(before.grid());
        EXPECT_EQ(report["changed_samples"], changed) << volume;
        EXPECT_NEAR(report["removed_mm3"].get<double>(),
                    static_cast<double>(removed) * mm.x * mm.y * mm.z,
                    1e-9 * report["removed_mm3"].get<double>());
    }
}

TEST_F(StarterFiles, APathThatIsWrittenLandsAndLeaves) {
    for (const std::string& volume : volumes())
        for (const bool drills : {false, true}) {
            const std::string path = file("path.csv").string();
            const ProgramRun made = run({"touch", volume, "--write-path", path});
            ASSERT_EQ(made.exit_code, 0) << made.messages;
            EXPECT_EQ(made.output, "");
            std::vector<std::string> command{"touch", volume,     "--path",
                                             path,    "--report", file("r.csv").string()};
            if (drills)
                command.insert(command.end(), {"--drill", "2", "-o", file("out.nrrd").string()});
            const ProgramRun done = run(command);
            ASSERT_EQ(done.exit_code, 0) << done.messages;
            for (const char* fault : {"nothing was", "without effect", "no sample"})
                EXPECT_EQ(done.messages.find(fault), std::string::npos)
                    << volume << ": " << done.messages;
            const json summary = json::parse(done.output);
            EXPECT_GT(summary["contact_ticks"], drills ? 20 : 100); // it is gone at 0.1 s
            EXPECT_GT(summary["most_force_n"], 0.05);
            EXPECT_EQ(summary["all_faults"], "none");
            EXPECT_EQ(summary["removed_mm3"].get<double>() > 0.0, drills) << volume;
            const auto t = table("r.csv"); // free at both ends, in contact between
            EXPECT_EQ(t.at("depth_mm").front(), 0.0);
            EXPECT_EQ(t.at("depth_mm").back(), 0.0);
        }
}

TEST_F(StarterFiles, FollowTheIsoValueAndSayWhereThereIsNoSurface) {
    const std::string path = file("path.csv").string(), strokes = file("s.jsonl").string();
    // The values of the ball fall with the distance from its centre: 500 lies at 35 mm.
    const auto deepest_y = [&](const char* iso) {
        const ProgramRun made =
            run({"touch", "synthetic:ball?size=64", "--iso", iso, "--write-path", path});
        EXPECT_EQ(made.exit_code, 0) << made.messages;
        const std::string text = bytes_of("path.csv");
        double time = 0, x = 0, y = 0;
        EXPECT_EQ(
            std::sscanf(text.c_str() + text.find("\n1.00,") + 1, "%lf,%lf,%lf", &time, &x, &y), 3)
            << text;
        return y;
    };
    EXPECT_NEAR(deepest_y("500"), -35.0 + 2.0, 1.5874); // from anterior, 2 mm deep; a sample
    EXPECT_NE(deepest_y("500"), deepest_y("600"));
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"touch", "synthetic:ball?size=64", "--iso", "9000",
                                   "--write-path", path},
          {"edit", "synthetic:ball?size=64", "--iso", "9000", "--write-strokes", strokes}}) {
        std::filesystem::remove(path);
        const ProgramRun failed = run(words);
        EXPECT_EQ(failed.exit_code, 1);
        EXPECT_THAT(failed.messages, HasSubstr("synthetic:ball?size=64: no straight line from "
                                               "outside meets a surface at 9000; values are "));
        EXPECT_FALSE(std::filesystem::exists(path));
        EXPECT_FALSE(std::filesystem::exists(strokes));
    }
}

TEST_F(StarterFiles, OtherOptionsBesideThemAreSaid) {
    const std::string ball = "synthetic:ball?size=64", out = file("f").string();
    ProgramRun ran = run({"touch", ball, "--write-path", out, "--radius", "2"});
    EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.messages, HasSubstr("--radius (with --write-path)"));
    ran = run({"edit", ball, "--write-strokes", out, "--undo", "1"});
    EXPECT_EQ(ran.exit_code, 0) << ran.messages;
    EXPECT_THAT(ran.messages, HasSubstr("--undo (with --write-strokes)"));
    ran = run({"edit", ball, out, "--write-strokes", out});
    EXPECT_EQ(ran.exit_code, 2);
    ran = run({"touch", ball, "--write-path", out, "--path", out});
    EXPECT_EQ(ran.exit_code, 2);
    ran = run({"edit", ball, out}); // the strokes are there, and where to is not
    EXPECT_EQ(ran.exit_code, 2);
    EXPECT_THAT(ran.messages, HasSubstr("expected -o FILE"));
}

// One way to name what is written: -o, or --output.
TEST_F(StarterFiles, EveryCommandThatWritesTakesOutput) {
    for (const char* command :
         {"edit", "filter", "project", "render", "seeds", "segment", "surface", "touch"}) {
        const ProgramRun help = run({command, "--help"});
        EXPECT_THAT(help.output, HasSubstr("-o,--output")) << command;
    }
    const std::string ball = "synthetic:ball?size=32";
    EXPECT_EQ(
        run({"filter", ball, "--gaussian", "1", "--output", file("f.nrrd").string()}).exit_code, 0);
    EXPECT_EQ(run({"surface", ball, "--iso", "500", "--output", file("s.ply").string()}).exit_code,
              0);
    EXPECT_TRUE(std::filesystem::exists(file("f.nrrd")));
    EXPECT_TRUE(std::filesystem::exists(file("s.ply")));
}

} // namespace
} // namespace palpate
