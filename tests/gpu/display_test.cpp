// Layouts for screens: on the CPU against closed forms, on the device against the CPU.

#include <algorithm>
#include <cstring>
#include <functional>
#include <random>

#include "engine/image/display_byte.h"
#include "engine/render/display_pass.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

constexpr StereoLayout kLayouts[] = {StereoLayout::side_by_side,       StereoLayout::top_bottom,
                                     StereoLayout::row_interleaved,    StereoLayout::left,
                                     StereoLayout::column_interleaved, StereoLayout::right,
                                     StereoLayout::checkerboard,       StereoLayout::anaglyph};

constexpr glm::uvec2 kEyePx{5, 4};

// Two eyes whose pixels say which they are: R is the eye, G and B are column and row, A is 1.
std::vector<Image> numbered_eyes() {
    std::vector<Image> eyes(2, make_image(kEyePx, {"R", "G", "B", "A", "depth"}));
    for (uint32_t eye = 0; eye < 2; ++eye)
        for (uint32_t y = 0; y < kEyePx.y; ++y)
            for (uint32_t x = 0; x < kEyePx.x; ++x) {
                const float values[] = {float(eye), float(x), float(y), 1.0f, float(x + y)};
                std::copy_n(values, 5, &eyes[eye].at(x, y, 0));
            }
    return eyes;
}

// The eye, column and row that a joint pixel shows, by the sentences of display_layout.h.
glm::uvec3 expected_at(int x, int y, StereoLayout layout, glm::ivec2 origin) {
    const auto odd = [](int n) { return n % 2 != 0 ? 1u : 0u; };
    const glm::uvec2 p(x, y);
    switch (layout) {
        case StereoLayout::side_by_side:
            return x < 5 ? glm::uvec3(0, p) : glm::uvec3(1, x - 5, y);
        case StereoLayout::top_bottom:
            return y < 4 ? glm::uvec3(0, p) : glm::uvec3(1, x, y - 4);
        case StereoLayout::row_interleaved:
            return {odd(y + origin.y), p};
        case StereoLayout::column_interleaved:
            return {odd(x + origin.x), p};
        case StereoLayout::checkerboard:
            return {odd(x + y + origin.x + origin.y), p};
        case StereoLayout::right:
            return {1, p};
        default:
            return {0, p};
    }
}

TEST(DisplayLayout, EveryPixelShowsTheEyeAndPixelOfItsLayout) {
    const std::vector<Image> eyes = numbered_eyes();
    for (const StereoLayout layout : kLayouts)
        for (const bool swap : {false, true})
            for (const bool mirror : {false, true})
                for (const glm::ivec2 origin : {glm::ivec2(0, 0), {1, 0}, {0, 1}, {-3, -7}}) {
                    if (layout == StereoLayout::anaglyph)
                        continue;
                    const Image joint = display_image(eyes, {layout, swap, mirror, origin});
                    ASSERT_EQ(joint.size_px, display_size_px(kEyePx, layout));
                    for (uint32_t y = 0; y < joint.size_px.y; ++y)
                        for (uint32_t x = 0; x < joint.size_px.x; ++x) {
                            glm::uvec3 e = expected_at(int(x), int(y), layout, origin);
                            e = {swap ? 1 - e.x : e.x, e.y, mirror ? 3 - e.z : e.z};
                            const float expected[] = {float(e.x), float(e.y), float(e.z), 1.0f,
                                                      float(e.y + e.z)};
                            for (size_t c = 0; c < 5; ++c)
                                EXPECT_EQ(joint.at(x, y, c), expected[c])
                                    << int(layout) << ": " << x << ", " << y << ", " << c;
                        }
                }
    EXPECT_EQ(display_size_px({5, 4}, StereoLayout::side_by_side), glm::uvec2(10, 4));
    EXPECT_EQ(display_size_px({5, 4}, StereoLayout::top_bottom), glm::uvec2(5, 8));
    EXPECT_EQ(display_size_px({5, 4}, StereoLayout::checkerboard), glm::uvec2(5, 4));
}

TEST(DisplayLayout, AWindowThatMovesKeepsEachEyesPixelsOfTheScreen) {
    const std::vector<Image> eyes = numbered_eyes();
    for (const StereoLayout layout : {StereoLayout::row_interleaved,
                                      StereoLayout::column_interleaved, StereoLayout::checkerboard})
        for (const glm::ivec2 moved : {glm::ivec2(1, 0), {0, 1}, {1, 1}, {-1, -2}}) {
            const Image before = display_image(eyes, {.layout = layout, .origin_px = {10, 20}});
            const Image after =
                display_image(eyes, {.layout = layout, .origin_px = glm::ivec2(10, 20) + moved});
            for (int x = 1; x < 4; ++x) { // pixels of the screen that lie in both
                const glm::ivec2 then(x, 1), now = then - moved;
                EXPECT_EQ(before.at(uint32_t(then.x), uint32_t(then.y), 0),
                          after.at(uint32_t(now.x), uint32_t(now.y), 0))
                    << int(layout) << " moved by " << moved.x << ", " << moved.y;
            }
        }
}

