#pragma once

#include <fmt/format.h>

#include <string>

namespace palpate {

// Prints the failed condition and its source line, then aborts.
[[noreturn]] void assertion_failed(const char* condition, const std::string& values,
                                   const char* file, int line);

} // namespace palpate

// For faults of this code. Stays on in every build type; not for inner loops.
#define PALPATE_ASSERT(condition)                                            \
    do {                                                                     \
        if (!(condition)) [[unlikely]]                                       \
            ::palpate::assertion_failed(#condition, "", __FILE__, __LINE__); \
    } while (false)

// PALPATE_ASSERT_CMP(a, <, b) prints both values.
#define PALPATE_ASSERT_CMP(a, op, b)                                                               \
    do {                                                                                           \
        if (const auto& pa_ = (a); true)                                                           \
            if (const auto& pb_ = (b); !(pa_ op pb_)) [[unlikely]]                                 \
                ::palpate::assertion_failed(#a " " #op " " #b, fmt::format("{} and {}", pa_, pb_), \
                                            __FILE__, __LINE__);                                   \
    } while (false)
