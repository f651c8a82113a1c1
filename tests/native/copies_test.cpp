// Copies, fills and clears of the private driver, against plain indexing of the same bytes.

#include <fmt/format.h>

#include <bit>

#include "tests/native/native_fixture.h"

namespace palpate {
namespace {

class NativeCopies : public NativeTest {};

struct Clear {
    VkFormat format;
    VkClearColorValue color;
    std::vector<uint8_t> texel; // by the formats' definition in Vulkan, worked out by hand
};

constexpr VkClearColorValue floats(float r, float g, float b, float a) {
    return {.float32 = {r, g, b, a}};
}
constexpr VkClearColorValue words(uint32_t r, uint32_t g, uint32_t b, uint32_t a) {
    return {.uint32 = {r, g, b, a}};
}

// Every format of the driver. 0.5 * 255 = 127.5 and 0.5 * 65535 = 32767.5 are rounded to the even
// neighbour; 1/3 is 0x3555 in half precision, 2^-24 is 1 step of its denormal numbers.
const Clear kClears[] = {
    {VK_FORMAT_R8_UNORM, floats(0.5f, 0, 0, 0), {128}},
    {VK_FORMAT_R8_UINT, words(200, 1, 1, 1), {200}},
    {VK_FORMAT_R8G8_UNORM, floats(2.0f, -1.0f, 0, 0), {255, 0}},
    {VK_FORMAT_R16_UNORM, floats(0.5f, 0, 0, 0), {0x00, 0x80}},
    {VK_FORMAT_R16_SNORM, floats(-1.0f, 0, 0, 0), {0x01, 0x80}},
    {VK_FORMAT_R16_UINT, words(0x1234, 0, 0, 0), {0x34, 0x12}},
    {VK_FORMAT_R16_SFLOAT, floats(1.0f / 3.0f, 0, 0, 0), {0x55, 0x35}},
    {VK_FORMAT_R8G8B8A8_UNORM, floats(1, 0, 0.2f, 0.4f), {255, 0, 51, 102}},
    {VK_FORMAT_B8G8R8A8_UNORM, floats(1, 0, 0.2f, 0.4f), {51, 0, 255, 102}},
    {VK_FORMAT_R16G16_UNORM, floats(1, 0.2f, 0, 0), {0xff, 0xff, 0x33, 0x33}},
    {VK_FORMAT_R16G16_SFLOAT, floats(-2, 65504, 0, 0), {0x00, 0xc0, 0xff, 0x7b}},
    {VK_FORMAT_R32_SFLOAT, floats(1, 0, 0, 0), {0, 0, 0x80, 0x3f}},
    {VK_FORMAT_R32_UINT, words(0x01020304, 0, 0, 0), {4, 3, 2, 1}},
    {VK_FORMAT_R16G16B16A16_SFLOAT,
     floats(0x1p-24f, 1e6f, 1, 0),
     {0x01, 0x00, 0x00, 0x7c, 0x00, 0x3c, 0x00, 0x00}},
    {VK_FORMAT_R32G32_SFLOAT, floats(1, -2, 0, 0), {0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0}},
    {VK_FORMAT_R32G32_UINT, words(1, 2, 0, 0), {1, 0, 0, 0, 2, 0, 0, 0}},
    {VK_FORMAT_R32G32B32A32_SFLOAT,
     floats(1, -2, 0, 4),
     {0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0, 0, 0, 0x80, 0x40}},
    {VK_FORMAT_R32G32B32A32_UINT,
     words(1, 2, 3, 4),
     {1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0}}};

const ImageShape kShapes[] = {
    {.type = VK_IMAGE_TYPE_1D, .size = {7, 1, 1}, .layers = 3},
    {.type = VK_IMAGE_TYPE_2D, .size = {5, 6, 1}, .layers = 4},
    {.type = VK_IMAGE_TYPE_3D, .size = {5, 4, 6}},
};

ImageShape shape_of(const ImageShape& shape, VkFormat format) {
    ImageShape made = shape;
    made.format = format;
    return made;
}

// The place of a texel among all, and how many there are: x fastest, then y, z and layers.
size_t place(const ImageShape& shape, glm::uvec3 at, uint32_t layer) {
    return ((size_t{layer} * shape.size.z + at.z) * shape.size.y + at.y) * shape.size.x + at.x;
}
size_t texels_of(const ImageShape& shape) {
    return size_t{shape.size.x} * shape.size.y * shape.size.z * shape.layers;
}

Commands::Region whole(const ImageShape& shape) {
    return {.buffer_offset = 0, .image_offset = {}, .size = shape.size, .layers = shape.layers};
}

TEST_F(NativeCopies, BuffersGetThePiecesThatWereNamed) {
    const auto bytes = random_bytes(4096, 1);
    Buffer from(device(), "from", 4096, Memory::upload), to(device(), "to", 4096, Memory::device);
    std::memcpy(from.mapped().data(), bytes.data(), bytes.size());
    const Commands::Bytes pieces[] = {{0, 100, 10}, {1000, 0, 64}, {4095, 4095, 1}, {5, 2000, 777}};
    Commands commands(device());
    commands.zero(to);
    commands.copy(from, to, pieces);
    const BufferSlice back = commands.read_back(to);
    commands.submit();
    commands.ticket().wait();
    std::vector<std::byte> expected(4096);
    for (const Commands::Bytes& piece : pieces)
        for (size_t i = 0; i < piece.count; ++i)
            expected[piece.to + i] = bytes[piece.from + i];
    EXPECT_EQ(copied(back.mapped()), expected);
}

TEST_F(NativeCopies, FillsAndUpdatesChangeTheirRangeAlone) {
    constexpr uint32_t kWord = 0x89abcdef;
    Buffer to(device(), "to", 64, Memory::read_back);
    const uint32_t update[] = {1, 2, 3};
    RawCommands commands(device());
    vkCmdFillBuffer(commands.handle(), to.handle(), 0, VK_WHOLE_SIZE, 0);
    commands.barrier();
    vkCmdFillBuffer(commands.handle(), to.handle(), 4, 16, kWord);
    vkCmdUpdateBuffer(commands.handle(), to.handle(), 40, sizeof update, update);
    commands.run();
    commands.wait();
    std::vector<uint32_t> expected(16, 0), found(16);
    for (size_t i = 1; i < 5; ++i)
        expected[i] = kWord;
    for (uint32_t i = 0; i < 3; ++i)
        expected[10 + i] = i + 1;
    std::memcpy(found.data(), to.mapped().data(), 64);
    EXPECT_EQ(found, expected);
}

TEST_F(NativeCopies, ImagesOfEveryFormatAndShapeGiveBackTheirTexels) {
    for (const Clear& each : kClears)
        for (const ImageShape& like : kShapes) {
            const ImageShape shape = shape_of(like, each.format);
            const size_t bytes = texels_of(shape) * bytes_per_texel(shape.format);
            SCOPED_TRACE(fmt::format("format {}, type {}", static_cast<int>(shape.format),
                                     static_cast<int>(shape.type)));
            const auto texels = random_bytes(bytes, 2);
            GpuImage image(device(), "image", shape);
            const Commands::Region all = whole(shape);
            Commands commands(device());
            commands.copy(commands.upload(texels), image, {&all, 1});
            const BufferSlice back = commands.read_back(image, {&all, 1}, bytes);
            commands.submit();
            commands.ticket().wait();
            EXPECT_EQ(copied(back.mapped()), texels);
        }
}

// A region with rows and planes of the buffer that are longer than the box, in the image's middle.
TEST_F(NativeCopies, RegionsReachTheirTexelsAlone) {
    for (const ImageShape& like : kShapes) {
        const ImageShape shape = shape_of(like, VK_FORMAT_R16_UINT);
        SCOPED_TRACE(static_cast<int>(shape.type));
        const glm::uvec3 low = glm::min(shape.size - 1u, glm::uvec3(1));
        const glm::uvec3 size = glm::max(shape.size - 2u * low, glm::uvec3(1));
        const uint32_t first_layer = shape.layers > 1 ? 1 : 0;
        const uint32_t layers = std::max(1u, shape.layers - 2 * first_layer);
        const Commands::Region region{.buffer_offset = 8,
                                      .image_offset = low,
                                      .size = size,
                                      .row_texels = size.x + 3,
                                      .plane_rows = size.y + 2,
                                      .first_layer = first_layer,
                                      .layers = layers};
        const auto texels = random_bytes(4096, 3);
        GpuImage image(device(), "image", shape);
        const Commands::Region all = whole(shape);
        Commands commands(device());
        commands.clear(image, {});
        commands.copy(commands.upload(texels), image, {&region, 1});
        const BufferSlice back = commands.read_back(image, {&all, 1}, texels_of(shape) * 2);
        const BufferSlice part = commands.read_back(image, {&region, 1}, 4096);
        commands.submit();
        commands.ticket().wait();
        std::vector<std::byte> expected(texels_of(shape) * 2);
        for (uint32_t layer = 0; layer < layers; ++layer)
            for (uint32_t z = 0; z < size.z; ++z)
                for (uint32_t y = 0; y < size.y; ++y)
                    for (uint32_t x = 0; x < size.x; ++x) {
                        const size_t plane = size_t{layer} * size.z + z;
                        const size_t in_buffer =
                            8 + 2 * ((plane * (size.y + 2) + y) * (size.x + 3) + x);
                        const size_t in_image =
                            2 * place(shape, low + glm::uvec3(x, y, z), first_layer + layer);
                        for (size_t i = 0; i < 2; ++i) {
                            expected[in_image + i] = texels[in_buffer + i];
                            EXPECT_EQ(part.mapped()[in_buffer + i], texels[in_buffer + i]);
                        }
                    }
        EXPECT_EQ(copied(back.mapped()), expected);
    }
}

TEST_F(NativeCopies, ClearsSetEveryTexelOfEveryFormat) {
    for (const Clear& each : kClears)
        for (const ImageShape& like : kShapes) {
            const ImageShape shape = shape_of(like, each.format);
            SCOPED_TRACE(fmt::format("format {}, type {}", static_cast<int>(shape.format),
                                     static_cast<int>(shape.type)));
            const size_t bytes = texels_of(shape) * each.texel.size();
            ASSERT_EQ(each.texel.size(), bytes_per_texel(each.format));
            GpuImage image(device(), "image", shape);
            const Commands::Region all = whole(shape);
            Commands commands(device());
            commands.use(image, Use::clear_target);
            commands.flush();
            RawCommands raw(device());
            const VkImageSubresourceRange range{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0,
                                                VK_REMAINING_ARRAY_LAYERS};
            vkCmdClearColorImage(raw.handle(), image.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                                 &each.color, 1, &range);
            raw.run();
            const BufferSlice back = commands.read_back(image, {&all, 1}, bytes);
            commands.submit();
            commands.ticket().wait();
            std::vector<std::byte> expected;
            for (size_t i = 0; i < texels_of(shape); ++i)
                for (const uint8_t byte : each.texel)
                    expected.push_back(std::byte{byte});
            EXPECT_EQ(copied(back.mapped()), expected);
        }
}

TEST_F(NativeCopies, ImagesAreCopiedWholeAndByAreas) {
    for (const ImageShape& like : kShapes) {
        const ImageShape shape = shape_of(like, VK_FORMAT_R32G32_SFLOAT);
        const size_t bytes = texels_of(shape) * 8;
        const auto texels = random_bytes(bytes, 4);
        GpuImage from(device(), "from", shape), to(device(), "to", shape);
        const Commands::Region all = whole(shape);
        Commands commands(device());
        commands.copy(commands.upload(texels), from, {&all, 1});
        commands.copy(from, to);
        const BufferSlice back = commands.read_back(to, {&all, 1}, bytes);
        commands.submit();
        commands.ticket().wait();
        EXPECT_EQ(copied(back.mapped()), texels);
    }
    const ImageShape flat{.format = VK_FORMAT_R8_UNORM, .size = {9, 8, 1}};
    const auto texels = random_bytes(72, 5);
    GpuImage from(device(), "from", flat), to(device(), "to", flat);
    const Commands::Region all = whole(flat);
    const Commands::Area areas[] = {{{0, 0}, {2, 3}}, {{5, 4}, {4, 4}}};
    Commands commands(device());
    commands.copy(commands.upload(texels), from, {&all, 1});
    commands.clear(to, {});
    commands.copy(from, to, areas);
    const BufferSlice back = commands.read_back(to, {&all, 1}, 72);
    commands.submit();
    commands.ticket().wait();
    std::vector<std::byte> expected(72);
    for (const Commands::Area& area : areas)
        for (uint32_t y = area.low.y; y < area.low.y + area.size.y; ++y)
            for (uint32_t x = area.low.x; x < area.low.x + area.size.x; ++x)
                expected[y * 9 + x] = texels[y * 9 + x];
    EXPECT_EQ(copied(back.mapped()), expected);
}

// Vulkan lets layers of a 2D image stand for slices of a 3D one.
TEST_F(NativeCopies, SlicesBecomeLayersAndLayersSlices) {
    const ImageShape solid{
        .type = VK_IMAGE_TYPE_3D, .format = VK_FORMAT_R8_UINT, .size = {4, 3, 5}};
    const ImageShape layered{.format = VK_FORMAT_R8_UINT, .size = {4, 3, 1}, .layers = 5};
    const auto texels = random_bytes(60, 6);
    GpuImage from(device(), "solid", solid), middle(device(), "layers", layered),
        to(device(), "solid again", solid);
    const Commands::Region all = whole(solid);
    Commands commands(device());
    commands.copy(commands.upload(texels), from, {&all, 1});
    commands.use(from, Use::copy_source);
    commands.use(middle, Use::copy_target);
    commands.flush();
    RawCommands raw(device());
    const VkImageCopy out{.srcSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
                          .dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 5},
                          .extent = {4, 3, 5}};
    vkCmdCopyImage(raw.handle(), from.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                   middle.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &out);
    raw.run();
    commands.use(middle, Use::copy_source);
    commands.use(to, Use::copy_target);
    commands.flush();
    RawCommands back(device());
    const VkImageCopy in{.srcSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 5},
                         .dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1},
                         .extent = {4, 3, 5}};
    vkCmdCopyImage(back.handle(), middle.handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                   to.handle(), VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &in);
    back.run();
    const Commands::Region layers = whole(layered);
    const BufferSlice flat = commands.read_back(middle, {&layers, 1}, 60);
    const BufferSlice found = commands.read_back(to, {&all, 1}, 60);
    commands.submit();
    commands.ticket().wait();
    EXPECT_EQ(copied(flat.mapped()), texels);
    EXPECT_EQ(copied(found.mapped()), texels);
}

} // namespace
} // namespace palpate
