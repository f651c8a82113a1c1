#pragma once

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string>

namespace palpate {

constexpr uint64_t kMiB = uint64_t{1} << 20;

// Memory of this process, in bytes, since it was made. Blocks of 32 KiB and more go back to the
// system as they are freed, so that the peak is what was held at once.
class ProcessMemory {
 public:
    ProcessMemory() {
        mallopt(M_MMAP_THRESHOLD, 32 << 10);
        malloc_trim(0);
        before_ = read("VmRSS");
        std::ofstream("/proc/self/clear_refs") << 5; // the peak is counted from here
    }
    uint64_t peak_more() const { return std::max(read("VmHWM"), before_) - before_; }

 private:
    static uint64_t read(const std::string& key) {
        std::ifstream status("/proc/self/status");
        for (std::string line; std::getline(status, line);)
            if (line.starts_with(key + ":"))
                return std::stoull(line.substr(key.size() + 1)) * 1024;
        ADD_FAILURE() << key;
        return 0;
    }
    uint64_t before_ = 0;
};

} // namespace palpate
