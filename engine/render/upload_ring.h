#pragma once

#include <deque>
#include <span>

#include "engine/gpu/resource.h"

namespace palpate {

// Mapped memory that small uploads are written to and the GPU copies from, used round and round.
//
//     const UploadRing::Room room = ring.take(bytes);
//     fill(room.bytes); commands.copy(ring.buffer(), image, regions at room.offset);
//     ring.sent(commands.submit());
//
// Rooms are given again once the GPU's timeline has passed the submission that reads them, so a
// frame's uploads need no submission, wait or allocation of their own.
class UploadRing {
 public:
    UploadRing(GpuDevice& device, uint64_t bytes);

    struct Room {
        std::span<std::byte> bytes;
        uint64_t offset; // in buffer()
    };
    // bytes <= capacity / 2. Waits for the GPU where what it has yet to read is in the way; what
    // has been taken and not sent, with this and the largest of them once more, must fit the ring.
    Room take(uint64_t bytes);
    // All that was taken so far is read by submissions up to this value of the timeline.
    void sent(uint64_t value);

    Buffer& buffer() { return buffer_; }
    uint64_t capacity() const { return buffer_.bytes(); }

 private:
    struct Piece {
        uint64_t first, last; // bytes [first, last)
        uint64_t value;       // 0: not sent
    };
    GpuDevice* device_;
    Buffer buffer_;
    std::deque<Piece> pieces_; // oldest first
    uint64_t next_ = 0;
};

} // namespace palpate
