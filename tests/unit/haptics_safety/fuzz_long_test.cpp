#include <cstdlib>
#include <string>

#include "tests/unit/haptics_safety/fuzz.h"

// PALPATE_TICKS (10^8) sets how many ticks, PALPATE_SEED (1) with which numbers.
namespace palpate::haptics {
namespace {

uint64_t setting(const char* name, uint64_t otherwise) {
    const char* value = std::getenv(name);
    return value ? std::stoull(value) : otherwise;
}

TEST(SafetyFuzz, NoUnsafeForceInAHundredMillionTicks) {
    fuzz_chain(setting("PALPATE_SEED", 1), setting("PALPATE_TICKS", 100'000'000));
}

} // namespace
} // namespace palpate::haptics
