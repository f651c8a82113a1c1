#include "engine/surface_gpu/sample_image.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace palpate {

namespace {

constexpr uint64_t kStagingBytes = uint64_t{16} << 20; // at most, at once
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
    : device_(&device),
      type_(volume.type()),
      image_(
          device, "samples of a surface",
          {.type = VK_IMAGE_TYPE_3D, .format = format_of(volume.type()), .size = volume.size()}) {
    upload_all(volume);
}

int SampleImage::bias() const {
    if (type_ == ScalarType::i8)
        return 128;
    return type_ == ScalarType::i16 ? 32768 : 0;
}

std::byte* SampleImage::staged(uint64_t bytes) {
    if (!staging_ || staging_->bytes() < bytes)
        staging_.emplace(*device_, "samples to upload", std::bit_ceil(bytes), Memory::upload);
    return staging_->mapped().data();
}

void SampleImage::upload_all(const Volume& volume) {
    const uint64_t brick_bytes = kBrickSamples * bytes_per_sample(type_);
    const uint64_t at_once = std::max<uint64_t>(1, kStagingBytes / brick_bytes);
    const glm::uvec3 count = volume.brick_count();
    const uint64_t bricks = uint64_t{count.x} * count.y * count.z;
    std::byte* const to = staged(std::min(at_once, bricks) * brick_bytes);
    for (uint64_t first = 0; first < bricks; first += at_once) {
        std::vector<Commands::Region> regions;
        for (uint64_t i = first; i < std::min(first + at_once, bricks); ++i) {
            const glm::uvec3 at(i % count.x, i / count.x % count.y,
                                i / (uint64_t{count.x} * count.y));
            const uint64_t offset = (i - first) * brick_bytes;
            stage_cube(volume.brick(at), glm::uvec3(0), kBrickSide, to + offset);
            regions.push_back(
                {offset, at * kBrickSide, volume.valid_in_brick(at), kBrickSide, kBrickSide});
        }
        Commands commands(*device_);
        commands.copy(*staging_, image_, regions);
        commands.submit();
        commands.finish();
    }
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
    const uint64_t at_once = kStagingBytes / block_bytes;
    std::byte* const to = staged(std::min<uint64_t>(at_once, blocks.size()) * block_bytes);
    for (uint64_t first = 0; first < blocks.size(); first += at_once) {
        const uint64_t count = std::min<uint64_t>(at_once, blocks.size() - first);
        std::vector<Commands::Region> regions;
        for (uint64_t i = 0; i < count; ++i) {
            const glm::uvec3 at = blocks[first + i];
            stage_cube(after.brick(at / kBrickSide), at % kBrickSide, kBlockSide,
                       to + i * block_bytes);
            regions.push_back({i * block_bytes, at,
                               glm::min(glm::uvec3(kBlockSide), after.size() - at), kBlockSide,
                               kBlockSide});
        }
        if (first + count == blocks.size()) {
            commands.copy(*staging_, image_, regions);
            break;
        }
        Commands alone(*device_);
        alone.copy(*staging_, image_, regions);
        alone.submit();
        alone.finish();
    }
}

} // namespace palpate
