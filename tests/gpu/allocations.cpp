#include "tests/gpu/allocations.h"

#include <cstdlib>
#include <new>

namespace {
thread_local palpate::Allocations so_far{};
} // namespace

void* operator new(size_t bytes) {
    ++so_far.count;
    so_far.bytes += bytes;
    if (void* memory = std::malloc(bytes ? bytes : 1))
        return memory;
    throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
    std::free(memory);
}
void operator delete(void* memory, size_t) noexcept {
    std::free(memory);
}

namespace palpate {

Allocations allocations_so_far() {
    return so_far;
}

} // namespace palpate
