// palpate touch with a tool that changes the volume: what is felt of it meanwhile, what is written,
// and what is left after a kill.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "tests/cli/touch_command.h"
#include "tests/support/given.h"
#include "tests/support/kill.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TEST_F(TouchCommand, DrillingLeavesAHoleInTheVolumeThatIsWritten) {
    write_path();
    std::vector<std::string> command = arguments("none");
    command.insert(command.end(), {"--drill", "3", "-o", file("out.nrrd").string()});
    const ProgramRun done = run(command);
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    const auto t = table("r.csv");
    // From 0.6 s on the button is pressed, 3 mm within the ball at first: the version rises with
    // the cuts.
    EXPECT_EQ(t.at("volume_version")[500], t.at("volume_version")[0]);
    EXPECT_GT(t.at("volume_version")[700], t.at("volume_version")[500]);
    const ProgramRun compared =
        run({"compare", "synthetic:ball?size=64", file("out.nrrd").string()});
    EXPECT_EQ(compared.exit_code, 1);
}

// The mesh follows the drill: the proxy sinks after it, and without a cut it stays.
TEST_F(TouchCommand, AMeshIsDrilledAndFeltWhileItHappens) {
    write_path();
    double proxy_mm[2];
    for (const bool cuts : {false, true}) {
        std::vector<std::string> command = arguments("swept-mesh");
        if (cuts)
            command.insert(command.end(), {"--drill", "3", "-o", file("out.nrrd").string()});
        const ProgramRun done = run(command);
        ASSERT_EQ(done.exit_code, 0) << done.messages;
        const auto t = table("r.csv");
        proxy_mm[cuts] =
            *std::min_element(t.at("proxy_z_mm").begin() + 610, t.at("proxy_z_mm").begin() + 660);
    }
    EXPECT_NEAR(proxy_mm[0], 35.0, 0.2);
    EXPECT_LT(proxy_mm[1], proxy_mm[0] - 1.0);
}

// Button 1 adds what button 0 removes.
TEST_F(TouchCommand, TheSecondButtonAdds) {
    write("path.csv",
          "time_s,x_mm,y_mm,z_mm,button\n0,0,0,43,0\n0.4,0,0,34,0\n0.5,0,0,34,2\n0.7,0,0,34,0\n");
    std::vector<std::string> command = arguments("none");
    command.insert(command.end(),
                   {"--drill", "2", "--second-edit", R"({"kind": "cut", "to_value": 1000})", "-o",
                    file("out.nrrd").string()});
    const ProgramRun done = run(command);
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    const auto t = table("r.csv");
    EXPECT_GT(t.at("volume_version").back(), t.at("volume_version")[0]);
    EXPECT_EQ(run({"compare", "synthetic:ball?size=64", file("out.nrrd").string()}).exit_code, 1);
}

// Vidholm & Agmund, section 5: erosion and the like are felt in S, drawing in the gradient of V.
TEST_F(TouchCommand, AnEditOfLabelsIsFeltWhileItHappens) {
    write_two_labels();
    // In contact at -1.5 mm; from 0.5 s on the button is pressed: one layer of 1 mm goes.
    write("path.csv",
          "time_s,x_mm,y_mm,z_mm,button\n0,-6,0,3,0\n0.3,-6,0,-1.5,0\n0.5,-6,0,-1.5,1\n"
          "1,-6,0,-1.5,1\n");
    const auto forces = [&](const char* kind) {
        std::vector<std::string> command = arguments("swept-point");
        command[1] = file("labels.nrrd").string();
        command.insert(command.end(),
                       {"--edit", kind, "--tool", R"({"kind": "ball", "radius_mm": 4})", "-o",
                        file("out.nrrd").string()});
        const ProgramRun done = run(command);
        EXPECT_EQ(done.exit_code, 0) << done.messages;
        EXPECT_EQ(
            run({"compare", file("labels.nrrd").string(), file("out.nrrd").string()}).exit_code, 1);
        const auto t = table("r.csv");
        EXPECT_GT(t.at("volume_version").back(), t.at("volume_version").front());
        return std::pair{t.at("force_z_n")[450], t.at("force_z_n").back()};
    };
    // 500 N/m; an erosion and a dilation move the surface by one sample.
    const auto [before, eroded] = forces(R"({"kind": "erode", "label": 1})");
    EXPECT_NEAR(before, 0.5, 0.2); // 1 mm within 0.4 samples
    EXPECT_NEAR(before - eroded, 0.5, 0.1);
    const auto [same, dilated] = forces(R"({"kind": "dilate", "label": 1})");
    EXPECT_EQ(same, before);
    EXPECT_NEAR(dilated - before, 0.5, 0.1);
    EXPECT_EQ(forces(R"({"kind": "erase"})").second, 0.0);
}

