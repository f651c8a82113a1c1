#include "engine/render/gpu_volume.h"

#include <algorithm>

#include "engine/base/option_name.h"
#include "engine/base/profile.h"

namespace palpate {

namespace {

uint64_t dense_bytes(const Volume& volume, const TexelStorage& storage) {
    return sample_count(volume.grid()) * texel_bytes(storage.format);
}

// About the changed blocks of a brick of which `valid` samples lie in the volume.
BrickBox changed_box(const ChangedBrick& brick, glm::uvec3 valid) {
    const auto [low, high] = changed_samples(brick);
    return {glm::min(low, valid), glm::min(high, valid)};
}

double mib(uint64_t bytes) {
    return static_cast<double>(bytes) / (1 << 20);
}

} // namespace

struct GpuVolume::Choice {
    bool atlas;
    TexelStorage storage;
    std::string reason;
};

GpuVolume::Choice GpuVolume::choose(const GpuDevice& device, const Volume& volume,
                                    const GpuVolumeWish& wish) {
    const glm::uvec3 size = volume.size();
    const uint32_t longest = std::max({size.x, size.y, size.z});
    const uint32_t side_limit = device.limits().maxImageDimension3D;
    const TexelStorage first = texel_storage(device, volume.type(), wish.format);
    TexelStorage small = first; // where `first` takes more than needs be
    if (wish.format == TexelFormat::automatic)
        small = texel_storage(device, volume.type(), TexelFormat::unorm16);
    const auto fits = [&](const TexelStorage& storage) {
        return longest <= side_limit && dense_bytes(volume, storage) <= wish.limit_bytes;
    };
    const auto atlas_bytes = [&](const TexelStorage& storage) {
        return BrickAtlas::bytes_for(device, volume, storage, wish.bricks());
    };
    const TexelStorage dense = fits(first) ? first : small;
    const TexelStorage packed = atlas_bytes(first) <= wish.atlas_limit_bytes() ? first : small;
    const uint64_t bytes = dense_bytes(volume, dense);
    const bool label = wish.format == TexelFormat::label;
    if (wish.residency == Residency::dense || label)
        return {false, dense, label ? "labels are never filtered" : "asked for"};
    if (wish.residency == Residency::atlas)
        return {true, packed, "asked for"};
    if (longest > side_limit)
        return {true, packed,
                fmt::format("{} samples on an axis are more than the {} of the device's images",
                            longest, side_limit)};
    if (bytes > wish.limit_bytes)
        return {true, packed,
                fmt::format("all of it would take {:.0f} MiB and the limit is {:.0f} MiB",
                            mib(bytes), mib(wish.limit_bytes))};
    if (bytes > wish.limit_bytes / 2 && atlas_bytes(packed) < bytes / 4)
        return {true, packed,
                fmt::format("what can be seen takes {:.0f} MiB, all of it would take {:.0f} MiB",
                            mib(atlas_bytes(packed)), mib(bytes))};
    return {false, dense,
            fmt::format("it takes {:.0f} MiB and the limit is {:.0f} MiB", mib(bytes),
                        mib(wish.limit_bytes))};
}

Result<GpuVolume> GpuVolume::make(GpuDevice& device, std::string name, const Volume& volume,
                                  const GpuVolumeWish& wish, Commands& commands) {
    Choice choice = choose(device, volume, wish);
    GpuVolume made(device, volume, wish, choice.storage);
    made.reason_ = std::move(choice.reason);
    const TexelStorage first = texel_storage(device, volume.type(), wish.format);
    if (choice.storage.format != first.format)
        made.reason_ += fmt::format(", with texels of {} bytes for want of room for {}",
                                    texel_bytes(choice.storage.format), texel_bytes(first.format));
    const VkFormat format = choice.storage.format;
    if (wish.format != TexelFormat::label && !device.can_filter_linearly(format))
        return fail("{}: {} cannot interpolate its texels", name, device.info().name);
    if (choice.atlas) {
        PALPATE_TRY(BrickAtlas atlas, BrickAtlas::make(device, name, volume, choice.storage,
                                                       wish.bricks(), wish.atlas_limit_bytes()));
        made.atlas_.emplace(std::move(atlas));
        return made;
    }
    const uint32_t limit = device.limits().maxImageDimension3D;
    const glm::uvec3 size = volume.size();
    if (size.x > limit || size.y > limit || size.z > limit)
        return fail(
            "{}: expected at most {} samples on each axis on this device, found {} x {} x {}", name,
            limit, size.x, size.y, size.z);
    if (const uint64_t bytes = dense_bytes(volume, choice.storage); bytes > wish.limit_bytes)
        return fail("{}: needs {} bytes of graphics memory, and {} are left of the limit ({})",
                    name, bytes, wish.limit_bytes, Option{"gpu-memory"});
    made.image_.emplace(device, std::move(name),
                        ImageShape{.type = VK_IMAGE_TYPE_3D, .format = format, .size = size});
    std::vector<ChangedBrick> all;
    for_each_brick(volume, [&](glm::uvec3 position) { all.push_back({position, ~uint64_t{0}}); });
    made.upload(volume, all, commands);
    return made;
}

uint64_t GpuVolume::bytes_for(const GpuDevice& device, const Volume& volume,
                              const GpuVolumeWish& wish) {
    const Choice choice = choose(device, volume, wish);
    if (!choice.atlas)
        return dense_bytes(volume, choice.storage);
    const size_t room = BrickAtlas::room_for(device, volume, choice.storage, wish.bricks(),
                                             wish.atlas_limit_bytes());
    return BrickAtlas::bytes_for(device, volume, choice.storage, room);
}

GpuVolume::GpuVolume(GpuDevice& device, const Volume& volume, const GpuVolumeWish& wish,
                     TexelStorage storage)
    : device_(&device), snapshot_(volume), wish_(wish), storage_(storage) {}

bool GpuVolume::suits(const Volume& next, const GpuVolumeWish& wish) const {
    if (next.size() != snapshot_.size() || next.type() != snapshot_.type() ||
        wish.format != wish_.format || wish.residency != wish_.residency)
        return false;
    if (!atlas_) // its bytes count in no later limit
        return true;
    return atlas_->capacity() >=
           BrickAtlas::room_for(*device_, next, storage_, wish.bricks(), wish.atlas_limit_bytes());
}

void GpuVolume::update(const Volume& next, std::span<const ChangedBrick> changed,
                       Commands& commands) {
    if (atlas_)
        atlas_->update(next, changed);
    else
        upload(next, changed, commands);
    snapshot_ = next;
}

void GpuVolume::upload(const Volume& from, std::span<const ChangedBrick> bricks,
                       Commands& commands) {
    if (bricks.empty())
        return;
    const profile::Scope scope("upload bricks");
    const size_t texel = texel_bytes(storage_.format);
    commands.upload(*image_, bricks.size(), kBrickSamples * texel,
                    [&](size_t first, size_t count, std::span<std::byte> to) {
                        std::vector<Commands::Region> regions;
                        size_t at = 0;
                        for (const ChangedBrick& brick : bricks.subspan(first, count)) {
                            const auto [low, high] =
                                changed_box(brick, from.valid_in_brick(brick.position));
                            const glm::uvec3 size = high - low;
                            store_texels(from.brick(brick.position), storage_.format, low, high,
                                         size.x, size.y, to.data() + at);
                            regions.push_back({.buffer_offset = at,
                                               .image_offset = brick.position * kBrickSide + low,
                                               .size = size,
                                               .row_texels = size.x,
                                               .plane_rows = size.y});
                            at += texel * size.x * size.y * size.z;
                        }
                        return regions;
                    });
}

} // namespace palpate
