#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "engine/volume/volume.h"

namespace palpate::haptics {

// Keeps the samples round the tool in memory: locked against paging, and alive.
//
// Not for the servo's thread: the publisher of scenes, or a thread of its own, calls update() as
// the tool moves. Bricks with samples in a file are left out; the servo treats them as missing. The
// nearest bricks are locked first, up to the limit on locked memory (RLIMIT_MEMLOCK).
class BrickLock {
 public:
    BrickLock() = default;
    ~BrickLock();
    BrickLock(const BrickLock&) = delete;
    BrickLock& operator=(const BrickLock&) = delete;

    // Locks the bricks with a sample within radius_mm of tool_mm, and lets go of all others.
    void update(const Volume& volume, glm::dvec3 tool_mm, double radius_mm);

    size_t locked_bytes() const { return locked_bytes_; }
    size_t refused() const { return refused_; } // bricks, in the last update
    size_t bricks() const { return held_.size(); }

 private:
    struct Held {
        BrickPtr brick;
        bool locked;
    };
    static bool lock(const Brick& brick);
    static void unlock(const Brick& brick);
    std::map<const Brick*, Held> held_;
    size_t locked_bytes_ = 0, refused_ = 0;
};

} // namespace palpate::haptics
