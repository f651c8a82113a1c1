#pragma once

#include <cstdint>

namespace palpate {

// What the calling thread has allocated by operator new so far.
struct Allocations {
    uint64_t count, bytes;
};
Allocations allocations_so_far();

} // namespace palpate
