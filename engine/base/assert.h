#pragma once

#include <fmt/format.h>

#include <string>

namespace palpate {

// Prints the broken condition and its place, then aborts.
[[noreturn]] void assertion_failed(const char* condition, const std::string& values,
                                   const char* file, int line);

} // namespace palpate

// Our own mistakes. Stays on in every build type: it is never put inside an inner loop.
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
