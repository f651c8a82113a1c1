#include "engine/render/gradient_image.h"

#include <tbb/parallel_for.h>

#include <bit>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

constexpr VkFormat kFormat = VK_FORMAT_R16G16B16A16_SFLOAT;
constexpr size_t kBytesPerTexel = 8;
constexpr size_t kGradientBricksPerBatch = 16; // what Commands::upload() sends at once
constexpr uint32_t kSide = kBrickSide + 2;     // samples, with one to either side
// The largest difference is scaled to this: half of the largest half, and so far above the
// smallest that a difference 2^-29 of it still counts.
constexpr float kLargest = 32768.0f;

// The nearest half, ties to even, of a float below 65504; 0 where that would be a subnormal.
uint16_t half_of(float value) {
    const uint32_t bits = std::bit_cast<uint32_t>(value);
    const uint32_t sign = bits >> 16 & 0x8000u;
    const uint32_t size = bits & 0x7fffffffu;
    const uint32_t odd = size >> 13 & 1u;
    const uint32_t rounded = (size - 0x38000000u + 0xfffu + odd) >> 13;
    const uint32_t finite = size < 0x38800000u ? 0u : rounded;
    return static_cast<uint16_t>(sign | (size > 0x7f800000u ? 0x7e00u : finite));
}

// How far apart values lie; 1 where there is no data, or one value.
float span_of(const Volume& volume) {
    const float span = volume.range().max - volume.range().min;
    return span > 0.0f ? span : 1.0f;
}

} // namespace

void store_gradients(const Volume& volume, glm::uvec3 brick, float scale, uint16_t* out) {
    thread_local std::vector<float> held(size_t{kSide} * kSide * kSide);
    float* const samples = held.data();
    read_box(volume, glm::ivec3(brick * kBrickSide) - 1, glm::ivec3(kSide),
             packed(glm::uvec3(kSide)), samples);
    constexpr size_t kRow = kSide, kPlane = size_t{kSide} * kSide;
    for (uint32_t z = 0; z < kBrickSide; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y) {
            const float* at = samples + 1 + kRow * (y + 1) + kPlane * (z + 1);
            uint16_t* texel = out + size_t{4} * kBrickSide * (y + kBrickSide * z);
            for (uint32_t x = 0; x < kBrickSide; ++x, ++at, texel += 4) {
                texel[0] = half_of(scale * (*(at + 1) - *(at - 1)));
                texel[1] = half_of(scale * (*(at + kRow) - *(at - kRow)));
                texel[2] = half_of(scale * (*(at + kPlane) - *(at - kPlane)));
                texel[3] = 0;
            }
        }
}

GradientImage::GradientImage(GpuDevice& device, const Volume& volume)
    : snapshot_(volume),
      span_(span_of(volume)),
      filled_(size_t{volume.brick_count().x} * volume.brick_count().y * volume.brick_count().z, 0),
      image_(device, "gradients",
             {.type = VK_IMAGE_TYPE_3D, .format = kFormat, .size = volume.size()}) {}

uint64_t GradientImage::bytes_for(const Volume& volume) {
    return kBytesPerTexel *
           (sample_count(volume.grid()) + uint64_t{2} * kGradientBricksPerBatch * kBrickSamples);
}

void GradientImage::update(const Volume& next, std::span<const ChangedBrick> changed) {
    const glm::ivec3 count(next.brick_count());
    for (const ChangedBrick& brick : changed)
        for (int dz = -1; dz <= 1; ++dz)
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    const glm::ivec3 p = glm::ivec3(brick.position) + glm::ivec3(dx, dy, dz);
                    const bool reads = std::abs(dx) + std::abs(dy) + std::abs(dz) <= 1;
                    if (reads && glm::all(glm::greaterThanEqual(p, glm::ivec3(0))) &&
                        glm::all(glm::lessThan(p, count)))
                        filled_[p.x + count.x * (p.y + size_t(count.y) * p.z)] = 0;
                }
    if (span_of(next) >= 1.99f * span_) { // differences would no longer fit
        span_ = span_of(next);
        std::fill(filled_.begin(), filled_.end(), uint8_t{0});
    }
    snapshot_ = next;
}

size_t GradientImage::fill(const BrickMask& wanted, Commands& commands) {
    PALPATE_ASSERT_CMP(wanted.size(), ==, filled_.size());
    std::vector<glm::uvec3> bricks;
    size_t i = 0;
    for_each_brick(snapshot_, [&](glm::uvec3 position) {
        if (wanted[i] && !filled_[i]) {
            bricks.push_back(position);
            filled_[i] = 1;
        }
        ++i;
    });
    if (bricks.empty())
        return 0;
    const profile::Scope scope("fill gradients");
    const size_t brick_bytes = kBrickSamples * kBytesPerTexel;
    commands.upload(image_, bricks.size(), brick_bytes,
                    [&](size_t first, size_t count, std::span<std::byte> to) {
                        std::vector<Commands::Region> regions;
                        for (size_t k = 0; k < count; ++k)
                            regions.push_back({.buffer_offset = k * brick_bytes,
                                               .image_offset = bricks[first + k] * kBrickSide,
                                               .size = snapshot_.valid_in_brick(bricks[first + k]),
                                               .row_texels = kBrickSide,
                                               .plane_rows = kBrickSide});
                        tbb::parallel_for(size_t{0}, count, [&](size_t k) {
                            store_gradients(
                                snapshot_, bricks[first + k], kLargest / span_,
                                reinterpret_cast<uint16_t*>(to.data() + k * brick_bytes));
                        });
                        return regions;
                    });
    return bricks.size();
}

} // namespace palpate
