#include "engine/surface_gpu/sample_image.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace palpate {

namespace {

constexpr uint32_t kBlockSamples = kBlockSide * kBlockSide * kBlockSide;

VkFormat format_of(ScalarType type) {
    switch (bytes_per_sample(type)) {
        case 1:
            return VK_FORMAT_R8_UINT;
        case 2:
            return VK_FORMAT_R16_UINT;
        default:
            return VK_FORMAT_R32_UINT;
    }
}

// A row of samples as texels: the highest bit of a signed integer turned over raises it by the
// bias.
template <class T>
void stage_row(const T* from, uint32_t stride, uint32_t count, std::byte* to) {
    if constexpr (std::is_same_v<T, float>) {
        for (uint32_t i = 0; i < count; ++i)
            std::memcpy(to + 4 * i, from + stride * i, 4);
    } else {
        using Code = std::make_unsigned_t<T>;
        constexpr auto kRaise =
            static_cast<Code>(std::is_signed_v<T> ? Code{1} << (8 * sizeof(T) - 1) : 0);
        for (uint32_t i = 0; i < count; ++i) {
            const auto code = static_cast<Code>(static_cast<Code>(from[stride * i]) ^ kRaise);
            std::memcpy(to + sizeof(T) * i, &code, sizeof(T));
        }
    }
}

// A cube of a brick's samples, `side` wide, packed.
void stage_cube(const Brick& brick, glm::uvec3 low, uint32_t side, std::byte* to) {
    visit_scalar(brick.type(), [&](auto t) {
        using T = decltype(t);
        const BrickSamples<T> samples = brick.samples<T>();
        for (uint32_t z = 0; z < side; ++z)
            for (uint32_t y = 0; y < side; ++y) {
                const uint32_t at = offset_in_brick(low + glm::uvec3(0, y, z));
                stage_row(samples.data() + brick.stride() * at, brick.stride(), side,
                          to + sizeof(T) * side * (y + side * z));
            }
    });
}

} // namespace

Result<void> SampleImage::fits(const GpuDevice& device, const Volume& volume) {
    const uint32_t most = device.limits().maxImageDimension3D;
    const glm::uvec3 size = volume.size();
    if (std::max({size.x, size.y, size.z}) > most)
        return fail("{}: expected at most {} samples an axis, found {} x {} x {}",
                    device.info().name, most, size.x, size.y, size.z);
    return {};
}

SampleImage::SampleImage(GpuDevice& device, const Volume& volume)
    : type_(volume.type()),
      image_(
          device, "samples of a surface",
          {.type = VK_IMAGE_TYPE_3D, .format = format_of(volume.type()), .size = volume.size()}) {
    const uint64_t brick_bytes = kBrickSamples * bytes_per_sample(type_);
    const glm::uvec3 count = volume.brick_count();
    Commands commands(device);
    commands.upload(image_, size_t{count.x} * count.y * count.z, brick_bytes,
                    [&](size_t first, size_t bricks, std::span<std::byte> to) {
                        std::vector<Commands::Region> regions;
                        for (size_t i = 0; i < bricks; ++i) {
                            const size_t n = first + i;
                            const glm::uvec3 at(n % count.x, n / count.x % count.y,
                                                n / (size_t{count.x} * count.y));
                            stage_cube(volume.brick(at), glm::uvec3(0), kBrickSide,
                                       to.data() + i * brick_bytes);
                            regions.push_back({i * brick_bytes, at * kBrickSide,
                                               volume.valid_in_brick(at), kBrickSide, kBrickSide});
                        }
                        return regions;
                    });
    commands.submit();
    commands.finish();
}

int SampleImage::bias() const {
    if (type_ == ScalarType::i8)
        return 128;
    return type_ == ScalarType::i16 ? 32768 : 0;
}

void SampleImage::bring_changes(Commands& commands, const Volume& after,
                                std::span<const ChangedBrick> changed) {
    std::vector<glm::uvec3> blocks; // their first samples
    for (const ChangedBrick& brick : changed)
        for (uint64_t left = brick.blocks; left != 0; left &= left - 1) {
            const auto n = static_cast<uint32_t>(std::countr_zero(left));
            const glm::uvec3 at =
                brick.position * kBrickSide +
                kBlockSide * glm::uvec3(n % kBlocksPerSide, n / kBlocksPerSide % kBlocksPerSide,
                                        n / (kBlocksPerSide * kBlocksPerSide));
            if (glm::all(glm::lessThan(at, after.size()))) // no padding
                blocks.push_back(at);
        }
    const uint64_t block_bytes = kBlockSamples * bytes_per_sample(type_);
    commands.upload(image_, blocks.size(), block_bytes,
                    [&](size_t first, size_t count, std::span<std::byte> to) {
                        std::vector<Commands::Region> regions;
                        for (size_t i = 0; i < count; ++i) {
                            const glm::uvec3 at = blocks[first + i];
                            stage_cube(after.brick(at / kBrickSide), at % kBrickSide, kBlockSide,
                                       to.data() + i * block_bytes);
                            regions.push_back({i * block_bytes, at,
                                               glm::min(glm::uvec3(kBlockSide), after.size() - at),
                                               kBlockSide, kBlockSide});
                        }
                        return regions;
                    });
}

} // namespace palpate
