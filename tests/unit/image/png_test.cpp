#include "engine/image/png.h"

#include <png.h>

#include <cstdint>
#include <limits>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using PngTest = TemporaryFolder;

Image image_of_bytes(glm::uvec2 size_px, std::vector<std::string> channels) {
    Image image = make_image(size_px, std::move(channels));
    for (size_t i = 0; i < image.samples.size(); ++i)
        image.samples[i] = static_cast<float>(i * 53 % 256) / 255.0f;
    return image;
}

// Writes a PNG of any kind with libpng itself; `rows` holds the packed rows one after another.
struct RawPng {
    uint32_t width = 1, height = 1;
    int depth = 8, color_type = PNG_COLOR_TYPE_GRAY;
    int interlace = PNG_INTERLACE_NONE;
    std::vector<png_byte> rows = {};
    std::vector<png_color> palette = {};
    std::vector<png_byte> alpha = {}; // of palette entries
};

void write_raw(const std::filesystem::path& path, RawPng raw) {
    std::FILE* out = std::fopen(path.c_str(), "wb");
    ASSERT_NE(out, nullptr);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, out);
    png_set_IHDR(png, info, raw.width, raw.height, raw.depth, raw.color_type, raw.interlace,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (!raw.palette.empty())
        png_set_PLTE(png, info, raw.palette.data(), static_cast<int>(raw.palette.size()));
    if (!raw.alpha.empty())
        png_set_tRNS(png, info, raw.alpha.data(), static_cast<int>(raw.alpha.size()), nullptr);
    std::vector<png_bytep> rows;
    for (uint32_t y = 0; y < raw.height; ++y)
        rows.push_back(raw.rows.data() + y * (raw.rows.size() / raw.height));
    png_write_info(png, info);
    png_write_image(png, rows.data());
    png_write_end(png, nullptr);
    png_destroy_write_struct(&png, &info);
    std::fclose(out);
}

TEST_F(PngTest, KeepsEveryByte) {
    for (const glm::uvec2 size : {glm::uvec2(1, 1), {7, 3}, {1, 33}, {65, 17}})
        for (const auto& channels : {std::vector<std::string>{"R", "G", "B"},
                                     std::vector<std::string>{"R", "G", "B", "A"}}) {
            const Image image = image_of_bytes(size, channels);
            ASSERT_TRUE(save_png(file("a.png"), image));
            const auto loaded = load_png(file("a.png"));
            ASSERT_TRUE(loaded) << loaded.error().message;
            EXPECT_EQ(loaded->size_px, size);
            EXPECT_EQ(loaded->channels, channels);
            EXPECT_EQ(loaded->samples, image.samples);
        }
}

