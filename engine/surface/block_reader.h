#pragma once

#include <array>
#include <glm/glm.hpp>

#include "engine/surface/block_cells.h"
#include "engine/volume/volume.h"

namespace palpate::block {

// Bit y + 1 of [z + 1]: row (y, z) of a block's samples, as in Cells.
using Rows = std::array<uint16_t, 11>;
constexpr Rows kAllRows{0x7ff, 0x7ff, 0x7ff, 0x7ff, 0x7ff, 0x7ff,
                        0x7ff, 0x7ff, 0x7ff, 0x7ff, 0x7ff};

// Reads blocks with their neighbouring samples out of the bricks of a volume, as floats.
//
// Beyond the volume, samples repeat the nearest one inside, or are missing (NaN) where the border
// is to be closed. For one thread. Neighbouring bricks are looked up once for all blocks of a
// brick, and only when a block reads them; nothing is allocated unless bricks lie in a source.
class BlockReader {
 public:
    // Keeps a reference: the volume outlives the reader.
    BlockReader(const Volume& volume, bool closed_at_border);

    // Block (0, 0, 0) begins with sample (0, 0, 0); a block may lie beyond the volume. Rows that
    // are not asked for may keep what they hold.
    void read(glm::ivec3 block, Samples& samples, const Rows& rows = kAllRows);

 private:
    struct Slot {
        Brick::Pinned pinned;
        int stride = 0;
        bool has_gaps = false;
        bool is_pinned = false;
    };
    struct Axis {                       // of samples -1 .. 9
        std::array<int, 11> slot;       // 0 .. 2: brick before, own, after; rising
        std::array<int, 11> local;      // in that brick
        std::array<bool, 11> is_beyond; // the volume
        bool any_beyond;
    };
    Axis axis_of(int axis, int first) const;
    void pin(int number);
    template <class T>
    void read_as(const std::array<Axis, 3>& axes, Samples& samples, const Rows& wanted);

    const Volume& volume_;
    bool closed_;
    glm::ivec3 size_;
    glm::ivec3 brick_{-100};
    std::array<Slot, 27> slots_;
};

} // namespace palpate::block
