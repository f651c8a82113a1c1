#include "engine/base/memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace palpate {

uint64_t physical_memory_bytes() {
    uint64_t bytes = static_cast<uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
                     static_cast<uint64_t>(::sysconf(_SC_PAGESIZE));
    uint64_t limit = 0;
    if (std::ifstream file("/sys/fs/cgroup/memory.max"); file >> limit && limit > 0)
        bytes = std::min(bytes, limit);
    return bytes;
}

} // namespace palpate
