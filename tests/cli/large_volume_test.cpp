// Volumes that are larger than what they are given, at the sizes that users have.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "engine/image/exr.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;

class LargeVolume : public ProgramTest {
 protected:
    nlohmann::json render(const std::string& volume, const std::string& out,
                          const std::vector<std::string>& more) const {
        std::vector<std::string> all{"render",  volume,    "--mode", "alpha", "--size",
                                     "512,512", "--stats", "-",      "-o",    file(out).string()};
        all.insert(all.end(), more.begin(), more.end());
        const ProgramRun ran = run(all);
        EXPECT_EQ(ran.exit_code, 0) << ran.messages;
        return ran.exit_code == 0 ? nlohmann::json::parse(ran.output) : nlohmann::json{};
    }
    double share_of_lit_pixels(const std::string& picture) const {
        const Result<ExrFile> loaded = load_exr(file(picture));
        EXPECT_TRUE(loaded);
        const Image& image = loaded->image;
        size_t lit = 0;
        for (uint32_t y = 0; y < image.size_px.y; ++y)
            for (uint32_t x = 0; x < image.size_px.x; ++x)
                lit += image.at(x, y, 0) > 0.1f;
        return static_cast<double>(lit) / (image.size_px.x * static_cast<double>(image.size_px.y));
    }
    void tell(const char* what, const nlohmann::json& stats) const {
        std::printf("    %s: first frame %.0f ms, peak RSS %.2f GiB, %s\n", what,
                    stats["first_frame_ms"].get<double>(),
                    stats["peak_rss_bytes"].get<double>() / kGiB,
                    stats["residency"].dump().c_str());
    }
};

// 256 MiB as one image, and parts of it in 160 MiB. A ray may go on into the next part with less
// light left than a whole volume's ray stops at, 1 / 1024, and a part rounds its sum anew, by at
// most 16 units of 2^-24.
TEST_F(LargeVolume, InPartsGivesThePictureOfTheWhole) {
    const std::string volume = "synthetic:phantom?size=512&type=u16";
    const std::vector<std::string> same_texels{"--volume-format", "r16", "--sampling", "fp32"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.end(), same_texels.begin(), same_texels.end());
        return more;
    };
    const auto dense = render(volume, "dense.exr", with({"--residency", "dense"}));
    const auto parts = render(volume, "parts.exr", with({"--gpu-memory", "160M"}));
    tell("whole", dense);
    tell("parts", parts);
    EXPECT_EQ(parts["residency"]["kind"], "atlas");
    EXPECT_GT(parts["residency"]["parts"], 1);
    const double bound = 1.0 / 1024 + parts["residency"]["parts"].get<double>() * 16.0 / (1 << 24);
    const ProgramRun same =
        run({"compare", file("dense.exr"), file("parts.exr"), "--max", std::to_string(bound)});
    EXPECT_EQ(same.exit_code, 0) << same.output;
    EXPECT_GT(share_of_lit_pixels("parts.exr"), 0.1);
}

TEST_F(LargeVolume, AThousandCubedInOneGibibyteOfTheDevice) {
    const auto stats =
        render("synthetic:phantom?size=1024&type=u16", "picture.exr", {"--gpu-memory", "1G"});
    tell("1024^3", stats);
    EXPECT_EQ(stats["residency"]["kind"], "atlas");
    uint64_t bytes = 0;
    for (const auto& resource : stats["resources"])
        if (resource["kind"] != "staging") // mapped memory of what is on its way, a few times 4 MiB
            bytes += resource["bytes"].get<uint64_t>();
    EXPECT_LE(static_cast<double>(bytes), kGiB);
    EXPECT_GT(share_of_lit_pixels("picture.exr"), 0.1);
}

// 8 GiB of samples from a brick file, in less than 8 GB of memory, coarse picture first. The same
// phantom with a fourth of the samples an axis fits whole: there an outline lies within a sample,
// which is a pixel, of its place, and outlines of less than 2600 pixels bound 1 % of the picture.
TEST_F(LargeVolume, EightGibibytesFromABrickFile) {
    const ProgramRun made =
        run({"convert", "synthetic:phantom?size=2048,2048,1024&type=u16", file("big.pbv")});
    ASSERT_EQ(made.exit_code, 0) << made.messages;
    const auto stats = render(file("big.pbv"), "picture.exr",
                              {"--gpu-memory", "1G", "--preview", file("coarse.exr")});
    tell("2048 x 2048 x 1024", stats);
    EXPECT_LT(stats["peak_rss_bytes"].get<double>(), 8e9);
    const auto small = render("synthetic:phantom?size=512,512,256&type=u16", "small.exr", {});
    EXPECT_EQ(small["residency"]["kind"], "dense");
    const double lit = share_of_lit_pixels("small.exr");
    EXPECT_GT(lit, 0.05);
    EXPECT_NEAR(share_of_lit_pixels("picture.exr"), lit, 0.01);
    EXPECT_NEAR(share_of_lit_pixels("coarse.exr"), lit, 0.05);
}

} // namespace
} // namespace palpate
