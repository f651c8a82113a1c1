#include "engine/image/exr.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using ExrTest = TemporaryFolder;

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
constexpr float kEndless = std::numeric_limits<float>::infinity();

// Channels in the order a reader gives them back; values that half floats hold exactly, and NaN
// and infinities among them.
Image varied_image(glm::uvec2 size_px) {
    Image image = make_image(size_px, {"R", "G", "B", "A", "depth", "value"});
    for (size_t i = 0; i < image.samples.size(); ++i)
        image.samples[i] = static_cast<float>(static_cast<int>(i * 37 % 2001) - 1000) * 0.25f;
    image.samples[0] = kNoNumber;
    image.samples[1] = kEndless;
    image.samples[2] = -kEndless;
    image.samples[3] = -0.0f;
    return image;
}

void expect_same_bits(const Image& a, const Image& b) {
    EXPECT_EQ(a.size_px, b.size_px);
    EXPECT_EQ(a.channels, b.channels);
    ASSERT_EQ(a.samples.size(), b.samples.size());
    EXPECT_EQ(std::memcmp(a.samples.data(), b.samples.data(), a.samples.size() * sizeof(float)), 0);
}

TEST_F(ExrTest, KeepsEveryBitOfFloatsAtOddSizes) {
    for (const glm::uvec2 size : {glm::uvec2(1, 1), {7, 3}, {1, 33}, {65, 17}}) {
        Image image = varied_image(size);
        if (image.samples.size() > 10)
            image.samples[5] = 0.1f, image.samples[6] = 1e-42f; // no half holds these
        ASSERT_TRUE(save_exr(file("a.exr"), image, ExrPrecision::full_float));
        const auto loaded = load_exr(file("a.exr"));
        ASSERT_TRUE(loaded) << loaded.error().message;
        expect_same_bits(loaded->image, image);
    }
}