TEST_F(TouchCommand, DrawingIsFeltInTheGradientOfTheGreyValues) {
    write_nrrd("v.nrrd", "int16", [](int, int z) { return z < 0 ? 1000 : 0; });
    write_nrrd("s.nrrd", "uint8", [](int, int) { return 0; });
    write("path.csv", "time_s,x_mm,y_mm,z_mm,button\n0,0,0,-6,1\n1,0,0,4,1\n");
    std::vector<std::string> command = arguments("wish-2008-potential");
    command[1] = file("v.nrrd").string();
    command.insert(command.end(),
                   {"--labels", file("s.nrrd").string(), "--transfer", "0.3", "--edit",
                    R"({"kind": "draw", "label": 3})", "--tool",
                    R"({"kind": "ball", "radius_mm": 2})", "-o", file("out.nrrd").string()});
    const ProgramRun done = run(command);
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    const auto t = table("r.csv");
    // The edge lies between z = -1 and 0, which the way passes at 0.5 s to 0.6 s: there the
    // gradient points down, with the strength of the transfer function. It is flat elsewhere. The
    // way leads against the force; along it, the passivity controller would damp it.
    EXPECT_NEAR(t.at("force_z_n")[550], -0.3, 0.001);
    EXPECT_EQ(t.at("force_x_n")[550], 0.0);
    EXPECT_EQ(t.at("force_z_n")[200], 0.0);
    EXPECT_EQ(t.at("force_z_n")[900], 0.0);
    const json info = json::parse(run({"info", "--json", file("out.nrrd").string()}).output);
    EXPECT_EQ(info["range"], json({0, 3}));
}

