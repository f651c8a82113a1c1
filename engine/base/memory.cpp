#include "engine/base/memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <thread>

namespace palpate {

uint64_t physical_memory_bytes() {
    uint64_t bytes = static_cast<uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
                     static_cast<uint64_t>(::sysconf(_SC_PAGESIZE));
    uint64_t limit = 0;
    if (std::ifstream file("/sys/fs/cgroup/memory.max"); file >> limit && limit > 0)
        bytes = std::min(bytes, limit);
    return bytes;
}

void return_freed_memory() {
    ::mallopt(M_ARENA_MAX, static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
    ::mallopt(M_MMAP_THRESHOLD, kReturnedBlockBytes);
    ::mallopt(M_TRIM_THRESHOLD, 2 * kReturnedBlockBytes); // glibc's own ratio
}

void return_free_memory_now() {
    ::malloc_trim(0);
}

} // namespace palpate
