#include "tests/support/tick_guard.h"

#include <dlfcn.h>
#include <pthread.h>
#include <sys/resource.h>

#include <cstdlib>

namespace palpate {

namespace {

thread_local bool watching = false;
thread_local TickGuard::Counts counts;

uint64_t page_faults() {
    rusage use{};
    getrusage(RUSAGE_THREAD, &use);
    return static_cast<uint64_t>(use.ru_minflt + use.ru_majflt);
}

} // namespace

void TickGuard::begin() {
    counts = {};
    counts.page_faults = page_faults();
    watching = true;
}

TickGuard::Counts TickGuard::end() {
    watching = false;
    counts.page_faults = page_faults() - counts.page_faults;
    return counts;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
bool TickGuard::works() {
    return false;
}
} // namespace palpate
#else
bool TickGuard::works() {
    return true;
}

namespace {
void saw(uint64_t TickGuard::Counts::*what) {
    if (watching)
        ++(counts.*what);
}
} // namespace

} // namespace palpate

// glibc's own entries, under names that nobody replaces.
extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void __libc_free(void* memory);

void* malloc(size_t size) {
    palpate::saw(&palpate::TickGuard::Counts::allocations);
    return __libc_malloc(size);
}
void* calloc(size_t count, size_t size) {
    palpate::saw(&palpate::TickGuard::Counts::allocations);
    return __libc_calloc(count, size);
}
void* realloc(void* memory, size_t size) {
    palpate::saw(&palpate::TickGuard::Counts::allocations);
    return __libc_realloc(memory, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
    palpate::saw(&palpate::TickGuard::Counts::allocations);
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, size_t alignment, size_t size) {
    palpate::saw(&palpate::TickGuard::Counts::allocations);
    *memory = __libc_memalign(alignment, size);
    return *memory ? 0 : 12; // ENOMEM
}
void free(void* memory) {
    if (memory)
        palpate::saw(&palpate::TickGuard::Counts::frees);
    __libc_free(memory);
}

int pthread_mutex_lock(pthread_mutex_t* mutex) {
    using Lock = int (*)(pthread_mutex_t*);
    static const Lock lock = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
    palpate::saw(&palpate::TickGuard::Counts::locks);
    return lock(mutex);
}
}
#endif