TEST_F(PngTest, RoundsAndClamps) {
    Image image = make_image({1, 3}, {"depth", "B", "G", "R"});
    image.samples = {9.0f, -1.0f, 2.0f,  std::numeric_limits<float>::quiet_NaN(),
                     9.0f, 0.5f,  0.25f, std::numeric_limits<float>::infinity(),
                     9.0f, 0.0f,  1.0f,  -std::numeric_limits<float>::infinity()};
    ASSERT_TRUE(save_png(file("a.png"), image));
    const auto loaded = load_png(file("a.png"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    // 255 * 0.5 = 127.5 rounds away from zero, 255 * 0.25 = 63.75 to the nearest.
    const std::vector<float> expected{0, 255, 0, 255, 64, 128, 0, 255, 0};
    ASSERT_EQ(loaded->channels, (std::vector<std::string>{"R", "G", "B"}));
    for (size_t i = 0; i < expected.size(); ++i)
        EXPECT_EQ(loaded->samples[i] * 255.0f, expected[i]) << i;
}

TEST_F(PngTest, ReadsSixteenBits) {
    write_raw(file("a.png"), {.width = 2,
                              .depth = 16,
                              .color_type = PNG_COLOR_TYPE_RGB,
                              .rows = {0, 0, 0, 1, 1, 0, 0x12, 0x34, 0xff, 0xfe, 0xff, 0xff}});
    const auto loaded = load_png(file("a.png"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    const std::vector<float> expected{0, 1, 256, 0x1234, 65534, 65535};
    for (size_t i = 0; i < expected.size(); ++i)
        EXPECT_EQ(loaded->samples[i], expected[i] / 65535.0f) << i;
}

TEST_F(PngTest, WidensNarrowGrey) {
    write_raw(file("a.png"), {.width = 4, .depth = 2, .rows = {0b00'01'10'11}});
    const auto loaded = load_png(file("a.png"));
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->channels, std::vector<std::string>{"Y"});
    for (size_t i = 0; i < 4; ++i)
        EXPECT_EQ(loaded->samples[i], static_cast<float>(i * 85) / 255.0f);
}

TEST_F(PngTest, ReadsPalettesWithAndWithoutAlpha) {
    RawPng raw{.width = 2,
               .color_type = PNG_COLOR_TYPE_PALETTE,
               .rows = {1, 0},
               .palette = {{10, 20, 30}, {40, 50, 60}}};
    write_raw(file("a.png"), raw);
    const auto opaque = load_png(file("a.png"));
    ASSERT_TRUE(opaque) << opaque.error().message;
    EXPECT_EQ(opaque->channels, (std::vector<std::string>{"R", "G", "B"}));
    EXPECT_EQ(opaque->samples[0], 40.0f / 255.0f);
    EXPECT_EQ(opaque->samples[5], 30.0f / 255.0f);
    raw.alpha = {7};
    write_raw(file("b.png"), raw);
    const auto see_through = load_png(file("b.png"));
    ASSERT_TRUE(see_through) << see_through.error().message;
    EXPECT_EQ(see_through->channels, (std::vector<std::string>{"R", "G", "B", "A"}));
    EXPECT_EQ(see_through->samples[3], 1.0f);
    EXPECT_EQ(see_through->samples[7], 7.0f / 255.0f);
}

TEST_F(PngTest, ReadsInterlacedFiles) {
    RawPng raw{.width = 9, .height = 5};
    for (int i = 0; i < 45; ++i)
        raw.rows.push_back(static_cast<png_byte>(5 * i));
    write_raw(file("plain.png"), raw);
    raw.interlace = PNG_INTERLACE_ADAM7;
    write_raw(file("interlaced.png"), raw);
    const auto plain = load_png(file("plain.png"));
    const auto interlaced = load_png(file("interlaced.png"));
    ASSERT_TRUE(plain && interlaced);
    EXPECT_EQ(plain->samples, interlaced->samples);
    EXPECT_EQ(plain->samples[44], 220.0f / 255.0f);
}

TEST_F(PngTest, EqualImagesMakeEqualFiles) {
    for (const char* name : {"a.png", "b.png"})
        ASSERT_TRUE(save_png(file(name), image_of_bytes({31, 40}, {"R", "G", "B"})));
    EXPECT_EQ(bytes_of("a.png"), bytes_of("b.png"));
}

TEST_F(PngTest, RefusesEveryTruncation) {
    ASSERT_TRUE(save_png(file("whole.png"), image_of_bytes({5, 20}, {"R", "G", "B", "A"})));
    const std::string whole = bytes_of("whole.png");
    for (size_t length = 0; length < whole.size(); ++length) {
        write("cut.png", whole.substr(0, length));
        const auto loaded = load_png(file("cut.png"));
        ASSERT_FALSE(loaded) << "of " << whole.size() << " bytes, the first " << length;
        EXPECT_NE(loaded.error().message.find("cut.png"), std::string::npos);
    }
}

TEST_F(PngTest, SurvivesEveryDamagedByte) {
    ASSERT_TRUE(save_png(file("whole.png"), image_of_bytes({5, 20}, {"R", "G", "B"})));
    const std::string whole = bytes_of("whole.png");
    for (size_t at = 0; at < whole.size(); ++at)
        for (const char flip : {'\x01', '\x80', '\xff'}) {
            std::string damaged = whole;
            damaged[at] = static_cast<char>(damaged[at] ^ flip);
            write("damaged.png", damaged);
            if (const auto loaded = load_png(file("damaged.png"))) {
                EXPECT_LE(loaded->samples.size() * sizeof(float), kMaxImageBytes);
            }
        }
}

// The size in the header, with the checksum of the chunk made right again.
std::string with_size(std::string bytes, uint32_t width, uint32_t height) {
    const auto put = [&](size_t at, uint32_t value) {
        for (size_t i = 0; i < 4; ++i)
            bytes[at + i] = static_cast<char>(value >> (24 - 8 * i));
    };
    put(16, width);
    put(20, height);
    uint32_t crc = 0xffffffffu; // CRC-32 of the chunk's name and data, PNG specification, annex D
    for (size_t i = 12; i < 29; ++i) {
        crc ^= static_cast<uint8_t>(bytes[i]);
        for (int bit = 0; bit < 8; ++bit)
            crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    put(29, ~crc);
    return bytes;
}

TEST_F(PngTest, RefusesClaimsBeyondTheLimitsAndBeyondTheFile) {
    ASSERT_TRUE(save_png(file("whole.png"), image_of_bytes({5, 20}, {"R", "G", "B"})));
    const std::string whole = bytes_of("whole.png");
    ASSERT_EQ(with_size(whole, 5, 20), whole);
    for (const auto& [width, height, reason] :
         {std::tuple(0x7fffffffu, 1u, "65536 pixels"), std::tuple(60000u, 60000u, "at most"),
          std::tuple(9000u, 9000u, "cannot be held")}) {
        write("huge.png", with_size(whole, width, height));
        const auto loaded = load_png(file("huge.png"));
        ASSERT_FALSE(loaded);
        EXPECT_NE(loaded.error().message.find(reason), std::string::npos) << loaded.error().message;
    }
}

TEST_F(PngTest, RefusesWhatHasNoColours) {
    const auto saved = save_png(file("a.png"), make_image({2, 2}, {"R", "G", "depth"}));
    ASSERT_FALSE(saved);
    EXPECT_NE(saved.error().message.find("no B"), std::string::npos) << saved.error().message;
    EXPECT_FALSE(load_png(file("absent.png")));
}

} // namespace
} // namespace palpate