// Three strokes into a ball that lies in a file.
class CarvingTouch : public TouchCommand {
 protected:
    CarvingTouch() {
        EXPECT_EQ(run({"convert", "synthetic:ball?size=48", file("in.nrrd").string()}).exit_code,
                  0);
        std::string path = "time_s,x_mm,y_mm,z_mm,button\n0,0,0,43,0\n";
        for (int stroke = 0; stroke < 3; ++stroke)
            for (const auto& [time_s, y_mm, button] :
                 {std::tuple{0.1, -8, 1}, {0.2, 8, 0}, {0.3, 8, 0}})
                path += fmt::format("{},{},{},34,{}\n", 0.3 * stroke + time_s, 8 * stroke - 8, y_mm,
                                    button);
        write("path.csv", path);
    }
    std::vector<std::string> touch(const std::vector<std::string>& more = {}) const {
        std::vector<std::string> all{"touch",       file("in.nrrd").string(),
                                     "--path",      file("path.csv").string(),
                                     "--iso",       "500",
                                     "--algorithm", "swept-point",
                                     "--device",    "exact",
                                     "--drill",     "4",
                                     "-o",          file("out.nrrd").string()};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    ProgramRun edit(const std::vector<std::string>& more, const char* out = "out.nrrd") const {
        std::vector<std::string> all{"edit", file("in.nrrd").string(), "--recover", "-o",
                                     file(out).string()};
        all.insert(all.end(), more.begin(), more.end());
        return run(all);
    }
    bool exists(const char* name) const { return std::filesystem::exists(file(name)); }
};

TEST_F(CarvingTouch, StrokesAreTakenBackAndDoneAgainToTheByte) {
    ASSERT_EQ(run(touch({"--journal"})).exit_code, 0);
    const std::string touched = bytes_of("out.nrrd"), journal = bytes_of("out.nrrd.journal");
    ASSERT_NE(touched, bytes_of("in.nrrd"));
    // The journal gives what was written, and all taken back gives what there was.
    ASSERT_EQ(edit({}).exit_code, 0);
    EXPECT_EQ(bytes_of("out.nrrd"), touched);
    EXPECT_FALSE(exists("out.nrrd.journal"));
    write("out.nrrd.journal", journal);
    const ProgramRun back = edit({"--undo", "3"});
    ASSERT_EQ(back.exit_code, 0) << back.messages;
    const ProgramRun same =
        run({"convert", file("in.nrrd").string(), file("as_written.nrrd").string()});
    ASSERT_EQ(same.exit_code, 0) << same.messages;
    EXPECT_EQ(bytes_of("out.nrrd"), bytes_of("as_written.nrrd"));
    write("out.nrrd.journal", journal);
    EXPECT_THAT(edit({"--undo", "4"}).messages, HasSubstr("at most 3 strokes to take back"));
    // Each stroke alone is another volume.
    ASSERT_EQ(edit({"--undo", "1"}).exit_code, 0);
    EXPECT_NE(bytes_of("out.nrrd"), touched);
    EXPECT_NE(bytes_of("out.nrrd"), bytes_of("as_written.nrrd"));
    // Without the option nothing is left; with what another run left, none begins.
    ASSERT_EQ(run(touch()).exit_code, 0);
    EXPECT_EQ(bytes_of("out.nrrd"), touched);
    EXPECT_FALSE(exists("out.nrrd.journal"));
    write("out.nrrd.journal", journal);
    const ProgramRun again = run(touch());
    EXPECT_EQ(again.exit_code, 1);
    EXPECT_THAT(again.messages, HasSubstr("out.nrrd.journal: holds strokes"));
    EXPECT_EQ(bytes_of("out.nrrd.journal"), journal);
}

TEST_F(CarvingTouch, LabelsBesideTheValuesAreTakenBack) {
    write_two_labels();
    write_nrrd("v.nrrd", "int16", [](int x, int) { return x < 3 ? 1000 : 0; });
    write("path.csv", "time_s,x_mm,y_mm,z_mm,button\n0,-8,0,-6,1\n0.5,8,0,-6,0\n");
    const auto out = file("out.nrrd").string();
    const ProgramRun done =
        run({"touch", file("v.nrrd").string(), "--labels", file("labels.nrrd").string(), "--path",
             file("path.csv").string(), "--device", "exact", "--algorithm", "none", "--edit",
             R"({"kind": "draw", "label": 5, "only_values": [500, 2000]})", "--tool",
             R"({"kind": "ball", "radius_mm": 3})", "-o", out, "--journal"});
    ASSERT_EQ(done.exit_code, 0) << done.messages;
    const std::string touched = bytes_of("out.nrrd"), journal = bytes_of("out.nrrd.journal");
    const auto edit_labels = [&](const std::vector<std::string>& more) {
        write("out.nrrd.journal", journal);
        std::vector<std::string> all{"edit", file("labels.nrrd").string(), "--recover", "-o", out};
        all.insert(all.end(), more.begin(), more.end());
        return run(all);
    };
    EXPECT_THAT(edit_labels({}).messages, HasSubstr("begun with a 'guide', and none is given"));
    ASSERT_EQ(edit_labels({"--guide", file("v.nrrd").string()}).exit_code, 0);
    EXPECT_EQ(bytes_of("out.nrrd"), touched);
    ASSERT_EQ(edit_labels({"--guide", file("v.nrrd").string(), "--undo", "1"}).exit_code, 0);
    const ProgramRun same = run({"compare", file("labels.nrrd").string(), out});
    EXPECT_EQ(same.exit_code, 0) << same.output;
    EXPECT_NE(bytes_of("out.nrrd"), touched);
}

// Whenever a touch is killed, the strokes that had ended are in its journal, and lead to what
// so many strokes leave.
TEST_F(CarvingTouch, ThatIsKilledLosesNoStrokeThatHadEnded) {
    std::vector<std::string> after{""}; // by number of strokes
    ASSERT_EQ(run(touch({"--journal"})).exit_code, 0);
    const std::string journal = bytes_of("out.nrrd.journal");
    for (const char* undo : {"3", "2", "1", "0"}) {
        write("out.nrrd.journal", journal);
        ASSERT_EQ(edit({"--undo", undo}).exit_code, 0);
        after.push_back(bytes_of("out.nrrd"));
    }
    std::filesystem::remove(file("out.nrrd"));
    const auto strokes_of = [](const std::string& bytes) {
        size_t count = 0;
        for (size_t at = 0; (at = bytes.find("{\"stroke\"", at)) != bytes.npos; ++at)
            ++count;
        return count;
    };
    std::map<size_t, int> kept;
    kill_at_many_moments(
        int(given("PALPATE_KILLS", 6)), [&] { return become_program(touch()); },
        [&] {
            if (exists("out.nrrd")) {
                ASSERT_EQ(bytes_of("out.nrrd"), after.back());
            } else if (exists("out.nrrd.journal")) {
                const size_t whole = strokes_of(bytes_of("out.nrrd.journal"));
                const ProgramRun done = edit({});
                if (done.exit_code != 0) { // none had ended, or the one that was being written
                    ASSERT_LE(whole, 1u) << done.messages;
                    ASSERT_THAT(done.messages, HasSubstr("nothing to recover"));
                } else {
                    const auto state =
                        std::find(after.begin() + 2, after.end(), bytes_of("out.nrrd"));
                    ASSERT_NE(state, after.end());
                    const auto count = static_cast<size_t>(state - after.begin()) - 1;
                    ASSERT_TRUE(count == whole || count + 1 == whole); // the last may be cut
                    ++kept[count];
                }
            }
            for (const char* name : {"out.nrrd", "out.nrrd.journal"})
                std::filesystem::remove(file(name));
        });
    for (const auto& [count, times] : kept)
        std::printf("    %zu strokes kept: %d times\n", count, times);
}

} // namespace
} // namespace palpate
