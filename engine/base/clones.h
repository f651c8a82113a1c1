#pragma once

// PALPATE_CLONES before a function: compiled twice, for every x86-64 and for processors with AVX2,
// popcount and bit manipulation (Haswell, Zen and later); the loader picks. Both give the same
// bits: multiplications and additions are not contracted, and sums keep their order. A level of the
// architecture is asked for by its features; the name of a processor would be met by that one
// alone.
//
// Not under sanitizers, whose run time is not ready when the loader asks.
#if defined(__x86_64__) && defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#if defined(__clang__) // 14 compiles levels, but never picks them
#if !__has_feature(address_sanitizer) && !__has_feature(thread_sanitizer)
#define PALPATE_CLONES [[gnu::target_clones("avx2", "default")]]
#endif
#else
#define PALPATE_CLONES [[gnu::target_clones("arch=x86-64-v3", "default")]]
#endif
#endif
#ifndef PALPATE_CLONES
#define PALPATE_CLONES
#endif