TEST_F(ExrTest, KeepsWhatHalfFloatsHoldAndRoundsTheRest) {
    Image image = varied_image({9, 5});
    ASSERT_TRUE(save_exr(file("a.exr"), image, ExrPrecision::half_float));
    const auto loaded = load_exr(file("a.exr"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    expect_same_bits(loaded->image, image);

    // Half floats near 0.1 lie 2^-14 apart, so the nearest is within 2^-15; the largest is 65504.
    image.samples[4] = 0.1f;
    image.samples[5] = 70000.0f;
    ASSERT_TRUE(save_exr(file("b.exr"), image, ExrPrecision::half_float));
    const auto rounded = load_exr(file("b.exr"));
    ASSERT_TRUE(rounded) << rounded.error().message;
    EXPECT_NE(rounded->image.samples[4], 0.1f);
    EXPECT_NEAR(rounded->image.samples[4], 0.1f, std::ldexp(1.0, -15));
    EXPECT_EQ(rounded->image.samples[5], kEndless);
}

TEST_F(ExrTest, BringsChannelsBackAsColoursThenByName) {
    Image image = make_image({2, 1}, {"value", "B", "G", "R"});
    for (size_t i = 0; i < image.samples.size(); ++i)
        image.samples[i] = static_cast<float>(i);
    ASSERT_TRUE(save_exr(file("a.exr"), image, ExrPrecision::full_float));
    const auto loaded = load_exr(file("a.exr"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->image.channels, (std::vector<std::string>{"R", "G", "B", "value"}));
    EXPECT_EQ(loaded->image.samples, (std::vector<float>{3, 2, 1, 0, 7, 6, 5, 4}));
}

TEST_F(ExrTest, KeepsMetadata) {
    const ImageMetadata metadata{{"driver", "llvmpipe (Mesa 22.3.6)"}, {"empty", ""}};
    ASSERT_TRUE(save_exr(file("a.exr"), varied_image({2, 2}), ExrPrecision::half_float, metadata));
    const auto loaded = load_exr(file("a.exr"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->metadata, metadata);
}

TEST_F(ExrTest, RefusesMetadataUnderTheNameOfAnAttributeOfTheFormat) {
    EXPECT_FALSE(save_exr(file("a.exr"), varied_image({2, 2}), ExrPrecision::half_float,
                          {{"dataWindow", "x"}}));
    EXPECT_FALSE(std::filesystem::exists(file("a.exr")));
}

TEST_F(ExrTest, EqualImagesMakeEqualFiles) {
    for (const char* name : {"a.exr", "b.exr"})
        ASSERT_TRUE(save_exr(file(name), varied_image({31, 40}), ExrPrecision::half_float,
                             {{"driver", "one"}}));
    EXPECT_EQ(bytes_of("a.exr"), bytes_of("b.exr"));
}

TEST_F(ExrTest, RefusesEveryTruncation) {
    ASSERT_TRUE(save_exr(file("whole.exr"), varied_image({5, 20}), ExrPrecision::half_float,
                         {{"driver", "one"}}));
    const std::string whole = bytes_of("whole.exr");
    for (size_t length = 0; length < whole.size(); ++length) {
        write("cut.exr", whole.substr(0, length));
        const auto loaded = load_exr(file("cut.exr"));
        ASSERT_FALSE(loaded) << "of " << whole.size() << " bytes, the first " << length;
        EXPECT_NE(loaded.error().message.find("cut.exr"), std::string::npos);
        EXPECT_EQ(loaded.error().message.find('\n'), std::string::npos);
    }
}

// A changed byte may still make a legal file; it must never crash, hang or be believed beyond the
// limits. Runs under the address sanitizer in the asan preset.
TEST_F(ExrTest, SurvivesEveryDamagedByte) {
    ASSERT_TRUE(save_exr(file("whole.exr"), varied_image({5, 20}), ExrPrecision::half_float));
    const std::string whole = bytes_of("whole.exr");
    for (size_t at = 0; at < whole.size(); ++at)
        for (const char flip : {'\x01', '\x80', '\xff'}) {
            std::string damaged = whole;
            damaged[at] = static_cast<char>(damaged[at] ^ flip);
            write("damaged.exr", damaged);
            if (const auto loaded = load_exr(file("damaged.exr"))) {
                EXPECT_LE(loaded->image.samples.size() * sizeof(float), kMaxImageBytes);
            }
        }
}

// Replaces the 4 numbers of the data window.
std::string with_window(std::string bytes, std::array<int32_t, 4> window) {
    const size_t at = bytes.find("dataWindow");
    std::memcpy(bytes.data() + at + std::strlen("dataWindow") + 1 + std::strlen("box2i") + 1 + 4,
                window.data(), sizeof window);
    return bytes;
}

TEST_F(ExrTest, RefusesClaimsBeyondTheLimitsAndBeyondTheFile) {
    ASSERT_TRUE(save_exr(file("whole.exr"), varied_image({5, 20}), ExrPrecision::half_float));
    const std::string whole = bytes_of("whole.exr");
    for (const std::array<int32_t, 4> window :
         {std::array<int32_t, 4>{0, 0, 2147483647, 2147483647},
          {-2147483647 - 1, -2147483647 - 1, 2147483647, 2147483647},
          {0, 0, 65535, 65535},
          {0, 0, 4, 65535},
          {0, 0, -1, -1}}) {
        write("huge.exr", with_window(whole, window));
        const auto loaded = load_exr(file("huge.exr"));
        ASSERT_FALSE(loaded);
        EXPECT_NE(loaded.error().message.find("expected"), std::string::npos)
            << loaded.error().message;
    }
}

TEST_F(ExrTest, TakesThePictureFromTheDataWindowWhereverItLies) {
    const Image image = varied_image({5, 20});
    ASSERT_TRUE(save_exr(file("whole.exr"), image, ExrPrecision::half_float));
    // Chunks carry the row they start at, so rows keep their place and columns may move.
    write("moved.exr", with_window(bytes_of("whole.exr"), {-3, 0, 1, 19}));
    const auto loaded = load_exr(file("moved.exr"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    expect_same_bits(loaded->image, image);
}

TEST_F(ExrTest, NamesWhatIsNotAFlatScanlinePicture) {
    ASSERT_TRUE(save_exr(file("whole.exr"), varied_image({2, 2}), ExrPrecision::half_float));
    std::string bytes = bytes_of("whole.exr");
    for (const auto& [flag, kind] :
         {std::pair('\x02', "tiled"), std::pair('\x08', "deep"), std::pair('\x10', "multi-part")}) {
        bytes[5] = flag;
        write("kind.exr", bytes);
        const auto loaded = load_exr(file("kind.exr"));
        ASSERT_FALSE(loaded);
        EXPECT_NE(loaded.error().message.find(kind), std::string::npos) << loaded.error().message;
    }
    write("text.exr", "no picture at all");
    EXPECT_FALSE(load_exr(file("text.exr")));
    EXPECT_FALSE(load_exr(file("absent.exr")));
}

TEST_F(ExrTest, LeavesNoFileWhereNoneCanBeWritten) {
    EXPECT_FALSE(
        save_exr(file("no/such/folder.exr"), varied_image({2, 2}), ExrPrecision::half_float));
    EXPECT_FALSE(save_exr(file("empty.exr"), make_image({0, 4}, {"R"}), ExrPrecision::half_float));
    EXPECT_FALSE(std::filesystem::exists(file("empty.exr")));
    Image torn = varied_image({2, 2});
    torn.samples.pop_back();
    const auto saved = save_exr(file("torn.exr"), torn, ExrPrecision::half_float);
    ASSERT_FALSE(saved);
    EXPECT_NE(saved.error().message.find("expected a picture of 24 samples, found 23"),
              std::string::npos);
}

} // namespace
} // namespace palpate
