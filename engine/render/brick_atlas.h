#pragma once

#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/base/error.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/resource.h"
#include "engine/render/texel_storage.h"
#include "engine/volume/changes.h"

namespace palpate {

// Some bricks of a volume on the GPU: a 3D image of slots, and a table that says where each brick
// of the volume lies.
//
// A slot holds the brick's 32 samples on each axis and one more, the first of the brick above (at
// the end of the volume the last sample once more), so that every cell whose lowest corner lies in
// the brick is interpolated within its slot.
class BrickAtlas {
 public:
    static constexpr uint32_t kSlotSide = 33; // texels

    // Slots for as many of `bricks` bricks as limit_bytes takes, table and staging included. Fails
    // with both numbers when that is not even one.
    static Result<BrickAtlas> make(GpuDevice& device, std::string name, const Volume& volume,
                                   TexelStorage storage, size_t bricks, uint64_t limit_bytes);

    // Bytes that slots for this many bricks take, table and staging included.
    static uint64_t bytes_for(const GpuDevice& device, const Volume& volume, TexelStorage storage,
                              size_t bricks);

    // How many of `bricks` slots make() would have room for; 0 where not even one.
    static size_t room_for(const GpuDevice& device, const Volume& volume, TexelStorage storage,
                           size_t bricks, uint64_t limit_bytes);

    size_t capacity() const { return slots_.size(); } // bricks

    // Makes every one of `wanted` resident, each once and no more than capacity(), for what is
    // recorded into `commands` from here on; drops others where there is no room, those wanted
    // longest ago first. Returns how many were uploaded.
    size_t make_resident(const Volume& volume, std::span<const glm::uvec3> wanted,
                         Commands& commands);

    // Drops what a later snapshot changed: the bricks, and those that hold a sample of theirs.
    // make_resident() comes before the next use.
    void drop(const Volume& next, std::span<const ChangedBrick> changed);

    GpuImage& image() { return image_; }
    // RGBA32F, a texel a brick. Resident: xyz is the middle of the slot's first texel, in texels of
    // image(), and w is 0. Else x is kNotResident, and w is the texel of the brick's lowest value.
    GpuImage& table() { return table_; }
    static constexpr float kNotResident = -1e9f;

 private:
    BrickAtlas(GpuDevice& device, const std::string& name, const Volume& volume,
               TexelStorage storage, glm::uvec3 slots);
    void upload(const Volume& volume, std::span<const std::pair<uint64_t, size_t>> bricks,
                Commands& commands);
    void empty_slot(const Volume& volume, size_t slot);
    void write_table(Commands& commands);
    glm::vec4 absent_entry(const Brick& brick) const;
    glm::uvec3 origin_of(size_t slot) const;
    uint64_t key_of(glm::uvec3 brick) const;
    glm::uvec3 brick_of(uint64_t key) const;

    static constexpr uint64_t kNobody = ~uint64_t{0};
    struct Slot {
        uint64_t brick = kNobody;
        uint64_t wanted_at = 0; // the call that last asked for it
    };
    TexelStorage storage_;
    glm::uvec3 brick_count_, slot_count_;
    std::vector<Slot> slots_;
    std::unordered_map<uint64_t, size_t> slot_of_brick_;
    std::vector<glm::vec4> entries_; // of the table
    bool table_is_stale_ = true;     // on the device
    uint64_t calls_ = 0;
    GpuImage image_, table_;
};

} // namespace palpate
