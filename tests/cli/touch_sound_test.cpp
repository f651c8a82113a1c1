#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "tests/cli/touch_command.h"

namespace palpate {
namespace {

class TouchSound : public TouchCommand {
 protected:
    std::vector<std::string> drill(const std::string& sound, double vibration_n = 0.0) const {
        return {"touch",       "synthetic:ball?size=64",
                "--path",      file("path.csv").string(),
                "--iso",       "500",
                "--device",    "exact",
                "--drill",     "3",
                "--vibration", std::to_string(vibration_n),
                "--sound",     file(sound).string()};
    }
    // The largest sample from `begin_s` to `end_s`.
    int loudest(const std::string& name, double begin_s, double end_s) const {
        const std::string bytes = bytes_of(name);
        int most = 0;
        for (auto i = static_cast<size_t>(begin_s * 44100); i < static_cast<size_t>(end_s * 44100);
             ++i) {
            int16_t sample = 0;
            if (46 + 2 * i > bytes.size())
                break;
            std::memcpy(&sample, bytes.data() + 44 + 2 * i, 2);
            most = std::max<int>(most, std::abs(sample));
        }
        return most;
    }
};

// write_path() presses the button from 0.6 to 1 s, 3 mm deep in the ball.
TEST_F(TouchSound, IsHeardWhileMaterialGoesAndTheSameEachTime) {
    write_path();
    const ProgramRun first = run(drill("a.wav")), second = run(drill("b.wav"));
    ASSERT_EQ(first.exit_code, 0) << first.messages;
    ASSERT_EQ(second.exit_code, 0) << second.messages;
    EXPECT_EQ(bytes_of("a.wav"), bytes_of("b.wav"));
    EXPECT_GT(loudest("a.wav", 0.6, 0.7), 1000);
    EXPECT_EQ(loudest("a.wav", 0.0, 0.59), 0);
    EXPECT_EQ(loudest("a.wav", 0.9, 1.0), 0);
    EXPECT_GT(nlohmann::json::parse(first.output).at("removed_mm3").get<double>(), 10.0);
}

TEST_F(TouchSound, IsSilentWithoutAnEditAndSaysSo) {
    write_path();
    std::vector<std::string> arguments = drill("a.wav");
    arguments.erase(std::find(arguments.begin(), arguments.end(), "--drill"),
                    std::find(arguments.begin(), arguments.end(), "--vibration"));
    const ProgramRun result = run(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.messages;
    EXPECT_THAT(result.messages, testing::HasSubstr("--sound"));
    EXPECT_EQ(loudest("a.wav", 0.0, 1.0), 0);
    EXPECT_EQ(bytes_of("a.wav").size(), 44 + 2 * 44100u);
}

} // namespace
} // namespace palpate