TEST(DisplayLayout, AnAnaglyphIsTheLuminanceOfEitherEye) {
    std::vector<Image> eyes = numbered_eyes();
    for (size_t c = 0; c < 3; ++c) {
        eyes[0].at(2, 1, c) = std::array{1.0f, 0.5f, 0.25f}[c];
        eyes[1].at(2, 1, c) = std::array{0.0f, 1.0f, 0.0f}[c];
    }
    const Image joint = display_image(eyes, {.layout = StereoLayout::anaglyph});
    EXPECT_NEAR(joint.at(2, 1, 0), 0.2126 + 0.3576 + 0.01805, 1e-6);
    EXPECT_NEAR(joint.at(2, 1, 1), 0.7152, 1e-6);
    EXPECT_EQ(joint.at(2, 1, 1), joint.at(2, 1, 2));
    EXPECT_EQ(joint.at(2, 1, 3), 1.0f);
    EXPECT_TRUE(std::isnan(joint.at(2, 1, 4))) << "no depth is that of both eyes";
}

class DisplayTest : public GpuTest {
 protected:
    // Values in and far out of 0 .. 1, the halves between two bytes, and their neighbours.
    static std::vector<Image> hard_eyes(glm::uvec2 size_px, uint32_t count) {
        std::mt19937 random(7);
        std::vector<Image> eyes(count, make_image(size_px, {"R", "G", "B", "A"}));
        for (Image& eye : eyes)
            for (float& v : eye.samples) {
                const float half = (float(random() % 256) + 0.5f) / 255.0f;
                const float any = float(random() % 100000) / 99999.0f;
                const float cases[] = {
                    any,  half, std::nextafter(half, 0.0f), std::nextafter(half, 1.0f), -any, 3.0f,
                    0.0f, 1.0f, std::nextafter(0.0f, 1.0f)};
                v = cases[random() % std::size(cases)];
            }
        return eyes;
    }
    static GpuImage uploaded(Commands& commands, std::span<const Image> eyes) {
        GpuImage picture(device(), "eyes",
                         {.format = VK_FORMAT_R32G32B32A32_SFLOAT,
                          .size = {eyes.front().size_px, 1},
                          .layers = static_cast<uint32_t>(eyes.size()),
                          .storage = true});
        std::vector<float> texels;
        for (const Image& eye : eyes)
            texels.insert(texels.end(), eye.samples.begin(), eye.samples.end());
        const Commands::Region all{.buffer_offset = 0,
                                   .image_offset = {},
                                   .size = picture.shape().size,
                                   .layers = picture.shape().layers};
        commands.copy(commands.upload(std::as_bytes(std::span(texels))), picture,
                      std::span(&all, 1));
        return picture;
    }
    static BufferSlice read(Commands& commands, GpuImage& image) {
        const Commands::Region all{
            .buffer_offset = 0, .image_offset = {}, .size = image.shape().size};
        return commands.read_back(image, std::span(&all, 1),
                                  uint64_t{4} * image.shape().size.x * image.shape().size.y);
    }
};

TEST_F(DisplayTest, BytesOnTheDeviceAreThoseOfTheCpu) {
    DisplayPass pass(device());
    for (const uint32_t count : {1u, 2u}) {
        const std::vector<Image> eyes = hard_eyes({83, 61}, count);
        for (const StereoLayout layout : kLayouts)
            for (const DisplayLayout& display : {DisplayLayout{layout, false, false, {0, 0}},
                                                 DisplayLayout{layout, true, false, {1, 0}},
                                                 DisplayLayout{layout, false, true, {0, 1}},
                                                 DisplayLayout{layout, true, true, {-5, -12}}}) {
                const bool bgra = display.mirror;
                const glm::uvec2 corner(bgra ? 3 : 0, bgra ? 2 : 0);
                const Image joint = display_image(eyes, display);
                Commands commands(device());
                GpuImage picture = uploaded(commands, eyes);
                GpuImage target =
                    DisplayPass::make_target(device(), "shown", joint.size_px + corner + corner);
                commands.clear(target, glm::vec4(0.2f)); // 51 of 255
                pass.record(commands, picture, display, {target, corner, bgra});
                const BufferSlice bytes = read(commands, target);
                commands.submit();
                commands.finish();
                size_t wrong = 0;
                for (uint32_t y = 0; y < target.shape().size.y; ++y)
                    for (uint32_t x = 0; x < target.shape().size.x; ++x) {
                        const glm::uvec2 at = glm::uvec2(x, y) - corner; // wraps outside
                        const bool inside = at.x < joint.size_px.x && at.y < joint.size_px.y;
                        const std::byte* found =
                            &bytes.mapped()[4 * (y * target.shape().size.x + x)];
                        for (size_t c = 0; c < 4; ++c) {
                            const size_t channel = bgra && c < 3 ? 2 - c : c;
                            const uint8_t expected =
                                !inside  ? uint8_t{51}
                                : c == 3 ? uint8_t{255}
                                         : display_byte(joint.at(at.x, at.y, channel));
                            wrong += std::to_integer<uint8_t>(found[c]) != expected;
                        }
                    }
                EXPECT_EQ(wrong, 0u)
                    << "layout " << int(layout) << ", eyes " << count << ", mirror "
                    << display.mirror << ", swapped " << display.swap_eyes;
            }
    }
}

