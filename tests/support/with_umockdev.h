#pragma once

#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <stdexcept>

// Tests on a kernel whose devices umockdev imitates.
namespace palpate::haptics {

// umockdev stands between a program and the C library, which takes a preloaded library: starts the
// test again with it. Call it first in main().
inline void run_with_umockdev(char** argv) {
    const char* preloaded = std::getenv("LD_PRELOAD");
    if (preloaded && std::strstr(preloaded, "umockdev"))
        return;
    ::setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
    ::execv("/proc/self/exe", argv);
    std::abort();
}

// This process may, while it lives, open what everybody may, and nothing else.
class AsNobody {
 public:
    AsNobody() {
        if (is_root_ && ::setresuid(kNobody, kNobody, 0) != 0)
            throw std::runtime_error("the rights of root cannot be put down");
    }
    ~AsNobody() {
        if (is_root_ && ::setresuid(0, 0, 0) != 0)
            std::abort();
    }

 private:
    static constexpr uid_t kNobody = 65534;
    bool is_root_ = ::getuid() == 0;
};

} // namespace palpate::haptics
