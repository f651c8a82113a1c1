#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "engine/volume/volume.h"
#include "haptics/field/stored_samples.h"

namespace palpate::haptics {

// The samples about a tool, as a field stores them, in tiles of 8x8x8: those blocks of a brick that
// have a range and a stamp of their own. A tile outlives a snapshot; it is read again only where
// its stamp is another. Any box of tiles that fits() is held at once; a tile's place in the table
// is its position modulo the table's side, so that neighbouring samples are found without looking
// for their tile. Nothing is allocated after construction. About a microsecond for a tile that is
// read, a tenth for one that is known.
class SampleTiles {
 public:
    static constexpr int kSide = 8;  // samples of a tile on each axis
    static constexpr int kTable = 8; // tiles of the table on each axis
    static constexpr int kMost = 6;  // of a box that is held

    // At the start of a tick. What is missing or without data becomes `missing`. `settings` rises
    // with all that numbers depend on beside the samples, `generation` with every snapshot.
    void follow(const Volume& volume, const StoredSamples& stored, float threshold, float missing,
                uint64_t settings, uint64_t generation);

    static bool fits(glm::ivec3 low, glm::ivec3 high) {
        return glm::all(glm::lessThan((high >> 3) - (low >> 3), glm::ivec3(kMost)));
    }
    // The samples to read: none, for near() in whole tiles; those of a box where any may be at
    // least the threshold; all.
    enum class Read : uint8_t { none, where_solid, all };
    // Holds the samples low .. high, both included: from now on all below tells of these.
    void hold(glm::ivec3 low, glm::ivec3 high, Read what);
    // Whether any may be at least the threshold, and whether something was not in memory.
    bool any_solid() const { return any_solid_; }
    bool lacks() const { return lacks_; }
    // Another number wherever something else is held, or its samples changed.
    uint64_t held() const { return held_; }

    // The cells of a held tile that may be solid, they or their neighbours, a bit for each, x
    // fastest: those for which a sample within one of their corners is at least the threshold, and
    // is held. With Read::none: all, where any of the tile's or its neighbours' samples may be.
    const std::array<uint64_t, kSide>& near(glm::ivec3 tile);

    // The place of a sample in numbers(): the sum of what its coordinates give.
    static uint32_t at_x(int x) { return tile_x(x >> 3) + static_cast<uint32_t>(x & 7); }
    static uint32_t at_y(int y) { return kTable * tile_x(y >> 3) + 8u * (y & 7); }
    static uint32_t at_z(int z) { return kTable * kTable * tile_x(z >> 3) + 64u * (z & 7); }
    const float* numbers() const { return numbers_.data(); }

 private:
    struct Tile {
        glm::ivec3 position{};
        uint64_t settings = 0, generation = 0, stamp = 0;
        float highest = 0.0f;
        bool lacks = false, is_read = false;
        uint64_t near_held = 0;
        // A bit for each sample that is at least the threshold, and near() of its cell.
        std::array<uint64_t, kSide> solid{}, near{};
    };
    static constexpr uint32_t kSamples = kSide * kSide * kSide;
    static uint32_t tile_x(int tile) { return kSamples * static_cast<uint32_t>(tile & 7); }
    Tile& tile(glm::ivec3 at) {
        return tiles_[(tile_x(at.x) + kTable * (tile_x(at.y) + kTable * tile_x(at.z))) / kSamples];
    }
    static constexpr uint64_t kOutside = 1; // for a stamp
    bool renew(Tile& tile, glm::ivec3 at);
    void read(Tile& tile);
    void find_near(Tile& tile);

    const Volume* volume_ = nullptr;
    StoredSamples stored_;
    float threshold_ = 0.0f, missing_ = 0.0f;
    uint64_t settings_ = 0, outer_settings_ = 0, generation_ = 0;
    uint64_t held_ = 0, held_generation_ = 0;
    Read what_ = Read::none;
    bool any_solid_ = false, lacks_ = false;
    glm::ivec3 low_{0}, high_{-1}; // tiles that are held
    std::array<Tile, kTable * kTable * kTable> tiles_{};
    std::array<float, kTable * kTable * kTable * kSamples> numbers_{};
};

} // namespace palpate::haptics
