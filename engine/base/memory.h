#pragma once

#include <cstdint>

namespace palpate {

// Bytes of memory available to this process: the machine's RAM, or less where a control group
// limits it.
uint64_t physical_memory_bytes();

} // namespace palpate
