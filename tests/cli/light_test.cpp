// palpate render --light and --ambient-occlusion. Pictures are held against the twin in tests/gpu.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "engine/image/exr.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

class LightOptions : public ProgramTest {
 protected:
    ProgramRun render(const std::string& input, const std::string& out,
                      std::vector<std::string> more) const {
        more.insert(more.begin(), {"render", input, "-o", file(out).string(), "--size", "48,48"});
        return run(more);
    }
    // Mean of a channel over a half of the picture: 0 left, 1 right.
    double mean_of_half(const std::string& picture, uint32_t half) const {
        const Image image = load_exr(file(picture))->image;
        double sum = 0.0;
        for (uint32_t y = 0; y < image.size_px.y; ++y)
            for (uint32_t x = 0; x < image.size_px.x / 2; ++x)
                sum +=
                    image.at(x + half * image.size_px.x / 2, y, channel_index(image, "R").value());
        return sum;
    }
};

const std::string kBall = "synthetic:ball?size=48";

TEST_F(LightOptions, LightComesFromTheSideThatIsNamed) {
    const std::vector<std::string> ball{"--iso", "500", "--view", "front", "--light"};
    const auto from = [&](const char* light, const char* out) {
        std::vector<std::string> words = ball;
        words.push_back(light);
        const ProgramRun ran = render(kBall, out, words);
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_THAT(ran.messages, ::testing::Not(HasSubstr("warning")));
    };
    from("60,0", "right.exr");
    from("-60,0", "left.exr");
    EXPECT_GT(mean_of_half("right.exr", 1), 1.5 * mean_of_half("right.exr", 0));
    EXPECT_GT(mean_of_half("left.exr", 0), 1.5 * mean_of_half("left.exr", 1));
}

// The phantom has hollows; occlusion darkens and brightens nothing. The scene that is written draws
// the same picture.
TEST_F(LightOptions, OcclusionDarkensAndSceneFilesKeepBoth) {
    const std::string phantom = "synthetic:phantom?size=48";
    const std::string scene = file("scene.json").string();
    ASSERT_EQ(render(phantom, "plain.exr", {"--iso", "-300"}).exit_code, 0);
    const ProgramRun ran =
        render(phantom, "occluded.exr", {"--iso", "-300", "--ambient-occlusion", "30"});
    ASSERT_EQ(ran.exit_code, 0) << ran.messages;
    const Image plain = load_exr(file("plain.exr"))->image;
    const Image occluded = load_exr(file("occluded.exr"))->image;
    double darker = 0.0;
    for (uint32_t y = 0; y < 48; ++y)
        for (uint32_t x = 0; x < 48; ++x) {
            EXPECT_LE(occluded.at(x, y, 0), plain.at(x, y, 0) + 1e-6);
            darker = std::max<double>(darker, plain.at(x, y, 0) - occluded.at(x, y, 0));
        }
    EXPECT_GT(darker, 0.02);
    ASSERT_EQ(render(phantom, "both.exr",
                     {"--iso", "-300", "--ambient-occlusion", "30", "--light", "40,30",
                      "--write-scene", scene})
                  .exit_code,
              0);
    const auto json = nlohmann::json::parse(bytes_of("scene.json"));
    EXPECT_EQ(json["ray_cast"]["ambient_occlusion_mm"], 30);
    EXPECT_EQ(json["ray_cast"]["light"],
              nlohmann::json({{"azimuth_deg", 40}, {"elevation_deg", 30}}));
    const ProgramRun again = run({"render", scene, "-o", file("again.exr").string()});
    ASSERT_EQ(again.exit_code, 0) << again.messages;
    const Image both = load_exr(file("both.exr"))->image;
    EXPECT_EQ(load_exr(file("again.exr"))->image.samples, both.samples);
    EXPECT_NE(both.samples, occluded.samples);
}

TEST_F(LightOptions, SayWhereTheyHaveNoEffectAndWhatIsWrong) {
    const auto says = [&](std::vector<std::string> words, int code, const char* text) {
        const ProgramRun ran = render(kBall, "x.png", std::move(words));
        EXPECT_EQ(ran.exit_code, code) << ran.messages;
        EXPECT_THAT(ran.messages, HasSubstr(text));
    };
    says({"--mode", "mip", "--light", "10,10"}, 0, "--light (nothing is shaded)");
    says({"--mode", "alpha", "--no-shade", "--light", "10,10"}, 0, "--light (nothing is shaded)");
    says({"--mode", "alpha", "--ambient-occlusion", "5"}, 0, "--ambient-occlusion (of mode iso)");
    says({"--slice", "axial", "--light", "10,10"}, 0, "--light (without ray casting");
    says({"--iso", "500", "--light", "10,95"}, 2, "--light: expected an elevation from -90 to 90");
    says({"--iso", "500", "--light", "10"}, 2, "--light");
    says({"--iso", "500", "--ambient-occlusion", "-1"}, 2, "--ambient-occlusion");
    EXPECT_THAT(run({"render", "--help"}).output, HasSubstr("not a simulation of light"));
}

} // namespace
} // namespace palpate
