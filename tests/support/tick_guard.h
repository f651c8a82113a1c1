#pragma once

#include <cstdint>

namespace palpate {

// Counts what a tick must not do, in programs that link tick_guard.cpp: it stands in front of
// malloc and its kin and of pthread_mutex_lock. Calls between begin() and end() on the calling
// thread are counted; nothing else changes.
struct TickGuard {
    struct Counts {
        uint64_t allocations = 0, frees = 0, locks = 0, page_faults = 0;
    };
    static void begin();
    static Counts end();
    // False under a sanitizer, which has its own malloc.
    static bool works();
};

} // namespace palpate