// The target shows the second of two pictures within the box and the first outside.
TEST_F(DisplayTest, ABoxIsWrittenAlone) {
    DisplayPass pass(device());
    const glm::uvec2 size(83, 61), corner(2, 1);
    const std::vector<Image> before = hard_eyes(size, 1), after = hard_eyes(size, 2);
    for (const PixelBox& box : {PixelBox{{5, 3}, {22, 9}}, PixelBox{{0, 0}, {1, 1}},
                                PixelBox{{80, 60}, {83, 61}}, PixelBox{{0, 0}, size}}) {
        Commands commands(device());
        GpuImage first = uploaded(commands, before),
                 second = uploaded(commands, std::span(after).subspan(1));
        GpuImage target = DisplayPass::make_target(device(), "shown", size + 2u * corner);
        commands.clear(target, glm::vec4(0.2f)); // 51 of 255
        pass.record(commands, first, {}, {target, corner});
        pass.record(commands, second, {}, {target, corner, false, box});
        const BufferSlice bytes = read(commands, target);
        commands.submit();
        commands.finish();
        size_t wrong = 0;
        for (uint32_t y = 0; y < target.shape().size.y; ++y)
            for (uint32_t x = 0; x < target.shape().size.x; ++x) {
                const glm::uvec2 at = glm::uvec2(x, y) - corner; // wraps outside
                const auto is_in = [&](glm::uvec2 low, glm::uvec2 high) {
                    return glm::all(glm::greaterThanEqual(at, low)) &&
                           glm::all(glm::lessThan(at, high));
                };
                for (size_t c = 0; c < 3; ++c) {
                    const uint8_t expected =
                        is_in(box.low, box.high) ? display_byte(after[1].at(at.x, at.y, c))
                        : is_in({0, 0}, size)    ? display_byte(before[0].at(at.x, at.y, c))
                                                 : uint8_t{51};
                    wrong +=
                        std::to_integer<uint8_t>(
                            bytes.mapped()[4 * (y * target.shape().size.x + x) + c]) != expected;
                }
            }
        EXPECT_EQ(wrong, 0u) << "box from " << box.low.x << " to " << box.high.x;
    }
}

// A window's image has its own channel order: vkCmdCopyImage copies bits.
TEST_F(DisplayTest, IsCopiedToAWindowsFormatByBits) {
    DisplayPass pass(device());
    const std::vector<Image> eyes = hard_eyes({19, 7}, 1);
    Commands commands(device());
    GpuImage picture = uploaded(commands, eyes);
    GpuImage target = DisplayPass::make_target(device(), "shown", {19, 7});
    GpuImage window(device(), "as a window's",
                    {.format = VK_FORMAT_B8G8R8A8_UNORM, .size = {19, 7, 1}});
    pass.record(commands, picture, {}, {.image = target, .bgra = true});
    commands.copy(target, window);
    const BufferSlice before = read(commands, target), after = read(commands, window);
    commands.submit();
    commands.finish();
    EXPECT_EQ(std::memcmp(before.mapped().data(), after.mapped().data(), before.bytes), 0);
    EXPECT_EQ(std::to_integer<uint8_t>(after.mapped()[0]), display_byte(eyes[0].at(0, 0, 2)));
}

TEST_F(DisplayTest, CreatesNothingWhileItRecords) {
    DisplayPass pass(device());
    const std::vector<Image> eyes = hard_eyes({19, 7}, 2);
    GpuImage target = DisplayPass::make_target(device(), "shown", {38, 7});
    std::optional<GpuImage> picture;
    const auto frame = [&] {
        Commands commands(device());
        if (!picture)
            picture.emplace(uploaded(commands, eyes));
        pass.record(commands, *picture, {.layout = StereoLayout::side_by_side}, {target});
        commands.submit();
        commands.finish();
    };
    for (int i = 0; i < 3; ++i)
        frame();
    const GpuDevice::Created before = device().created();
    for (int i = 0; i < 20; ++i)
        frame();
    EXPECT_EQ(device().created().objects, before.objects);
    EXPECT_EQ(device().created().allocations, before.allocations);
}

} // namespace
} // namespace palpate
