#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "engine/surface/block_cells.h"
#include "engine/volume/volume.h"

namespace palpate::block {

// One bit a sample of a volume: whether it is inside.
//
// A border that is to be closed gets a layer of samples beyond each side, all outside.
// Bricks whose range, and rows of blocks whose ranges lie on one side of iso are not read.
class SignField {
 public:
    // Threaded. Asked to stop, it says nothing true.
    SignField(const Volume& volume, float iso, bool closed_at_border,
              const std::stop_token& stop = {});

    // Bricks and blocks are counted as in the volume; with a closed border, from -1. `end` is the
    // one after the last.
    glm::ivec3 first_brick() const { return glm::ivec3(-lead_); }
    glm::ivec3 end_brick() const { return end_brick_; }
    glm::ivec3 first_block() const { return glm::ivec3(-lead_); }
    glm::ivec3 end_block() const { return end_block_; }

    // The last sample, counted from the block's first one: at most 9.
    Last last_of(glm::ivec3 block) const {
        return glm::min(last_sample_ - block * kSide, glm::ivec3(9));
    }

    // Blocks of a brick with inside and outside among the corners of their cells (and some others
    // at the upper borders of the volume): bit block_of().
    uint64_t crossed_blocks(glm::ivec3 brick) const;

    Signs signs_of(glm::ivec3 block) const;

    uint64_t bricks_read() const { return bricks_read_; }

 private:
    enum class Kind : uint8_t { outside, inside, mixed };
    // Eight samples a byte; z from the first block's first sample.
    const uint8_t* row(int block_x, int y, int z) const {
        const size_t at =
            static_cast<size_t>(y + kSide * lead_) + rows_ * static_cast<size_t>(z + kSide * lead_);
        return bits_.data() + at * pitch_ + static_cast<size_t>(block_x + lead_);
    }
    uint8_t* row(int block_x, int y, int z) {
        return const_cast<uint8_t*>(static_cast<const SignField&>(*this).row(block_x, y, z));
    }
    template <class T>
    Kind fill(const Volume& volume, glm::uvec3 brick, float iso);
    Kind kind_at(glm::ivec3 brick) const; // outside beyond the volume

    int lead_; // blocks before the volume: 1 if closed
    glm::ivec3 last_sample_, end_block_, end_brick_, bricks_;
    size_t pitch_, rows_;
    std::vector<uint8_t> bits_;
    std::vector<Kind> kinds_; // of the volume's bricks
    uint64_t bricks_read_ = 0;
};

} // namespace palpate::block
