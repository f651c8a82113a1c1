#include "engine/render/gpu_volume.h"

#include <array>
#include <cstring>
#include <optional>

#include "engine/base/assert.h"
#include "engine/base/profile.h"

namespace palpate {

namespace {

constexpr size_t kBricksPerBatch = 32;

// The first code of a type, which unorm16 stores as 0.
int32_t code_bias(ScalarType type) {
    return type == ScalarType::i16 ? -32768 : type == ScalarType::i8 ? -128 : 0;
}

struct Storage {
    VkFormat format;
    float scale = 1.0f, bias = 0.0f;
};

Storage storage_of(const Device& device, ScalarType type, TexelFormat wanted) {
    if (wanted == TexelFormat::label)
        return {type == ScalarType::u8 ? VK_FORMAT_R8_UINT : VK_FORMAT_R16_UINT};
    if (wanted == TexelFormat::automatic)
        wanted = device.info().is_cpu() ? TexelFormat::f32 : TexelFormat::unorm16;
    if (type == ScalarType::f32 || wanted == TexelFormat::f32)
        return {VK_FORMAT_R32_SFLOAT};
    return {VK_FORMAT_R16_UNORM, 65535.0f, static_cast<float>(code_bias(type))};
}

size_t texel_bytes(VkFormat format) {
    switch (format) {
        case VK_FORMAT_R8_UINT:
            return 1;
        case VK_FORMAT_R16_UINT:
        case VK_FORMAT_R16_UNORM:
            return 2;
        default:
            return 4;
    }
}

void convert(const Brick& brick, VkFormat format, std::byte* out) {
    switch (format) {
        case VK_FORMAT_R8_UINT:
            brick.read(std::span(reinterpret_cast<uint8_t*>(out), kBrickSamples));
            return;
        case VK_FORMAT_R16_UINT:
            brick.read(std::span(reinterpret_cast<uint16_t*>(out), kBrickSamples));
            return;
        case VK_FORMAT_R16_UNORM:
            visit_scalar(brick.type(), [&](auto t) {
                const auto samples = brick.samples<decltype(t)>();
                const auto* in = samples.data();
                const int32_t bias = code_bias(brick.type());
                auto* codes = reinterpret_cast<uint16_t*>(out);
                for (uint32_t i = 0; i < kBrickSamples; ++i)
                    codes[i] =
                        static_cast<uint16_t>(static_cast<int32_t>(in[brick.stride() * i]) - bias);
            });
            return;
        default:
            brick.read(std::span(reinterpret_cast<float*>(out), kBrickSamples));
            return;
    }
}

} // namespace

Result<GpuVolume> GpuVolume::make(Device& device, std::string name, const Volume& volume,
                                  TexelFormat format, uint64_t memory_limit_bytes) {
    const Storage storage = storage_of(device, volume.type(), format);
    const uint32_t limit = device.limits().maxImageDimension3D;
    const glm::uvec3 size = volume.size();
    if (size.x > limit || size.y > limit || size.z > limit)
        return fail(
            "{}: expected at most {} samples on each axis on this device, found {} x {} x {}", name,
            limit, size.x, size.y, size.z);
    const uint64_t bytes = sample_count(volume.grid()) * texel_bytes(storage.format);
    if (bytes > memory_limit_bytes)
        return fail("{}: needs {} bytes of graphics memory, and the limit is {}", name, bytes,
                    memory_limit_bytes);
    if (format != TexelFormat::label && !device.can_filter_linearly(storage.format))
        return fail("{}: {} cannot interpolate its texels", name, device.info().name);
    GpuVolume made(device, std::move(name), volume, format, storage.format, storage.scale,
                   storage.bias);
    std::vector<glm::uvec3> all;
    for_each_brick(volume, [&](glm::uvec3 position) { all.push_back(position); });
    made.upload(volume, all);
    return made;
}

GpuVolume::GpuVolume(Device& device, std::string name, const Volume& volume, TexelFormat requested,
                     VkFormat format, float scale, float bias)
    : device_(&device),
      snapshot_(volume),
      requested_(requested),
      value_scale_(scale),
      value_bias_(bias),
      image_(device, std::move(name),
             {.type = VK_IMAGE_TYPE_3D, .format = format, .size = volume.size()}) {}

bool GpuVolume::suits(const Volume& next, TexelFormat format) const {
    return next.size() == snapshot_.size() && next.type() == snapshot_.type() &&
           format == requested_;
}

void GpuVolume::update(const Volume& next, std::span<const ChangedBrick> changed) {
    std::vector<glm::uvec3> positions;
    for (const ChangedBrick& brick : changed)
        positions.push_back(brick.position);
    upload(next, positions);
    snapshot_ = next;
}

void GpuVolume::upload(const Volume& from, std::span<const glm::uvec3> bricks) {
    if (bricks.empty())
        return;
    const profile::Scope scope("upload bricks");
    // Two halves of staging: one is filled while the GPU copies the other.
    const VkFormat format = image_.shape().format;
    const size_t brick_bytes = kBrickSamples * texel_bytes(format);
    const size_t batch = std::min(kBricksPerBatch, bricks.size());
    std::array<std::optional<Buffer>, 2> staging;
    std::array<std::optional<Commands>, 2> commands;
    for (size_t first = 0, half = 0; first < bricks.size(); first += batch, half ^= 1) {
        if (!staging[half])
            staging[half].emplace(*device_, "upload", batch * brick_bytes, Memory::upload);
        if (commands[half])
            commands[half]->finish();
        commands[half].emplace(*device_);
        std::vector<Commands::Region> regions;
        for (size_t i = first; i < std::min(first + batch, bricks.size()); ++i) {
            const uint64_t offset = (i - first) * brick_bytes;
            convert(from.brick(bricks[i]), format, staging[half]->mapped().data() + offset);
            regions.push_back({.buffer_offset = offset,
                               .image_offset = bricks[i] * kBrickSide,
                               .size = from.valid_in_brick(bricks[i]),
                               .row_texels = kBrickSide,
                               .plane_rows = kBrickSide});
        }
        commands[half]->copy(*staging[half], image_, regions);
        commands[half]->submit();
    }
    for (auto& submitted : commands)
        if (submitted)
            submitted->finish();
}

} // namespace palpate
