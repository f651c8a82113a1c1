#include "engine/render/brick_atlas.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/base/assert.h"

namespace palpate {

namespace {

constexpr size_t kSlotTexels =
    size_t{BrickAtlas::kSlotSide} * BrickAtlas::kSlotSide * BrickAtlas::kSlotSide;
constexpr size_t kBricksPerBatch = 64; // about what Commands::upload() sends at once

// Slots on each axis, about a cube, for `bricks` of them.
glm::uvec3 slots_for(size_t bricks, uint32_t most_a_side) {
    const auto wanted = static_cast<double>(bricks);
    const auto side = [&](double n) {
        return std::clamp(static_cast<uint32_t>(std::ceil(n)), 1u, most_a_side);
    };
    glm::uvec3 slots;
    slots.x = side(std::cbrt(wanted));
    slots.y = side(std::sqrt(wanted / slots.x));
    slots.z = side(wanted / (slots.x * slots.y));
    return slots;
}

size_t count_of(glm::uvec3 n) {
    return size_t{n.x} * n.y * n.z;
}

uint64_t slot_bytes(const TexelStorage& storage) {
    return kSlotTexels * texel_bytes(storage.format);
}

// Of the table, and of staging for it and for two batches of bricks.
uint64_t other_bytes(const Volume& volume, const TexelStorage& storage) {
    return 2 * count_of(volume.brick_count()) * sizeof(glm::vec4) +
           2 * kBricksPerBatch * slot_bytes(storage);
}

// One brick with its upper neighbours' first samples, as texels of a slot.
void fill_slot(const Volume& volume, glm::uvec3 position, VkFormat format, std::byte* out) {
    constexpr uint32_t side = BrickAtlas::kSlotSide;
    const glm::uvec3 count = volume.brick_count();
    for (uint32_t part = 0; part < 8; ++part) {
        const glm::uvec3 beyond(part & 1, part >> 1 & 1, part >> 2); // axes on which it is above
        glm::uvec3 brick = position, low(0), high(kBrickSide);
        for (int axis = 0; axis < 3; ++axis) {
            if (beyond[axis] == 0)
                continue;
            const bool is_last = position[axis] + 1 == count[axis];
            brick[axis] += is_last ? 0 : 1;
            low[axis] = is_last ? kBrickSide - 1 : 0; // padding repeats the last sample
            high[axis] = low[axis] + 1;
        }
        const glm::uvec3 at = beyond * kBrickSide;
        store_texels(volume.brick(brick), format, low, high, side, side,
                     out + (at.x + side * (at.y + size_t{side} * at.z)) * texel_bytes(format));
    }
}

} // namespace

uint64_t BrickAtlas::bytes_for(const GpuDevice& device, const Volume& volume, TexelStorage storage,
                               size_t bricks) {
    const glm::uvec3 slots = slots_for(bricks, device.limits().maxImageDimension3D / kSlotSide);
    return count_of(slots) * slot_bytes(storage) + other_bytes(volume, storage);
}

size_t BrickAtlas::room_for(const GpuDevice& device, const Volume& volume, TexelStorage storage,
                            size_t bricks, uint64_t limit_bytes) {
    size_t slots = std::clamp<size_t>(bricks, 1, count_of(volume.brick_count()));
    while (slots > 0 && bytes_for(device, volume, storage, slots) > limit_bytes)
        slots -= (slots + 63) / 64;
    return slots;
}

Result<BrickAtlas> BrickAtlas::make(GpuDevice& device, std::string name, const Volume& volume,
                                    TexelStorage storage, size_t bricks, uint64_t limit_bytes) {
    const size_t slots = room_for(device, volume, storage, bricks, limit_bytes);
    if (slots == 0)
        return fail("{}: one brick needs {} bytes of graphics memory, and the limit is {}", name,
                    bytes_for(device, volume, storage, 1), limit_bytes);
    if (!device.can_filter_linearly(storage.format))
        return fail("{}: {} cannot interpolate its texels", name, device.info().name);
    return BrickAtlas(device, name, volume, storage,
                      slots_for(slots, device.limits().maxImageDimension3D / kSlotSide));
}

BrickAtlas::BrickAtlas(GpuDevice& device, const std::string& name, const Volume& volume,
                       TexelStorage storage, glm::uvec3 slots)
    : storage_(storage),
      brick_count_(volume.brick_count()),
      slot_count_(slots),
      slots_(count_of(slots)),
      image_(device, name + " atlas",
             {.type = VK_IMAGE_TYPE_3D, .format = storage.format, .size = slots * kSlotSide}),
      table_(device, name + " pages",
             {.type = VK_IMAGE_TYPE_3D,
              .format = VK_FORMAT_R32G32B32A32_SFLOAT,
              .size = brick_count_}) {
    entries_.reserve(count_of(brick_count_));
    for_each_brick(volume, [&](glm::uvec3 position) {
        entries_.push_back(absent_entry(volume.brick(position)));
    });
}

uint64_t BrickAtlas::key_of(glm::uvec3 brick) const {
    return brick.x + brick_count_.x * (brick.y + uint64_t{brick_count_.y} * brick.z);
}

glm::uvec3 BrickAtlas::brick_of(uint64_t key) const {
    return {key % brick_count_.x, key / brick_count_.x % brick_count_.y,
            key / (uint64_t{brick_count_.x} * brick_count_.y)};
}

glm::uvec3 BrickAtlas::origin_of(size_t slot) const {
    return kSlotSide * glm::uvec3(slot % slot_count_.x, slot / slot_count_.x % slot_count_.y,
                                  slot / (size_t{slot_count_.x} * slot_count_.y));
}

glm::vec4 BrickAtlas::absent_entry(const Brick& brick) const {
    const float lowest = brick.range().empty() ? std::numeric_limits<float>::quiet_NaN()
                                               : texel_of(storage_, brick.range().min);
    return {kNotResident, 0, 0, lowest};
}

size_t BrickAtlas::make_resident(const Volume& volume, std::span<const glm::uvec3> wanted,
                                 Commands& commands) {
    PALPATE_ASSERT_CMP(wanted.size(), <=, capacity());
    ++calls_;
    std::vector<uint64_t> missing;
    for (const glm::uvec3 brick : wanted) {
        const auto found = slot_of_brick_.find(key_of(brick));
        if (found == slot_of_brick_.end())
            missing.push_back(key_of(brick));
        else
            slots_[found->second].wanted_at = calls_;
    }
    if (missing.empty()) {
        write_table(commands);
        return 0;
    }
    std::vector<size_t> free; // slots to take, those wanted longest ago first
    for (size_t slot = 0; slot < slots_.size(); ++slot)
        if (slots_[slot].wanted_at < calls_)
            free.push_back(slot);
    std::stable_sort(free.begin(), free.end(),
                     [&](size_t a, size_t b) { return slots_[a].wanted_at < slots_[b].wanted_at; });
    std::vector<std::pair<uint64_t, size_t>> uploads; // (brick, slot)
    for (size_t i = 0; i < missing.size(); ++i) {
        empty_slot(volume, free[i]);
        slots_[free[i]] = {missing[i], calls_};
        slot_of_brick_[missing[i]] = free[i];
        entries_[missing[i]] = {glm::vec3(origin_of(free[i])) + 0.5f, 0.0f};
        uploads.emplace_back(missing[i], free[i]);
    }
    table_is_stale_ = true;
    try {
        upload(volume, uploads, commands);
    } catch (...) { // samples that could not be read
        for (const auto& [brick, slot] : uploads)
            empty_slot(volume, slot);
        throw;
    }
    write_table(commands);
    return uploads.size();
}

void BrickAtlas::empty_slot(const Volume& volume, size_t slot) {
    const uint64_t brick = std::exchange(slots_[slot].brick, kNobody);
    if (brick == kNobody)
        return;
    slot_of_brick_.erase(brick);
    entries_[brick] = absent_entry(volume.brick(brick_of(brick)));
}

void BrickAtlas::drop(const Volume& next, std::span<const ChangedBrick> changed) {
    for (const ChangedBrick& brick : changed) {
        for (uint32_t corner = 0; corner < 8; ++corner) { // itself, and those below it
            const glm::uvec3 below(corner & 1, corner >> 1 & 1, corner >> 2);
            if (glm::any(glm::lessThan(brick.position, below)))
                continue;
            const auto found = slot_of_brick_.find(key_of(brick.position - below));
            if (found != slot_of_brick_.end())
                empty_slot(next, found->second);
        }
        if (slot_of_brick_.count(key_of(brick.position)) == 0)
            entries_[key_of(brick.position)] = absent_entry(next.brick(brick.position));
    }
    table_is_stale_ = table_is_stale_ || !changed.empty();
}

void BrickAtlas::upload(const Volume& volume, std::span<const std::pair<uint64_t, size_t>> bricks,
                        Commands& commands) {
    const uint64_t bytes = slot_bytes(storage_);
    commands.upload(image_, bricks.size(), bytes,
                    [&](size_t first, size_t count, std::span<std::byte> to) {
                        std::vector<Commands::Region> regions;
                        for (size_t i = 0; i < count; ++i)
                            regions.push_back({.buffer_offset = i * bytes,
                                               .image_offset = origin_of(bricks[first + i].second),
                                               .size = glm::uvec3(kSlotSide)});
                        tbb::parallel_for(size_t{0}, count, [&](size_t i) {
                            fill_slot(volume, brick_of(bricks[first + i].first), storage_.format,
                                      to.data() + i * bytes);
                        });
                        return regions;
                    });
}

void BrickAtlas::write_table(Commands& commands) {
    if (!std::exchange(table_is_stale_, false))
        return;
    const Commands::Region all{.buffer_offset = 0, .image_offset = {}, .size = brick_count_};
    commands.copy(commands.upload(std::as_bytes(std::span(entries_))), table_, std::span(&all, 1));
}

} // namespace palpate
