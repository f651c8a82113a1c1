// --profile: the trace of a run, held against the run's own figures.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class ProfileOption : public ProgramTest {
 protected:
    std::vector<std::string> command(const std::vector<std::string>& more) const {
        std::vector<std::string> all{"render", "synthetic:phantom?size=48", "--size", "96,80",
                                     "-o",     file("picture.png").string()};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
};

double start_of(const json& span) {
    return span["ts"].get<double>();
}
double end_of(const json& span) {
    return start_of(span) + span["dur"].get<double>();
}
constexpr double kRounding = 2e-3; // microseconds: times are whole nanoseconds, twice rounded

TEST_F(ProfileOption, ShowsEveryPassEveryCopyAndEveryThreadInsideTheRun) {
    const ProgramRun ran = run(
        command({"--slice", "axial", "--iso", "300", "--frames", "3", "--orbit-deg", "4", "--stats",
                 file("stats.json").string(), "--profile", file("trace.json").string()}));
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json stats = json::parse(bytes_of("stats.json"));
    const json trace = json::parse(bytes_of("trace.json"));
    EXPECT_EQ(trace["otherData"]["dropped_spans"], 0);

    std::map<std::pair<int, int>, std::vector<json>> lines;
    std::map<std::pair<int, int>, std::string> names;
    for (const json& event : trace["traceEvents"]) {
        const std::pair<int, int> line{event["pid"], event["tid"]};
        if (event["ph"] == "X")
            lines[line].push_back(event);
        else if (event["name"] == "thread_name")
            names[line] = event["args"]["name"];
    }
    const json *whole = nullptr, *estimate = nullptr;
    for (const auto& [line, spans] : lines)
        for (const json& span : spans) {
            if (span["name"] == "command")
                whole = &span;
            if (span["name"] == "error estimate")
                estimate = &span;
        }
    ASSERT_NE(whole, nullptr);
    ASSERT_NE(estimate, nullptr);
    const auto is_of_frames = [&](const json& span) { // and not of pictures that judge them
        return end_of(span) <= start_of(*estimate) || start_of(span) >= end_of(*estimate);
    };

    std::map<std::string, int> passes;
    double copied_to = 0, copied_from = 0, first_uses = 0;
    for (const auto& [line, spans] : lines) {
        ASSERT_TRUE(names.contains(line));
        std::vector<const json*> open; // those that the next span may lie in
        double last_start = 0;
        for (const json& span : spans) {
            // Inside the run, and in order of time.
            EXPECT_GE(start_of(span), start_of(*whole) - kRounding) << span;
            EXPECT_LE(end_of(span), end_of(*whole) + kRounding) << span;
            EXPECT_GE(start_of(span), last_start) << span;
            EXPECT_GE(span["dur"].get<double>(), 0.0) << span;
            last_start = start_of(span);
            // Within or beside every other span of its line.
            while (!open.empty() && end_of(*open.back()) <= start_of(span) + kRounding)
                open.pop_back();
            if (!open.empty()) {
                EXPECT_LE(end_of(span), end_of(*open.back()) + kRounding)
                    << span << " crosses the end of " << *open.back();
            }
            open.push_back(&span);
            if (names[line] == "passes" && is_of_frames(span))
                ++passes[span["name"]];
            if (names[line] == "copies" && is_of_frames(span))
                (span["name"] == "upload" ? copied_to : copied_from) +=
                    span["args"]["bytes"].get<double>();
            if (names[line] == "pipelines, first use")
                ++first_uses;
        }
    }
    // One frame that warms up, three that are timed, and the one that counts samples for --stats.
    ASSERT_FALSE(stats["passes"].empty());
    for (const json& pass : stats["passes"])
        EXPECT_EQ(passes[pass["name"]], 5) << pass;
    EXPECT_EQ(passes.size(), stats["passes"].size());
    EXPECT_EQ(copied_to, stats["bytes_moved"]["to_device"].get<double>());
    EXPECT_EQ(copied_from, stats["bytes_moved"]["from_device"].get<double>());
    // Slices and ray cast are compiled apart, and each once.
    EXPECT_GE(first_uses, 2);
}

TEST_F(ProfileOption, BytesMovedAreTheVolumeAndThePicture) {
    const ProgramRun ran =
        run(command({"--mode", "mip", "--volume-format", "r16", "--stats", "-"}));
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json moved = json::parse(ran.output)["bytes_moved"];
    // Whole bricks are converted, but only what lies inside the volume is copied: 2 bytes each.
    EXPECT_GE(moved["to_device"], 48 * 48 * 48 * 2);
    EXPECT_EQ(moved["from_device"], 96 * 80 * 4 * 4); // R, G, B, A as floats
    EXPECT_EQ(moved["read_backs"], 1);
}

TEST_F(ProfileOption, BothClocksAreInTheStatsAndTheirDisagreementIsSaid) {
    const ProgramRun ran = run(command({"--frames", "3", "--stats", file("stats.json").string()}));
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const json clocks = json::parse(bytes_of("stats.json"))["clocks"];
    EXPECT_GT(clocks["gpu_ms"], 0.0);
    EXPECT_GT(clocks["fenced_wall_ms"], 0.0);
    // Whichever way it is, message and figure say the same.
    EXPECT_EQ(clocks["agree"].get<bool>(), clocks["disagreement"].get<double>() <= 0.1);
    EXPECT_EQ(clocks["agree"].get<bool>(),
              ran.messages.find("GPU timestamps give") == std::string::npos)
        << ran.messages << clocks;
}

TEST_F(ProfileOption, OffThereIsNoFileAndThePictureIsTheSame) {
    ASSERT_EQ(run(command({})).exit_code, 0);
    const std::string plain = bytes_of("picture.png");
    EXPECT_FALSE(std::filesystem::exists(file("trace.json")));
    ASSERT_EQ(run(command({"--profile", file("trace.json").string()})).exit_code, 0);
    EXPECT_TRUE(std::filesystem::exists(file("trace.json")));
    EXPECT_EQ(plain, bytes_of("picture.png"));
}

TEST_F(ProfileOption, WorksForEveryCommandAndFailsWithOneSentence) {
    ASSERT_EQ(run({"doctor", "--profile", file("trace.json").string()}).exit_code, 0);
    EXPECT_THAT(bytes_of("trace.json"), HasSubstr("\"command\""));
    const ProgramRun ran = run(command({"--profile", file("no/folder/trace.json").string()}));
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.messages, HasSubstr("trace.json: cannot be written"));
    // A command that fails leaves no trace.
    EXPECT_EQ(run({"render", "no/such/file.nrrd", "-o", file("p.png").string(), "--profile",
                   file("failed.json").string()})
                  .exit_code,
              1);
    EXPECT_FALSE(std::filesystem::exists(file("failed.json")));
}

} // namespace
} // namespace palpate
