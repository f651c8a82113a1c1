#pragma once

#include <cstddef>
#include <cstdint>

namespace palpate::failing_memory {

// Calls of operator new by this program's own code, and not by a driver's, that ask for so much.
// Half of 64 KiB takes in bricks of labels, too.
constexpr size_t kLarge = size_t{32} << 10;

// Counts such calls of all threads from now on; the call of this number fails (0: none does).
void begin(uint64_t fails_at);
void pause(bool paused); // begin() leaves it paused
struct Counted {
    uint64_t calls = 0;
    bool failed = false; // one did
};
Counted end();
Counted so_far();

} // namespace palpate::failing_memory
