#pragma once

#include <cstdint>

namespace palpate {

// Allocations by operator new of the calling thread so far.
struct Allocations {
    uint64_t count, bytes;
};
Allocations allocations_so_far();

} // namespace palpate
