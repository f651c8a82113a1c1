// palpate devices, and `palpate touch --device`.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class DevicesCommand : public ProgramTest {};

TEST_F(DevicesCommand, ListsEachByNumberAndNameInTextAndJson) {
    const ProgramRun text = run({"devices"}), listed = run({"devices", "--json"});
    ASSERT_EQ(text.exit_code, 0);
    ASSERT_EQ(listed.exit_code, 0);
    const json devices = json::parse(listed.output)["devices"];
    ASSERT_GE(devices.size(), 6u);
    for (size_t i = 0; i < devices.size(); ++i) {
        EXPECT_EQ(devices[i]["number"], i);
        EXPECT_THAT(text.output, HasSubstr(std::to_string(i) + ": " +
                                           devices[i]["name"].get<std::string>() + " ("));
    }
    const json falcon = json::parse(run({"devices", "falcon", "--json"}).output)["devices"];
    ASSERT_EQ(falcon.size(), 1u);
    EXPECT_EQ(falcon[0], devices[falcon[0]["number"].get<size_t>()]);
    EXPECT_EQ(falcon[0]["max_force_n"], 8);
    EXPECT_EQ(falcon[0]["workspace_mm"], (json{100, 100, 100}));
}

TEST_F(DevicesCommand, ADeviceThatIsNotThereIsWrongUsageAndSaysWhichAre) {
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"devices", "harp"},
          {"touch", "synthetic:ball", "--trajectory", "press", "--report", "-", "--device",
           "harp"}}) {
        const ProgramRun ran = run(command);
        EXPECT_EQ(ran.exit_code, 2);
        EXPECT_THAT(ran.messages, HasSubstr("expected a device, one of falcon, touch"));
        EXPECT_THAT(ran.messages, HasSubstr("recorded:FILE or its number, found 'harp'"));
    }
}

TEST_F(DevicesCommand, WithoutHomingItSaysSo) {
    const ProgramRun ran = run({"devices", "falcon", "--home"});
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("without homing"));
    EXPECT_EQ(run({"devices", "falcon", "--calibrate"}).exit_code, 0);
    EXPECT_EQ(run({"devices", "--home"}).exit_code, 2);
}

// On a simulated device, which pushes only where it is allowed to.
TEST_F(DevicesCommand, TheOwnersChecklistSaysWhatADeviceDoes) {
    const ProgramRun ran =
        run({"devices", "test", "falcon", "--arm", "--move", "0.5", "--report",
             file("falcon.json").string(), "--page", file("falcon.html").string()});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json report = json::parse(bytes_of("falcon.json"));
    EXPECT_EQ(report["device"]["name"], "falcon");
    EXPECT_EQ(report["times"]["exchanges"], 2000);
    EXPECT_GE(report["times"]["p50_ms"], 0.9); // the servo's millisecond
    EXPECT_EQ(report["was_homed"], true);
    ASSERT_EQ(report["pushes"].size(), 6u);
    for (const json& push : report["pushes"]) {
        EXPECT_GT(push["moved_mm"].back(), 0.1);
        EXPECT_EQ(push["was_stopped"], false);
    }
    EXPECT_THAT(bytes_of("falcon.html"), HasSubstr("Push of 1 N along (0, 0, -1)"));
    // Nobody answers the question whether it may push.
    const ProgramRun unarmed =
        run({"devices", "test", "touch", "--move", "0", "--report", file("touch.json").string()});
    ASSERT_EQ(unarmed.exit_code, 0) << unarmed.messages;
    EXPECT_THAT(unarmed.messages, HasSubstr("Type yes"));
    EXPECT_TRUE(json::parse(bytes_of("touch.json"))["pushes"].empty());
}

TEST_F(DevicesCommand, ATestNeedsADeviceAndItsOptionsATest) {
    for (const std::vector<std::string>& command : {std::vector<std::string>{"devices", "test"},
                                                    {"devices", "falcon", "touch"},
                                                    {"devices", "falcon", "--arm"},
                                                    {"devices", "test", "falcon", "--json"},
                                                    {"devices", "test", "harp"},
                                                    {"devices", "--report", "a.json"}})
        EXPECT_EQ(run(command).exit_code, 2) << command.back();
}

// A recording played through the same path gives the forces that were recorded, to the bit.
TEST_F(DevicesCommand, ARecordingIsADeviceAndGivesTheSameForces) {
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,0,0,43\n0.4,0,0,32\n0.6,0,0,32\n");
    const auto touch = [&](const std::string& device, const std::string& report) {
        return run({"touch", "synthetic:ball", "--path", file("path.csv").string(), "--device",
                    device, "--report", file(report).string(), "--record",
                    file(report + ".log").string()});
    };
    ASSERT_EQ(touch("falcon", "made.csv").exit_code, 0);
    ASSERT_EQ(touch("recorded:" + file("made.csv.log").string(), "played.csv").exit_code, 0);
    EXPECT_GT(bytes_of("made.csv.log").size(), 1000u);
    EXPECT_EQ(bytes_of("made.csv.log"), bytes_of("played.csv.log"));
    // By number: the same device.
    const json falcon = json::parse(run({"devices", "falcon", "--json"}).output)["devices"][0];
    ASSERT_EQ(touch(falcon["number"].dump(), "numbered.csv").exit_code, 0);
    EXPECT_EQ(bytes_of("made.csv.log"), bytes_of("numbered.csv.log"));
    EXPECT_EQ(touch("recorded:none.log", "none.csv").exit_code, 1);
    EXPECT_THAT(touch("recorded:" + file("made.csv.log").string(), "made.csv").messages,
                HasSubstr("--device"));
}

} // namespace
} // namespace palpate
