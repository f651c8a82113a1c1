#include "engine/render/brick_atlas.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "engine/base/assert.h"
#include "engine/base/option_name.h"

namespace palpate {

namespace {

constexpr size_t kSlotTexels =
    size_t{BrickAtlas::kSlotSide} * BrickAtlas::kSlotSide * BrickAtlas::kSlotSide;
constexpr size_t kBricksPerBatch = 64;

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

// Bytes of the table, and of staging for it and for two batches of bricks.
uint64_t other_bytes(const Volume& volume, const TexelStorage& storage) {
    return 2 * count_of(volume.brick_count()) * sizeof(glm::vec4) +
           2 * kBricksPerBatch * slot_bytes(storage);
}

// Texels [low, high) of a slot: one brick with its upper neighbours' first samples.
void fill_slot(const Volume& volume, glm::uvec3 position, VkFormat format, glm::uvec3 low,
               glm::uvec3 high, std::byte* out) {
    const glm::uvec3 count = volume.brick_count(), size = high - low;
    for (uint32_t part = 0; part < 8; ++part) {
        const glm::uvec3 beyond(part & 1, part >> 1 & 1, part >> 2); // axes on which it is above
        const glm::uvec3 first = glm::max(low, beyond * kBrickSide);
        const glm::uvec3 end = glm::min(high, beyond + kBrickSide);
        if (glm::any(glm::greaterThanEqual(first, end)))
            continue;
        glm::uvec3 brick = position, from = first;
        for (int axis = 0; axis < 3; ++axis) {
            if (beyond[axis] == 0)
                continue;
            const bool is_last = position[axis] + 1 == count[axis];
            brick[axis] += is_last ? 0 : 1;
            from[axis] = is_last ? kBrickSide - 1 : 0; // padding repeats the last sample
        }
        const glm::uvec3 at = first - low;
        store_texels(volume.brick(brick), format, from, from + (end - first), size.x, size.y,
                     out + (at.x + size.x * (at.y + size_t{size.y} * at.z)) * texel_bytes(format));
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
        return fail(
            "{}: one brick needs {} bytes of graphics memory, and {} are left of the limit "
            "({})",
            name, bytes_for(device, volume, storage, 1), limit_bytes, Option{"gpu-memory"});
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
      places_(count_of(brick_count_)),
      slots_(count_of(slots)),
      image_(device, name + " atlas",
             {.type = VK_IMAGE_TYPE_3D, .format = storage.format, .size = slots * kSlotSide}),
      table_(device, name + " pages",
             {.type = VK_IMAGE_TYPE_3D,
              .format = VK_FORMAT_R32G32B32A32_SFLOAT,
              .size = brick_count_}) {
    entries_.reserve(places_.size());
    for_each_brick(volume, [&](glm::uvec3 position) {
        entries_.push_back(absent_entry(volume.brick(position)));
    });
    for (uint32_t slot = 0; slot < slots_.size(); ++slot)
        slots_[slot].idle = idle_.insert(idle_.end(), slot);
}

size_t BrickAtlas::index_of(glm::uvec3 brick) const {
    return brick.x + brick_count_.x * (brick.y + size_t{brick_count_.y} * brick.z);
}

glm::uvec3 BrickAtlas::brick_of(size_t index) const {
    return {index % brick_count_.x, index / brick_count_.x % brick_count_.y,
            index / (size_t{brick_count_.x} * brick_count_.y)};
}

glm::uvec3 BrickAtlas::origin_of(uint32_t slot) const {
    return kSlotSide * glm::uvec3(slot % slot_count_.x, slot / slot_count_.x % slot_count_.y,
                                  slot / (slot_count_.x * slot_count_.y));
}

glm::vec4 BrickAtlas::absent_entry(const Brick& brick) const {
    const float lowest = brick.range().empty() ? std::numeric_limits<float>::quiet_NaN()
                                               : texel_of(storage_, brick.range().min);
    return {kNotResident, 0, 0, lowest};
}

void BrickAtlas::set_entry(size_t brick, glm::vec4 entry) {
    if (std::memcmp(&entries_[brick], &entry, sizeof entry) == 0)
        return;
    entries_[brick] = entry;
    if (!all_dirty_)
        dirty_.push_back(brick);
    if (dirty_.size() > entries_.size() / 8)
        all_dirty_ = true;
}

void BrickAtlas::want(glm::uvec3 brick, bool wanted) {
    Place& place = places_[index_of(brick)];
    if (place.wanted == wanted)
        return;
    place.wanted = wanted;
    if (place.slot == kNone) {
        if (wanted && !std::exchange(place.listed, true))
            missing_.push_back(index_of(brick));
        return;
    }
    Slot& slot = slots_[place.slot];
    if (wanted)
        busy_.splice(busy_.end(), idle_, slot.idle);
    else if (place.listed) // what it holds is out of date
        idle_.splice(idle_.begin(), busy_, slot.idle);
    else
        idle_.splice(idle_.end(), busy_, slot.idle);
}

void BrickAtlas::want_only(std::span<const glm::uvec3> bricks) {
    for (const size_t brick : missing_) // of those without a slot
        if (places_[brick].slot == kNone)
            places_[brick].wanted = false;
    const std::vector<uint32_t> busy(busy_.begin(), busy_.end());
    for (const uint32_t slot : busy)
        want(brick_of(slots_[slot].brick), false);
    for (const glm::uvec3 brick : bricks)
        want(brick, true);
}

void BrickAtlas::empty_slot(const Volume& volume, uint32_t slot) {
    if (!std::exchange(slots_[slot].used, false))
        return;
    const size_t brick = slots_[slot].brick;
    places_[brick].slot = kNone;
    set_entry(brick, absent_entry(volume.brick(brick_of(brick))));
}

void BrickAtlas::update(const Volume& next, std::span<const ChangedBrick> changed) {
    for (const ChangedBrick& brick : changed) {
        const auto [low, high] = changed_samples(brick);
        for (uint32_t corner = 0; corner < 8; ++corner) { // itself, and those below it
            const glm::uvec3 below(corner & 1, corner >> 1 & 1, corner >> 2);
            glm::uvec3 first = low, end = high; // texels of the slot
            bool reads = true;
            for (int axis = 0; axis < 3; ++axis)
                if (below[axis] == 1) {
                    reads = reads && brick.position[axis] > 0 && low[axis] == 0;
                    first[axis] = kBrickSide;
                    end[axis] = kSlotSide;
                } else if (high[axis] == kBrickSide &&
                           brick.position[axis] + 1 == brick_count_[axis]) {
                    end[axis] = kSlotSide; // the last sample once more
                }
            if (!reads)
                continue;
            const size_t index = index_of(brick.position - below);
            Place& place = places_[index];
            if (place.slot == kNone)
                continue;
            if (!place.wanted) {
                idle_.splice(idle_.begin(), idle_, slots_[place.slot].idle);
                empty_slot(next, place.slot);
                continue;
            }
            place.low = glm::min(place.low, glm::u8vec3(first));
            place.high = glm::max(place.high, glm::u8vec3(end));
            if (!std::exchange(place.listed, true))
                missing_.push_back(index);
        }
        const size_t index = index_of(brick.position);
        if (places_[index].slot == kNone)
            set_entry(index, absent_entry(next.brick(brick.position)));
    }
}

size_t BrickAtlas::upload_wanted(const Volume& volume, Commands& commands) {
    struct Piece {
        size_t brick;
        glm::uvec3 low, high; // texels of its slot
    };
    std::vector<Piece> bricks;
    for (const size_t brick : std::exchange(missing_, {})) {
        Place& place = places_[brick];
        place.listed = false;
        const glm::uvec3 low(std::exchange(place.low, glm::u8vec3(kSlotSide)));
        const glm::uvec3 high(std::exchange(place.high, glm::u8vec3(0)));
        if (!place.wanted) {
            if (place.slot != kNone)
                empty_slot(volume, place.slot);
            continue;
        }
        if (place.slot != kNone) { // the same place, anew
            bricks.push_back({brick, low, high});
            continue;
        }
        bricks.push_back({brick, glm::uvec3(0), glm::uvec3(kSlotSide)});
        PALPATE_ASSERT(!idle_.empty());
        place.slot = idle_.front();
        empty_slot(volume, place.slot);
        Slot& slot = slots_[place.slot];
        slot.brick = brick;
        slot.used = true;
        busy_.splice(busy_.end(), idle_, slot.idle);
        set_entry(brick, {glm::vec3(origin_of(place.slot)) + 0.5f, 0.0f});
    }
    commands.upload(
        image_, bricks.size(), slot_bytes(storage_) + 3,
        [&](size_t first, size_t count, std::span<std::byte> to) {
            std::vector<Commands::Region> regions;
            uint64_t at = 0;
            for (const Piece& piece : std::span(bricks).subspan(first, count)) {
                regions.push_back({.buffer_offset = at,
                                   .image_offset = origin_of(places_[piece.brick].slot) + piece.low,
                                   .size = piece.high - piece.low});
                at += count_of(regions.back().size) * texel_bytes(storage_.format);
                at = (at + 3) / 4 * 4; // of what a copy may begin at
            }
            tbb::parallel_for(size_t{0}, count, [&](size_t i) {
                const Piece& piece = bricks[first + i];
                fill_slot(volume, brick_of(piece.brick), storage_.format, piece.low, piece.high,
                          to.data() + regions[i].buffer_offset);
            });
            return regions;
        });
    write_table(commands);
    return bricks.size();
}

void BrickAtlas::write_table(Commands& commands) {
    if (!all_dirty_ && dirty_.empty())
        return;
    glm::uvec3 size(1); // of what is copied at a time: an entry, or a layer
    if (std::exchange(all_dirty_, false)) {
        size = {brick_count_.x, brick_count_.y, 1};
        dirty_.clear();
        for (size_t layer = 0; layer < brick_count_.z; ++layer)
            dirty_.push_back(layer * size.x * size.y);
    }
    std::sort(dirty_.begin(), dirty_.end());
    dirty_.erase(std::unique(dirty_.begin(), dirty_.end()), dirty_.end());
    const size_t bytes = size_t{size.x} * size.y * sizeof(glm::vec4);
    commands.upload(
        table_, dirty_.size(), bytes, [&](size_t first, size_t count, std::span<std::byte> to) {
            std::vector<Commands::Region> regions;
            for (size_t i = 0; i < count; ++i) {
                const size_t entry = dirty_[first + i];
                std::memcpy(to.data() + i * bytes, &entries_[entry], bytes);
                regions.push_back(
                    {.buffer_offset = i * bytes, .image_offset = brick_of(entry), .size = size});
            }
            return regions;
        });
    dirty_.clear();
}

} // namespace palpate
