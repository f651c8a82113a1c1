// palpate touch, as a person runs it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/program.h"

namespace palpate {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class TouchCommand : public ProgramTest {
 protected:
    // The report's columns by name; those that are no numbers are left out.
    std::map<std::string, std::vector<double>> table(const std::string& name) const {
        std::istringstream text(bytes_of(name));
        std::string line, cell;
        std::getline(text, line);
        std::vector<std::string> names;
        for (std::istringstream head(line); std::getline(head, cell, ',');)
            names.push_back(cell);
        std::map<std::string, std::vector<double>> columns;
        while (std::getline(text, line)) {
            std::istringstream row(line);
            for (size_t c = 0; std::getline(row, cell, ','); ++c)
                if (names.at(c) != "contact" && names.at(c) != "faults")
                    columns[names.at(c)].push_back(std::stod(cell));
        }
        return columns;
    }
    void write_path() const {
        // Down onto a ball of 35 mm radius from 8 mm above it, 3 mm deep, and up again.
        write("path.csv",
              "time_s,x_mm,y_mm,z_mm,button\n0,0,0,43,0\n0.4,0,0,32,0\n0.6,0,0,32,1\n1,0,0,43,0\n");
    }
    std::vector<std::string> arguments(const std::string& algorithm) const {
        return {"touch",       "synthetic:ball?size=64",
                "--path",      file("path.csv").string(),
                "--iso",       "500",
                "--report",    file("r.csv").string(),
                "--device",    "exact",
                "--algorithm", algorithm};
    }
};

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

TEST_F(TouchCommand, SaysWhatIsWrong) {
    write_path();
    EXPECT_EQ(run({"touch", "synthetic:ball"}).exit_code, 2); // no motion
    EXPECT_EQ(run({"touch", "synthetic:ball", "--path", "a", "--trajectory", "press"}).exit_code,
              2);
    ProgramRun bad = run({"touch", "synthetic:ball", "--trajectory", "hop", "--algorithm", "none"});
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_THAT(bad.messages, HasSubstr("--trajectory: expected one of press, touch"));
    bad = run({"touch", "synthetic:ball", "--trajectory", "press", "--algorithm", "magic"});
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_THAT(bad.messages, HasSubstr("--algorithm: expected one of none"));
    std::vector<std::string> command = arguments("none");
    command[9] = "toaster";
    bad = run(command);
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_THAT(bad.messages, HasSubstr("--device: expected one of falcon, touch, omega"));
    write("path.csv", "time_s,x_mm,y_mm,z_mm\n0,0,zero,0\n");
    bad = run(arguments("none"));
    EXPECT_EQ(bad.exit_code, 1);
    EXPECT_THAT(bad.messages, HasSubstr("path.csv:2: y_mm: expected a number, found 'zero'"));
}

} // namespace
} // namespace palpate
