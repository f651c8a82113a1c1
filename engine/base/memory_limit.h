#pragma once

#include <cstdint>
#include <string>

#include "engine/base/error.h"

namespace palpate {

// Refuses work whose size a person has asked for, before its first allocation, where it needs more
// than `limit_bytes` (--max-memory; 0: three quarters of physical_memory_bytes()):
//     "WHAT: needs 3.47 TiB of memory, and the limit is 17.6 GiB (75 % of this machine's memory)"
// `bytes` is a double, so that no product of sizes overflows; NaN is refused.
Result<void> expect_memory(const std::string& what, double bytes, uint64_t limit_bytes = 0);

} // namespace palpate
