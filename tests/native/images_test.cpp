// Images as kernels read them, beside Vulkan's formulas written out for one place: the same bits.

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "engine/native/kernel.h"
#include "spirv/images.h"

namespace palpate {
namespace {

using Texel = std::array<float, 4>;

constexpr uint32_t kPlaces = 6 * 64;

// An image and its texels as numbers.
struct Held {
    std::vector<std::byte> bytes;
    native::Resource bound;
    std::vector<Texel> texels; // x fastest, then y, then z or the layer

    const Texel& at(int x, int y, int z) const {
        const native::Image& image = bound.image;
        return texels[(static_cast<size_t>(z) * image.height + static_cast<size_t>(y)) *
                          image.width +
                      static_cast<size_t>(x)];
    }
};

struct Size {
    uint32_t x, y, z;
};

// A half with an exponent in the middle, and what it means.
float random_half(std::mt19937& random, uint16_t& bits) {
    bits = static_cast<uint16_t>(random() & 0xffffu);
    const int exponent = bits >> 10 & 31, rest = bits & 1023;
    if (exponent == 31) { // infinite, or no number
        bits = 0;
        return 0.0f;
    }
    const float size = exponent == 0 ? std::ldexp(static_cast<float>(rest), -24)
                                     : std::ldexp(static_cast<float>(1024 + rest), exponent - 25);
    return bits & 0x8000u ? -size : size;
}

Held random_image(VkFormat format, Size size, bool is_array, native::Sampler sampler) {
    constexpr size_t kAround = 64; // bytes that must be readable before and behind
    std::mt19937 random(1);
    const uint32_t texel_bytes = native::texel_bytes(format);
    const size_t count = size_t{size.x} * size.y * size.z;
    Held held;
    held.bytes.resize(2 * kAround + count * texel_bytes);
    held.texels.resize(count);
    for (size_t i = 0; i < count; ++i) {
        std::byte* to = held.bytes.data() + kAround + i * texel_bytes;
        Texel& texel = held.texels[i];
        if (format == VK_FORMAT_R16G16B16A16_SFLOAT) {
            for (size_t c = 0; c < 4; ++c) {
                uint16_t bits = 0;
                texel[c] = random_half(random, bits);
                std::memcpy(to + 2 * c, &bits, sizeof bits);
            }
            continue;
        }
        const size_t channels = texel_bytes / sizeof(float);
        texel = {0.0f, 0.0f, 0.0f, 1.0f};
        for (size_t c = 0; c < channels; ++c)
            texel[c] = static_cast<float>(random()) * 0x1p-32f - 0.5f;
        std::memcpy(to, texel.data(), texel_bytes);
    }
    held.bound.image = {.texels = held.bytes.data() + kAround,
                        .format = format,
                        .width = size.x,
                        .height = size.y,
                        .depth = size.z,
                        .row_bytes = int64_t{size.x} * texel_bytes,
                        .slice_bytes = int64_t{size.x} * size.y * texel_bytes,
                        .is_array = is_array};
    held.bound.sampler = sampler;
    return held;
}

// Reads the texel that is nearest within the image; zeros beyond it where the sampler says so.
Texel read(const Held& held, std::array<int, 3> at) {
    const native::Image& image = held.bound.image;
    const int size[3] = {static_cast<int>(image.width), static_cast<int>(image.height),
                         static_cast<int>(image.depth)};
    for (size_t axis = 0; axis < 3; ++axis) {
        if (held.bound.sampler.is_clamped_to_border && (at[axis] < 0 || at[axis] >= size[axis]))
            return {};
        at[axis] = std::clamp(at[axis], 0, size[axis] - 1);
    }
    return held.at(at[0], at[1], at[2]);
}

Texel between(const Texel& a, const Texel& b, float weight) {
    Texel out;
    for (size_t c = 0; c < 4; ++c)
        out[c] = a[c] + weight * (b[c] - a[c]);
    return out;
}

// Vulkan 1.3, 16.6 to 16.9: along x, then y, then z.
Texel sampled(const Held& held, int dimensions, std::array<float, 3> place) {
    const native::Image& image = held.bound.image;
    const uint32_t size[3] = {image.width, image.height, image.depth};
    std::array<int, 3> low{};
    std::array<float, 3> weight{};
    for (size_t axis = 0; axis < static_cast<size_t>(dimensions); ++axis) {
        const float t = place[axis] * static_cast<float>(size[axis]) -
                        (held.bound.sampler.is_linear ? 0.5f : 0.0f);
        low[axis] = static_cast<int>(std::floor(t));
        weight[axis] = t - std::floor(t);
    }
    if (image.is_array) // the nearest layer
        low[2] = std::clamp(static_cast<int>(std::floor(place[2] + 0.5f)), 0,
                            static_cast<int>(image.depth) - 1);
    if (!held.bound.sampler.is_linear)
        return read(held, low);
    const auto along_x = [&](int y, int z) {
        return between(read(held, {low[0], y, z}), read(held, {low[0] + 1, y, z}), weight[0]);
    };
    const auto along_y = [&](int z) {
        return dimensions < 2 ? along_x(low[1], z)
                              : between(along_x(low[1], z), along_x(low[1] + 1, z), weight[1]);
    };
    return dimensions < 3 ? along_y(low[2])
                          : between(along_y(low[2]), along_y(low[2] + 1), weight[2]);
}

// Within the image, on its faces, on texels' centres and well outside.
std::vector<std::array<float, 4>> random_places() {
    std::mt19937 random(2);
    const auto below = [&](uint32_t n) { return static_cast<float>(random() % n); };
    std::vector<std::array<float, 4>> places(kPlaces);
    for (auto& place : places) {
        for (size_t axis = 0; axis < 3; ++axis)
            place[axis] =
                random() % 4 == 0 ? below(9) / 8.0f : below(1u << 20) * 0x1.8p-20f - 0.25f;
        place[3] = below(12) / 2.0f - 1.0f;
    }
    return places;
}

uint32_t bits_of(float x) {
    return std::isnan(x) ? 0x7fc00000u : std::bit_cast<uint32_t>(x);
}

void expect_formulas(const Held& volume, const Held& table) {
    const Shader shader = spirv::Images{};
    const native::Kernel* kernel = native::find_kernel(native::hash_of(shader.code->words));
    ASSERT_TRUE(kernel);
    std::vector<std::array<float, 4>> places = random_places();
    std::vector<Texel> results(3 * kPlaces, Texel{7.0f, 7.0f, 7.0f, 7.0f});
    std::array<native::Resource, 4> resources{volume.bound, table.bound};
    const auto bind = [](native::Resource& to, auto& all) {
        to.buffer = {reinterpret_cast<std::byte*>(all.data()), sizeof all[0] * all.size()};
    };
    bind(resources[2], places);
    bind(resources[3], results);
    kernel->run({.resources = resources, .groups = {kPlaces / 64, 1, 1}}, 0, kPlaces / 64);
    size_t wrong = 0;
    for (size_t i = 0; i < kPlaces; ++i) {
        const auto [x, y, z, layer] = places[i];
        std::array<int, 3> fetched{};
        for (size_t axis = 0; axis < 3; ++axis)
            fetched[axis] = static_cast<int>(std::floor(places[i][axis] * 8.0f));
        const native::Image& image = volume.bound.image;
        const auto in = [](int at, uint32_t size) { return static_cast<uint32_t>(at) < size; };
        const bool inside = in(fetched[0], image.width) && in(fetched[1], image.height) &&
                            in(fetched[2], image.depth);
        std::array<Texel, 3> expected{sampled(volume, 3, {x, y, z}),
                                      sampled(table, 1, {x, 0, layer}),
                                      inside ? read(volume, fetched) : Texel{}};
        if (!inside && native::texel_bytes(image.format) == 4)
            expected[2][3] = 1.0f;
        if (i % 3 == 0)
            expected.fill({7.0f, 7.0f, 7.0f, 7.0f});
        for (size_t kind = 0; kind < 3; ++kind)
            for (size_t c = 0; c < 4; ++c)
                if (bits_of(expected[kind][c]) != bits_of(results[3 * i + kind][c]) &&
                    ++wrong <= 10)
                    ADD_FAILURE() << "format " << image.format << ", kind " << kind << ", channel "
                                  << c << " at " << x << ", " << y << ", " << z << ", " << layer
                                  << ": expected " << expected[kind][c] << ", found "
                                  << results[3 * i + kind][c];
    }
    EXPECT_EQ(wrong, 0u);
}

TEST(NativeImages, ReadAsVulkansFormulasSay) {
    for (const VkFormat format :
         {VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_R32G32B32A32_SFLOAT, VK_FORMAT_R32_SFLOAT})
        for (const bool is_linear : {false, true})
            for (const bool is_clamped_to_border : {false, true})
                for (const Size size : {Size{7, 5, 3}, Size{2, 1, 4}, Size{1, 6, 2}}) {
                    const native::Sampler sampler{.is_linear = is_linear,
                                                  .is_clamped_to_border = is_clamped_to_border};
                    expect_formulas(
                        random_image(format, size, false, sampler),
                        random_image(VK_FORMAT_R32G32B32A32_SFLOAT, {16, 1, 4}, true, sampler));
                }
}

} // namespace
} // namespace palpate
