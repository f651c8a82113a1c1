// PNG, JPEG, TIFF and BMP: what is whole is read to the bit, what is not is refused with the byte.

#include <gmock/gmock.h>
#include <zlib.h>

#include "engine/io/volume_io.h"
#include "tests/unit/io/sample_files.h"

namespace palpate {
namespace {

using test::Folder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string outcome(const std::string& name, const std::string& bytes) {
    const Folder folder("picture");
    test::write(folder / name, bytes);
    const Result<LoadedVolume> loaded = load_volume(folder / name);
    if (loaded)
        return "read";
    EXPECT_THAT(loaded.error().message,
                AllOf(HasSubstr(name), Not(HasSubstr("reader")), Not(HasSubstr("\n"))));
    return loaded.error().message;
}

const std::string kSignature = "\x89PNG\r\n\x1a\n";

// 4 x 3 samples of 8 bits.
std::string png_of(const std::string& rows, const std::string& end = test::png_chunk("IEND", "")) {
    std::string packed(::compressBound(rows.size()), '\0');
    uLongf length = packed.size();
    ::compress(reinterpret_cast<Bytef*>(packed.data()), &length,
               reinterpret_cast<const Bytef*>(rows.data()), rows.size());
    packed.resize(length);
    return kSignature + test::png_chunk("IHDR", std::string("\0\0\0\4\0\0\0\3\x08\0\0\0\0", 13)) +
           test::png_chunk("tEXt", "Comment") + test::png_chunk("IDAT", packed.substr(0, 3)) +
           test::png_chunk("IDAT", packed.substr(3)) + end;
}

TEST(Png, IsReadOrRefusedWithACause) {
    const std::string rows = std::string("\0abcd\1abcd\2abcd", 15);
    const std::string good = png_of(rows);
    EXPECT_EQ(outcome("a.png", good), "read");
    EXPECT_EQ(outcome("a.png", good + "what follows IEND"), "read");
    EXPECT_THAT(outcome("a.png", good.substr(0, 40)),
                HasSubstr("ends at byte 40, within a chunk that begins at byte 33"));
    EXPECT_THAT(outcome("a.png", good.substr(0, good.size() - 12)),
                HasSubstr(fmt::format("ends at byte {} without the chunk IEND", good.size() - 12)));
    std::string flipped = good;
    flipped[20] ^= 1;
    EXPECT_THAT(outcome("a.png", flipped), HasSubstr("the chunk IHDR at byte 8 is damaged"));
    EXPECT_THAT(outcome("a.png", png_of(rows.substr(0, 14))),
                HasSubstr("expected 15 bytes of unpacked pixels, as its size claims, found 14"));
    EXPECT_THAT(outcome("a.png", png_of(std::string("\0abcd\5abcd\2abcd", 15))),
                HasSubstr("filter 0 to 4 in row 1, found 5"));
    EXPECT_THAT(outcome("a.png", png_of(rows, test::png_chunk("XYZW", ""))),
                HasSubstr("critical chunk XYZW"));
    EXPECT_THAT(outcome("a.png", "GIF89a"), HasSubstr("signature of PNG"));
    EXPECT_THAT(outcome("a.png", ""), HasSubstr("signature of PNG"));
}

TEST(Jpeg, BlocksHaveTheirValues) {
    for (const int restart : {0, 1, 2}) {
        const Folder folder("picture");
        test::write(folder / "a.jpg", test::jpeg({{10, 250, 128}, {129, 1, 254}}, restart));
        const Result<LoadedVolume> loaded = load_volume(folder / "a.jpg");
        ASSERT_TRUE(loaded) << loaded.error().message;
        ASSERT_EQ(loaded->volume.size(), glm::uvec3(24, 16, 1));
        const float expected[2][3] = {{10, 250, 128}, {129, 1, 254}};
        for (uint32_t y = 0; y < 16; ++y)
            for (uint32_t x = 0; x < 24; ++x)
                EXPECT_EQ(loaded->volume.value({x, y, 0}), expected[y / 8][x / 8]);
    }
}

TEST(Jpeg, EveryTruncationIsRefusedWithTheByte) {
    const std::string good = test::jpeg({{10, 250, 128}, {129, 1, 254}}, 2);
    for (size_t length = 0; length < good.size(); length += length < 4 ? 1 : 7) {
        const std::string message = outcome("a.jpg", good.substr(0, length));
        EXPECT_THAT(message, HasSubstr(length < 2 ? "marker SOI" : "cut off")) << length;
        EXPECT_THAT(message, HasSubstr(length < 2 ? "" : fmt::format("ends at byte {}", length)));
    }
    EXPECT_THAT(outcome("a.jpg", good.substr(0, good.size() - 2)),
                HasSubstr("within the scan that begins at byte"));
}

TEST(Jpeg, OtherProcessesAreRefusedByName) {
    const std::string good = test::jpeg({{10, 250}});
    const size_t frame = good.find("\xff\xc0");
    const auto changed = [&](size_t at, char value) {
        std::string bytes = good;
        bytes[frame + at] = value;
        return outcome("a.jpg", bytes);
    };
    EXPECT_THAT(changed(1, '\xc3'), HasSubstr("SOF3 (lossless)"));
    EXPECT_THAT(changed(1, '\xc9'), HasSubstr("SOF9 (arithmetic coding)"));
    EXPECT_THAT(changed(4, 12), HasSubstr("8 bits, found 12"));
    EXPECT_THAT(changed(9, 3), HasSubstr("components"));
    EXPECT_THAT(changed(11, '\x70'), HasSubstr("sampling factors"));
    EXPECT_THAT(outcome("a.jpg", "\xff\xd8\xff\xd9"), HasSubstr("no pixels"));
}

// Every truncation of a file names the byte at which it ends.
void expect_truncations_refused(const std::string& name, const std::string& good) {
    EXPECT_EQ(outcome(name, good), "read");
    for (size_t length = 0; length < good.size(); length += length < 60 ? 9 : 97)
        EXPECT_THAT(outcome(name, good.substr(0, length)),
                    HasSubstr(fmt::format("the end of the file at byte {}", length)));
}

TEST(Bmp, IsReadOrRefusedWithACause) {
    const std::vector<std::vector<uint8_t>> rows{{1, 2, 3, 4, 5}, {60, 70, 80, 90, 255}};
    for (const bool runs : {false, true}) {
        const std::string good = test::bmp(rows, runs);
        expect_truncations_refused("a.bmp", good);
        const Folder folder("picture");
        test::write(folder / "a.bmp", good);
        const Result<LoadedVolume> loaded = load_volume(folder / "a.bmp");
        ASSERT_TRUE(loaded) << loaded.error().message;
        ASSERT_EQ(loaded->volume.size(), glm::uvec3(5, 2, 1));
        for (uint32_t y = 0; y < 2; ++y)
            for (uint32_t x = 0; x < 5; ++x)
                EXPECT_EQ(loaded->volume.value({x, y, 0}), rows[y][x]) << runs;
    }
    const auto changed = [&](size_t at, char value, bool runs = false) {
        std::string bytes = test::bmp(rows, runs);
        bytes[at] = value;
        return outcome("a.bmp", bytes);
    };
    EXPECT_THAT(changed(0, 'X'), HasSubstr("begins with BM"));
    EXPECT_THAT(changed(14, 12), HasSubstr("a header of 40 to 124 bytes, found 12"));
    EXPECT_THAT(changed(18, 0), HasSubstr("at least 1 x 1, found 0 x 2"));
    EXPECT_THAT(changed(22, 9), HasSubstr("expected 5 x 9 pixels in bytes 1078 to 1150"));
    EXPECT_THAT(changed(28, 4), HasSubstr("8, 24 or 32 bits a pixel, found 4"));
    EXPECT_THAT(changed(30, 3), HasSubstr("found compression 3"));
    EXPECT_THAT(changed(1078, 9, true), HasSubstr("runs within 5 x 2 pixels, found one beyond"));
}

TEST(Tiff, IsReadOrRefusedWithACause) {
    const std::vector<std::vector<uint16_t>> rows{{1, 2, 3}, {600, 700, 65535}, {7, 8, 9}};
    for (const bool big_endian : {false, true}) {
        const std::string good = test::tiff(rows, big_endian);
        expect_truncations_refused("a.tif", good);
        const Folder folder("picture");
        test::write(folder / "a.tif", good);
        const Result<LoadedVolume> loaded = load_volume(folder / "a.tif");
        ASSERT_TRUE(loaded) << loaded.error().message;
        ASSERT_EQ(loaded->volume.size(), glm::uvec3(3, 3, 1));
        for (uint32_t y = 0; y < 3; ++y)
            for (uint32_t x = 0; x < 3; ++x)
                EXPECT_EQ(loaded->volume.value({x, y, 0}), rows[y][x]) << big_endian;
    }
    const std::string good = test::tiff(rows);
    const size_t tags = good.size() - 9 * 12 - 4;
    const auto changed = [&](size_t at, char value) {
        std::string bytes = good;
        bytes[at] = value;
        return outcome("a.tif", bytes);
    };
    EXPECT_THAT(changed(2, 41), HasSubstr("begins with II or MM and 42"));
    EXPECT_THAT(changed(tags + 8, 0), HasSubstr("above 0 as its width (tag 256), found 0"));
    EXPECT_THAT(changed(tags + 5 * 12, 99), HasSubstr("expected the places of its pixels"));
    EXPECT_THAT(changed(8 + 18 + 2, 99), HasSubstr("expected pixels in bytes"));
    EXPECT_THAT(changed(good.size() - 4, static_cast<char>(tags - 2)), HasSubstr("twice"));
}

} // namespace
} // namespace palpate
