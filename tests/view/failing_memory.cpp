#include "tests/view/failing_memory.h"

#include <execinfo.h>
#include <link.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>

extern "C" const char __executable_start, etext; // of the linker

namespace {

std::atomic<bool> counts{false};
std::atomic<uint64_t> calls{0}, number_that_fails{0};
std::atomic<bool> has_failed{false};

struct Range {
    uintptr_t low = 0, high = 0;
    bool has(const void* address) const {
        const auto at = reinterpret_cast<uintptr_t>(address);
        return at >= low && at < high;
    }
};

const Range program{reinterpret_cast<uintptr_t>(&__executable_start),
                    reinterpret_cast<uintptr_t>(&etext)};

Range standard_library() { // containers that it has compiled allocate for whoever calls them
    static const Range found = [] {
        Range range;
        dl_iterate_phdr(
            [](dl_phdr_info* info, size_t, void* to) {
                if (!std::strstr(info->dlpi_name, "libstdc++"))
                    return 0;
                Range& all = *static_cast<Range*>(to);
                all.low = info->dlpi_addr;
                for (int i = 0; i < info->dlpi_phnum; ++i)
                    all.high = std::max(all.high, info->dlpi_addr + info->dlpi_phdr[i].p_vaddr +
                                                      info->dlpi_phdr[i].p_memsz);
                return 1;
            },
            &range);
        return range;
    }();
    return found;
}

bool is_of_program(const void* caller) {
    if (!standard_library().has(caller))
        return program.has(caller);
    void* frames[24];
    const int depth = backtrace(frames, 24);
    const auto* const end = frames + depth;
    const auto* const from = std::find(frames, frames + depth, const_cast<void*>(caller));
    const auto* const other =
        std::find_if(from, end, [](const void* frame) { return !standard_library().has(frame); });
    return other != end && program.has(*other);
}

// Whether this call is the one that fails.
bool fails(size_t bytes, const void* caller) {
    if (bytes < palpate::failing_memory::kLarge || !counts.load() || !is_of_program(caller))
        return false;
    if (calls.fetch_add(1) + 1 != number_that_fails.load())
        return false;
    has_failed.store(true);
    return true;
}

void* allocate(size_t bytes, size_t alignment, const void* caller) {
    void* memory = nullptr;
    if (!fails(bytes, caller))
        memory =
            alignment > alignof(std::max_align_t)
                ? std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment)
                : std::malloc(bytes ? bytes : 1);
    if (!memory)
        throw std::bad_alloc();
    return memory;
}

} // namespace

void* operator new(size_t bytes) {
    return allocate(bytes, 1, __builtin_return_address(0));
}
void* operator new(size_t bytes, std::align_val_t alignment) {
    return allocate(bytes, static_cast<size_t>(alignment), __builtin_return_address(0));
}
void operator delete(void* memory) noexcept {
    std::free(memory);
}
void operator delete(void* memory, size_t) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
    std::free(memory);
}
void operator delete(void* memory, size_t, std::align_val_t) noexcept {
    std::free(memory);
}

namespace palpate::failing_memory {

void begin(uint64_t fails_at) {
    counts = false;
    calls = 0;
    number_that_fails = fails_at;
    has_failed = false;
}

void pause(bool paused) {
    counts = !paused;
}

Counted so_far() {
    return {calls, has_failed};
}

Counted end() {
    counts = false;
    return so_far();
}

} // namespace palpate::failing_memory
