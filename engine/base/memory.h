#pragma once

#include <cstdint>

namespace palpate {

// Bytes of memory available to this process: the machine's RAM, or less where a control group
// limits it.
uint64_t physical_memory_bytes();

// For a program that runs all day: what is freed goes back to the system and does not stay in the
// C library's heaps. Blocks from kReturnedBlockBytes up are returned at once, and threads share as
// many heaps as there are processors. (By default glibc raises the first limit to 32 MiB when such
// a block is freed, and gives threads eight heaps a processor, each of which keeps the most that it
// has ever held.) For the whole process, once, before it has threads.
constexpr int kReturnedBlockBytes = 1 << 20;
void return_freed_memory();

// Returns what is free now, between blocks that are not. Takes milliseconds, in which other threads
// wait that allocate: for when a document has been closed.
void return_free_memory_now();

} // namespace palpate
