#pragma once

// Numbers of many invocations at once, for the translated shaders alone: each of their sources is
// compiled once for each instruction set, in a namespace of its own, so nothing here may be shared
// between objects. PALPATE_LANES says how many invocations a kernel runs side by side; vectors of
// the processor hold kNative of them.
//
// Results are those of IEEE arithmetic, operation by operation, at every width.

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "engine/native/kernel.h"

#if defined(__AVX512F__)
#define PALPATE_LEVEL kAvx512
#elif defined(__AVX2__)
#define PALPATE_LEVEL kAvx2
#else
#define PALPATE_LEVEL kSse2
#endif
#define LANES_INLINE [[gnu::always_inline]] inline
#define EACH_PART _Pragma("GCC unroll 16") for (int i = 0; i < kParts; ++i)

namespace palpate::native {
namespace {

#if defined(__AVX512F__)
constexpr int kNative = 16;
#elif defined(__AVX2__)
constexpr int kNative = 8;
#else
constexpr int kNative = 4;
#endif
constexpr int kLanes = PALPATE_LANES > kNative ? PALPATE_LANES : (kNative > 8 ? kNative : 8);
constexpr int kParts = kLanes / kNative;
constexpr int kSubgroup = 8;

using FloatPart [[gnu::vector_size(4 * kNative)]] = float;
using IntPart [[gnu::vector_size(4 * kNative)]] = int32_t;
using UintPart [[gnu::vector_size(4 * kNative)]] = uint32_t;
using DoublePart [[gnu::vector_size(8 * kNative)]] = double;
#if defined(__AVX512F__)
using MaskPart = __mmask16;
#else
using MaskPart = IntPart; // -1 or 0
#endif

// Lanes of floats, of integers of either sign, and of truth values.
struct F {
    FloatPart p[kParts];
    F() = default;
    LANES_INLINE explicit F(float x) { EACH_PART p[i] = FloatPart{} + x; }
};
struct U {
    UintPart p[kParts];
    U() = default;
    LANES_INLINE explicit U(uint32_t x) { EACH_PART p[i] = UintPart{} + x; }
};
struct B {
    MaskPart p[kParts];
    B() = default;
#if defined(__AVX512F__)
    LANES_INLINE explicit B(bool x) {
        EACH_PART p[i] = x ? 0xffff : 0;
    }
#else
    LANES_INLINE explicit B(bool x) {
        EACH_PART p[i] = IntPart{} - int32_t{x};
    }
#endif
};

// Every operation exists for numbers that are one for all lanes, too.
#define LANES_OPERATOR(T, op)                \
    LANES_INLINE T operator op(T a, T b) {   \
        EACH_PART a.p[i] = a.p[i] op b.p[i]; \
        return a;                            \
    }
LANES_OPERATOR(F, +)
LANES_OPERATOR(F, -)
LANES_OPERATOR(F, *)
LANES_OPERATOR(F, /)
LANES_OPERATOR(U, +)
LANES_OPERATOR(U, -)
LANES_OPERATOR(U, *)
LANES_OPERATOR(U, &)
LANES_OPERATOR(U, |)
LANES_OPERATOR(U, ^)
#undef LANES_OPERATOR
LANES_INLINE F operator-(F a) {
    EACH_PART a.p[i] = -a.p[i];
    return a;
}
LANES_INLINE U operator~(U a) {
    EACH_PART a.p[i] = ~a.p[i];
    return a;
}

LANES_INLINE B land(B a, B b) {
    EACH_PART a.p[i] = static_cast<MaskPart>(a.p[i] & b.p[i]);
    return a;
}
LANES_INLINE B lor(B a, B b) {
    EACH_PART a.p[i] = static_cast<MaskPart>(a.p[i] | b.p[i]);
    return a;
}
LANES_INLINE B lxor(B a, B b) {
    EACH_PART a.p[i] = static_cast<MaskPart>(a.p[i] ^ b.p[i]);
    return a;
}
LANES_INLINE B lnot(B a) {
    EACH_PART a.p[i] = static_cast<MaskPart>(~a.p[i]);
    return a;
}
LANES_INLINE bool land(bool a, bool b) {
    return a && b;
}
LANES_INLINE bool lor(bool a, bool b) {
    return a || b;
}
LANES_INLINE bool lxor(bool a, bool b) {
    return a != b;
}
LANES_INLINE bool lnot(bool a) {
    return !a;
}

#if defined(__AVX512F__)
#define LANES_COMPARE(name, T, op, cast, code, intrinsic)                 \
    LANES_INLINE B name(T a, T b) {                                       \
        B out;                                                            \
        EACH_PART out.p[i] = intrinsic((cast)a.p[i], (cast)b.p[i], code); \
        return out;                                                       \
    }
#define LANES_FLOAT(name, op, code)                              \
    LANES_COMPARE(name, F, op, __m512, code, _mm512_cmp_ps_mask) \
    LANES_INLINE bool name(float a, float b) {                   \
        return a op b;                                           \
    }
#define LANES_UNSIGNED(name, op, code)                               \
    LANES_COMPARE(name, U, op, __m512i, code, _mm512_cmp_epu32_mask) \
    LANES_INLINE bool name(uint32_t a, uint32_t b) {                 \
        return a op b;                                               \
    }
#define LANES_SIGNED(name, op, code)                                 \
    LANES_COMPARE(name, U, op, __m512i, code, _mm512_cmp_epi32_mask) \
    LANES_INLINE bool name(uint32_t a, uint32_t b) {                 \
        return static_cast<int32_t>(a) op static_cast<int32_t>(b);   \
    }
#else
#define LANES_COMPARE(name, T, op, cast)                              \
    LANES_INLINE B name(T a, T b) {                                   \
        B out;                                                        \
        EACH_PART out.p[i] = (IntPart)((cast)a.p[i] op(cast) b.p[i]); \
        return out;                                                   \
    }
#define LANES_FLOAT(name, op, code)            \
    LANES_COMPARE(name, F, op, FloatPart)      \
    LANES_INLINE bool name(float a, float b) { \
        return a op b;                         \
    }
#define LANES_UNSIGNED(name, op, code)               \
    LANES_COMPARE(name, U, op, UintPart)             \
    LANES_INLINE bool name(uint32_t a, uint32_t b) { \
        return a op b;                               \
    }
#define LANES_SIGNED(name, op, code)                               \
    LANES_COMPARE(name, U, op, IntPart)                            \
    LANES_INLINE bool name(uint32_t a, uint32_t b) {               \
        return static_cast<int32_t>(a) op static_cast<int32_t>(b); \
    }
#endif
LANES_FLOAT(feq, ==, _CMP_EQ_OQ)
LANES_FLOAT(fne, !=, _CMP_NEQ_UQ) // true of NaN
LANES_FLOAT(flt, <, _CMP_LT_OQ)
LANES_FLOAT(fle, <=, _CMP_LE_OQ)
LANES_UNSIGNED(ieq, ==, _MM_CMPINT_EQ)
LANES_UNSIGNED(ine, !=, _MM_CMPINT_NE)
LANES_UNSIGNED(ult, <, _MM_CMPINT_LT)
LANES_UNSIGNED(ule, <=, _MM_CMPINT_LE)
LANES_SIGNED(slt, <, _MM_CMPINT_LT)
LANES_SIGNED(sle, <=, _MM_CMPINT_LE)

#if defined(__AVX512F__)
LANES_INLINE F select(B c, F a, F b) {
    EACH_PART a.p[i] = (FloatPart)_mm512_mask_blend_ps(c.p[i], (__m512)b.p[i], (__m512)a.p[i]);
    return a;
}
LANES_INLINE U select(B c, U a, U b) {
    EACH_PART a.p[i] = (UintPart)_mm512_mask_blend_epi32(c.p[i], (__m512i)b.p[i], (__m512i)a.p[i]);
    return a;
}
// Bit n: lane n of a part.
LANES_INLINE uint32_t bits(MaskPart part) {
    return part;
}
#else
LANES_INLINE F select(B c, F a, F b) {
    EACH_PART a.p[i] = c.p[i] ? a.p[i] : b.p[i];
    return a;
}
LANES_INLINE U select(B c, U a, U b) {
    EACH_PART a.p[i] = c.p[i] ? a.p[i] : b.p[i];
    return a;
}
#if defined(__AVX2__)
LANES_INLINE uint32_t bits(MaskPart part) {
    return static_cast<uint32_t>(_mm256_movemask_ps((__m256)part));
}
#else
LANES_INLINE uint32_t bits(MaskPart part) {
    return static_cast<uint32_t>(_mm_movemask_ps((__m128)part));
}
#endif
#endif
LANES_INLINE B select(B c, B a, B b) {
    return lor(land(c, a), land(lnot(c), b));
}
template <class T>
LANES_INLINE T select(bool c, T a, T b) {
    return c ? a : b;
}

LANES_INLINE bool any(B a) {
    MaskPart all = a.p[0];
    for (int i = 1; i < kParts; ++i)
        all = static_cast<MaskPart>(all | a.p[i]);
    return bits(all) != 0;
}
LANES_INLINE bool lane_of(B a, int lane) {
    return bits(a.p[lane / kNative]) >> lane % kNative & 1;
}
LANES_INLINE uint32_t lane_of(U a, int lane) {
    return a.p[lane / kNative][lane % kNative];
}
LANES_INLINE float lane_of(F a, int lane) {
    return a.p[lane / kNative][lane % kNative];
}
LANES_INLINE void set_lane(U& a, int lane, uint32_t x) {
    a.p[lane / kNative][lane % kNative] = x;
}
LANES_INLINE void set_lane(F& a, int lane, float x) {
    a.p[lane / kNative][lane % kNative] = x;
}
// The lanes of a mask, a lane a call, in rising order.
template <class Do>
LANES_INLINE void each_lane(B mask, Do&& run) {
    for (int i = 0; i < kParts; ++i)
        for (uint32_t left = bits(mask.p[i]); left != 0; left &= left - 1)
            run(i * kNative + __builtin_ctz(left));
}
LANES_INLINE int first_lane(B mask) {
    for (int i = 0; i < kParts; ++i)
        if (const uint32_t left = bits(mask.p[i]))
            return i * kNative + __builtin_ctz(left);
    return 0;
}
LANES_INLINE U lane_numbers() {
    U out;
    EACH_PART for (int k = 0; k < kNative; ++k) out.p[i][k] =
        static_cast<uint32_t>(i * kNative + k);
    return out;
}

LANES_INLINE U as_uint(F a) {
    U out;
    EACH_PART out.p[i] = (UintPart)a.p[i];
    return out;
}
LANES_INLINE F as_float(U a) {
    F out;
    EACH_PART out.p[i] = (FloatPart)a.p[i];
    return out;
}
LANES_INLINE constexpr uint32_t as_uint(float a) {
    return __builtin_bit_cast(uint32_t, a);
}
LANES_INLINE constexpr float as_float(uint32_t a) {
    return __builtin_bit_cast(float, a);
}
LANES_INLINE U as_uint(B a) {
    return select(a, U(1u), U(0u));
}
LANES_INLINE constexpr uint32_t as_uint(bool a) {
    return a;
}

// Shifts take the lowest five bits of the count.
LANES_INLINE U shl(U a, U b) {
    EACH_PART a.p[i] = a.p[i] << (b.p[i] & 31u);
    return a;
}
LANES_INLINE U shr(U a, U b) {
    EACH_PART a.p[i] = a.p[i] >> (b.p[i] & 31u);
    return a;
}
LANES_INLINE U sar(U a, U b) {
    EACH_PART a.p[i] = (UintPart)((IntPart)a.p[i] >> (IntPart)(b.p[i] & 31u));
    return a;
}
LANES_INLINE uint32_t shl(uint32_t a, uint32_t b) {
    return a << (b & 31);
}
LANES_INLINE uint32_t shr(uint32_t a, uint32_t b) {
    return a >> (b & 31);
}
LANES_INLINE uint32_t sar(uint32_t a, uint32_t b) {
    return static_cast<uint32_t>(static_cast<int32_t>(a) >> (b & 31));
}

template <class T>
LANES_INLINE T umin(T a, T b) {
    return select(ult(b, a), b, a);
}
template <class T>
LANES_INLINE T umax(T a, T b) {
    return select(ult(a, b), b, a);
}
template <class T>
LANES_INLINE T smin(T a, T b) {
    return select(slt(b, a), b, a);
}
template <class T>
LANES_INLINE T smax(T a, T b) {
    return select(slt(a, b), b, a);
}
// The second of a NaN and a number.
template <class T>
LANES_INLINE T fmin(T a, T b) {
    return select(flt(a, b), a, b);
}
template <class T>
LANES_INLINE T fmax(T a, T b) {
    return select(flt(b, a), a, b);
}

#if defined(__AVX512F__)
LANES_INLINE FloatPart part_fmin(FloatPart a, FloatPart b) {
    return (FloatPart)_mm512_min_ps((__m512)a, (__m512)b);
}
LANES_INLINE FloatPart part_fmax(FloatPart a, FloatPart b) {
    return (FloatPart)_mm512_max_ps((__m512)a, (__m512)b);
}
LANES_INLINE FloatPart part_sqrt(FloatPart a) {
    return (FloatPart)_mm512_sqrt_ps((__m512)a);
}
LANES_INLINE FloatPart part_floor(FloatPart a) {
    return (FloatPart)_mm512_roundscale_ps((__m512)a, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
}
LANES_INLINE FloatPart part_ceil(FloatPart a) {
    return (FloatPart)_mm512_roundscale_ps((__m512)a, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC);
}
LANES_INLINE FloatPart part_fma(FloatPart a, FloatPart b, FloatPart c) {
    return (FloatPart)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
}
LANES_INLINE IntPart part_truncate(FloatPart a) {
    return (IntPart)_mm512_cvttps_epi32((__m512)a);
}
#elif defined(__AVX2__)
LANES_INLINE FloatPart part_fmin(FloatPart a, FloatPart b) {
    return (FloatPart)_mm256_min_ps((__m256)a, (__m256)b);
}
LANES_INLINE FloatPart part_fmax(FloatPart a, FloatPart b) {
    return (FloatPart)_mm256_max_ps((__m256)a, (__m256)b);
}
LANES_INLINE FloatPart part_sqrt(FloatPart a) {
    return (FloatPart)_mm256_sqrt_ps((__m256)a);
}
LANES_INLINE FloatPart part_floor(FloatPart a) {
    return (FloatPart)_mm256_floor_ps((__m256)a);
}
LANES_INLINE FloatPart part_ceil(FloatPart a) {
    return (FloatPart)_mm256_ceil_ps((__m256)a);
}
LANES_INLINE FloatPart part_fma(FloatPart a, FloatPart b, FloatPart c) {
    return (FloatPart)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
}
LANES_INLINE IntPart part_truncate(FloatPart a) {
    return (IntPart)_mm256_cvttps_epi32((__m256)a);
}
#else
LANES_INLINE FloatPart part_fmin(FloatPart a, FloatPart b) {
    return (FloatPart)_mm_min_ps((__m128)a, (__m128)b);
}
LANES_INLINE FloatPart part_fmax(FloatPart a, FloatPart b) {
    return (FloatPart)_mm_max_ps((__m128)a, (__m128)b);
}
LANES_INLINE FloatPart part_sqrt(FloatPart a) {
    return (FloatPart)_mm_sqrt_ps((__m128)a);
}
LANES_INLINE IntPart part_truncate(FloatPart a) {
    return (IntPart)_mm_cvttps_epi32((__m128)a);
}
// Numbers of 2^23 and more are whole already; so is what is no number. The sign of zeros stays.
LANES_INLINE FloatPart part_round(FloatPart a, FloatPart wrong_by, bool up) {
    const FloatPart whole = __builtin_convertvector(part_truncate(a), FloatPart);
    const IntPart off = up ? whole < a : whole > a;
    const FloatPart fixed = (FloatPart)((IntPart)(whole + (FloatPart)(off & (IntPart)wrong_by)) |
                                        ((IntPart)a & INT32_MIN));
    const FloatPart size = (FloatPart)((IntPart)a & INT32_MAX);
    return size < 8388608.0f ? fixed : a;
}
LANES_INLINE FloatPart part_floor(FloatPart a) {
    return part_round(a, FloatPart{} - 1.0f, false);
}
LANES_INLINE FloatPart part_ceil(FloatPart a) {
    return part_round(a, FloatPart{} + 1.0f, true);
}
LANES_INLINE FloatPart part_fma(FloatPart a, FloatPart b, FloatPart c) {
    for (int k = 0; k < kNative; ++k)
        a[k] = __builtin_fmaf(a[k], b[k], c[k]);
    return a;
}
#endif

#define LANES_UNARY(name, part)          \
    LANES_INLINE F name(F a) {           \
        EACH_PART a.p[i] = part(a.p[i]); \
        return a;                        \
    }
LANES_UNARY(fsqrt, part_sqrt)
LANES_UNARY(ffloor, part_floor)
LANES_UNARY(fceil, part_ceil)
#undef LANES_UNARY
LANES_INLINE F fmin(F a, F b) {
    EACH_PART a.p[i] = part_fmin(a.p[i], b.p[i]);
    return a;
}
LANES_INLINE F fmax(F a, F b) {
    EACH_PART a.p[i] = part_fmax(a.p[i], b.p[i]);
    return a;
}
LANES_INLINE F ffma(F a, F b, F c) {
    EACH_PART a.p[i] = part_fma(a.p[i], b.p[i], c.p[i]);
    return a;
}
LANES_INLINE float fsqrt(float a) {
    return __builtin_sqrtf(a);
}
LANES_INLINE float ffloor(float a) {
    return part_floor(FloatPart{} + a)[0];
}
LANES_INLINE float fceil(float a) {
    return part_ceil(FloatPart{} + a)[0];
}
LANES_INLINE float ffma(float a, float b, float c) {
    return __builtin_fmaf(a, b, c);
}
LANES_INLINE F fabs(F a) {
    return as_float(as_uint(a) & U(0x7fffffffu));
}
LANES_INLINE float fabs(float a) {
    return __builtin_fabsf(a);
}
template <class T>
LANES_INLINE T fclamp(T x, T low, T high) {
    return fmin(fmax(x, low), high);
}
template <class T>
LANES_INLINE T fsign(T x) {
    return select(flt(x, T(0.0f)), T(-1.0f), select(flt(T(0.0f), x), T(1.0f), T(0.0f)));
}

// Beyond the range of signed integers, and of NaN: 0x80000000.
LANES_INLINE U to_int(F a) {
    U out;
    EACH_PART out.p[i] = (UintPart)part_truncate(a.p[i]);
    return out;
}
LANES_INLINE uint32_t to_int(float a) {
    return static_cast<uint32_t>(_mm_cvttss_si32(_mm_set_ss(a)));
}
template <class T>
LANES_INLINE auto to_uint(T a) {
    const auto small = flt(a, T(2147483648.0f));
    return select(small, to_int(a), to_int(a - T(2147483648.0f)) ^ decltype(to_int(a))(1u << 31));
}
LANES_INLINE F from_int(U a) {
    F out;
    EACH_PART out.p[i] = __builtin_convertvector((IntPart)a.p[i], FloatPart);
    return out;
}
LANES_INLINE F from_uint(U a) {
    F out;
#if defined(__AVX512F__)
    EACH_PART out.p[i] = (FloatPart)_mm512_cvtepu32_ps((__m512i)a.p[i]);
#else
    // Two halves, each exact; their sum is rounded once.
    EACH_PART out.p[i] = __builtin_convertvector((IntPart)(a.p[i] >> 16), FloatPart) * 65536.0f +
                         __builtin_convertvector((IntPart)(a.p[i] & 0xffffu), FloatPart);
#endif
    return out;
}
LANES_INLINE float from_int(uint32_t a) {
    return static_cast<float>(static_cast<int32_t>(a));
}
LANES_INLINE float from_uint(uint32_t a) {
    return static_cast<float>(a);
}

// Divisions of whole numbers: by zero the quotient has all bits set.
LANES_INLINE uint32_t udiv(uint32_t a, uint32_t b) {
    return b == 0 ? ~0u : a / b;
}
LANES_INLINE uint32_t umod(uint32_t a, uint32_t b) {
    return b == 0 ? ~0u : a % b;
}
LANES_INLINE uint32_t sdiv(uint32_t a, uint32_t b) {
    if (b == 0 || (a == 1u << 31 && b == ~0u))
        return b == 0 ? ~0u : a;
    return static_cast<uint32_t>(static_cast<int32_t>(a) / static_cast<int32_t>(b));
}
LANES_INLINE U udiv(U a, U b) {
    U out;
    // Quotients of 32 bits are exact in double once they are cut: the nearest whole number above is
    // farther away than half a unit in the last place.
    EACH_PART {
        const DoublePart q = __builtin_convertvector(a.p[i], DoublePart) /
                             __builtin_convertvector(b.p[i], DoublePart);
        using LongPart [[gnu::vector_size(8 * kNative)]] = int64_t;
        out.p[i] = __builtin_convertvector(__builtin_convertvector(q, LongPart), UintPart);
    }
    return select(ieq(b, U(0u)), U(~0u), out);
}
LANES_INLINE U umod(U a, U b) {
    return select(ieq(b, U(0u)), U(~0u), a - b * udiv(a, b));
}
LANES_INLINE U sdiv(U a, U b) {
    for (int lane = 0; lane < kLanes; ++lane)
        set_lane(a, lane, sdiv(lane_of(a, lane), lane_of(b, lane)));
    return a;
}
template <class T>
LANES_INLINE T srem(T a, T b) {
    return a - b * sdiv(a, b);
}
template <class T>
LANES_INLINE T smod(T a, T b) { // of the sign of b
    const T rest = srem(a, b);
    const auto fix = land(ine(rest, T(0u)), slt(rest ^ b, T(0u)));
    return select(fix, rest + b, rest);
}

inline uint32_t bit_count(uint32_t a) {
    a -= a >> 1 & 0x55555555u;
    a = (a & 0x33333333u) + (a >> 2 & 0x33333333u);
    return ((a + (a >> 4)) & 0x0f0f0f0fu) * 0x01010101u >> 24;
}
LANES_INLINE U bit_count(U a) {
    const auto shifted = [](U x, uint32_t by) { return shr(x, U(by)); };
    a = a - (shifted(a, 1) & U(0x55555555u));
    a = (a & U(0x33333333u)) + (shifted(a, 2) & U(0x33333333u));
    return shifted(((a + shifted(a, 4)) & U(0x0f0f0f0fu)) * U(0x01010101u), 24);
}
// The lowest bit that is set; all bits where none is.
template <class T>
LANES_INLINE T lowest_bit(T a) {
    return select(ieq(a, T(0u)), T(~0u), bit_count((a & (T(0u) - a)) - T(1u)));
}

} // namespace
} // namespace palpate::native

#include "engine/native/lanes_math.h"
#include "engine/native/lanes_memory.h"

#include "engine/native/lanes_images.h"
