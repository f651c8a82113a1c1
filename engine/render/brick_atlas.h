#pragma once

#include <glm/gtc/type_precision.hpp>
#include <list>
#include <span>
#include <string>
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

    // Says whether a brick is wanted on the device. One that no longer is stays there until its
    // slot is needed: those wanted longest ago go first.
    void want(glm::uvec3 brick, bool wanted);
    void want_only(std::span<const glm::uvec3> bricks);

    // Tells of a later snapshot: where it differs, bricks that are wanted are to be uploaded anew,
    // and those that hold a sample of theirs, in the box that changed; others go.
    void update(const Volume& next, std::span<const ChangedBrick> changed);

    // Uploads the bricks that are wanted and not there as the snapshot has them, capacity() of them
    // at most, and what changed of the table. To be called before anything samples. Returns how
    // many bricks were uploaded. Where it throws, as for samples that cannot be read, the atlas is
    // of no use any more.
    size_t upload_wanted(const Volume& volume, Commands& commands);

    GpuImage& image() { return image_; }
    // RGBA32F, a texel a brick. Resident: xyz is the middle of the slot's first texel, in texels of
    // image(), and w is 0. Else x is kNotResident, and w is the texel of the brick's lowest value.
    GpuImage& table() { return table_; }
    static constexpr float kNotResident = -1e9f;

 private:
    BrickAtlas(GpuDevice& device, const std::string& name, const Volume& volume,
               TexelStorage storage, glm::uvec3 slots);
    void empty_slot(const Volume& volume, uint32_t slot);
    void set_entry(size_t brick, glm::vec4 entry);
    void write_table(Commands& commands);
    glm::vec4 absent_entry(const Brick& brick) const;
    glm::uvec3 origin_of(uint32_t slot) const;
    size_t index_of(glm::uvec3 brick) const;
    glm::uvec3 brick_of(size_t index) const;

    static constexpr uint32_t kNone = ~uint32_t{0};
    struct Place { // of a brick
        uint32_t slot = kNone;
        bool wanted = false;
        bool listed = false;                 // in missing_
        glm::u8vec3 low{kSlotSide}, high{0}; // texels of the slot that are out of date: [low, high)
    };
    struct Slot {
        size_t brick = 0;
        bool used = false;
        std::list<uint32_t>::iterator idle; // where it is in idle_, or where it would be
    };
    TexelStorage storage_;
    glm::uvec3 brick_count_, slot_count_;
    std::vector<Place> places_; // of bricks, x fastest
    std::vector<Slot> slots_;
    std::list<uint32_t> idle_;       // slots of bricks not wanted, and empty ones: the next first
    std::list<uint32_t> busy_;       // the others
    std::vector<size_t> missing_;    // bricks to be uploaded, if they are still wanted
    std::vector<glm::vec4> entries_; // of the table
    std::vector<size_t> dirty_;      // entries that the device does not have, some twice
    bool all_dirty_ = true;
    GpuImage image_, table_;
};

} // namespace palpate
