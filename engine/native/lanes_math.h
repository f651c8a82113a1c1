#pragma once

// Functions that no instruction computes. Included by lanes.h.
namespace palpate::native {
namespace {

// 2^x and the logarithm to base 2, in double: errors below 1e-11, so that a float made of them is
// within 0.501 units in the last place.
//
// 2^x: x is a whole number and a rest of at most 1/2; exp(rest * ln 2) by its series, whose first
// missing term is (0.3466)^11 / 11! = 2e-13.
LANES_INLINE DoublePart part_exp2(DoublePart x) {
    using LongPart [[gnu::vector_size(8 * kNative)]] = int64_t;
    const DoublePart low = DoublePart{} - 1000.0, high = DoublePart{} + 1000.0;
    const DoublePart bounded = x < low ? low : x > high ? high : x; // NaN stays
    const double shift = 6755399441055744.0; // 1.5 * 2^52: adding it rounds to a whole number
    const DoublePart shifted = bounded + shift;
    const DoublePart r = (bounded - (shifted - shift)) * 0.6931471805599453;
    DoublePart sum = DoublePart{} + 1.0 / 3628800;
    for (const double term : {1.0 / 362880, 1.0 / 40320, 1.0 / 5040, 1.0 / 720, 1.0 / 120, 1.0 / 24,
                              1.0 / 6, 1.0 / 2, 1.0, 1.0})
        sum = sum * r + term;
    const LongPart power = ((LongPart)shifted << 52) + (LongPart)(DoublePart{} + 1.0);
    return sum * (DoublePart)power;
}
// ln m = 2 atanh((m - 1) / (m + 1)) for m from sqrt(1/2) to sqrt(2); the first missing term of the
// series is 2 * 0.1716^17 / 17 = 1e-14.
LANES_INLINE DoublePart part_log2(DoublePart x) {
    using LongPart [[gnu::vector_size(8 * kNative)]] = int64_t;
    const LongPart offset = LongPart{} + 0x3fe6a09e667f3bcd; // sqrt(1/2)
    const LongPart power = ((LongPart)x - offset) >> 52;
    const DoublePart m = (DoublePart)((LongPart)x - (power << 52));
    const DoublePart s = (m - 1.0) / (m + 1.0), s2 = s * s;
    DoublePart sum = DoublePart{} + 1.0 / 15;
    for (const double term : {1.0 / 13, 1.0 / 11, 1.0 / 9, 1.0 / 7, 1.0 / 5, 1.0 / 3, 1.0})
        sum = sum * s2 + term;
    return __builtin_convertvector(power, DoublePart) + sum * s * 2.8853900817779268; // 2 / ln 2
}

LANES_INLINE F fexp2(F x) {
    EACH_PART x.p[i] =
        __builtin_convertvector(part_exp2(__builtin_convertvector(x.p[i], DoublePart)), FloatPart);
    return x;
}
LANES_INLINE F fexp(F x) {
    EACH_PART x.p[i] = __builtin_convertvector(
        part_exp2(__builtin_convertvector(x.p[i], DoublePart) * 1.4426950408889634), FloatPart);
    return x;
}
LANES_INLINE F flog2_positive(F x) {
    EACH_PART x.p[i] =
        __builtin_convertvector(part_log2(__builtin_convertvector(x.p[i], DoublePart)), FloatPart);
    return x;
}
LANES_INLINE F flog2(F x) {
    const F zero(0.0f), infinite(__builtin_inff());
    F out = flog2_positive(x);
    out = select(feq(x, zero), -infinite, out);
    out = select(feq(x, infinite), infinite, out);
    return select(lor(flt(x, zero), fne(x, x)), F(__builtin_nanf("")), out);
}
LANES_INLINE F flog(F x) {
    return flog2(x) * F(0.6931472f);
}
// NaN for x below zero, as GLSL leaves it open.
LANES_INLINE F fpow(F x, F y) {
    F out;
    EACH_PART {
        const DoublePart log = part_log2(__builtin_convertvector(x.p[i], DoublePart));
        out.p[i] = __builtin_convertvector(
            part_exp2(log * __builtin_convertvector(y.p[i], DoublePart)), FloatPart);
    }
    const F zero(0.0f);
    out =
        select(feq(x, zero),
               select(flt(zero, y), zero, select(feq(y, zero), F(1.0f), F(__builtin_inff()))), out);
    return select(lor(flt(x, zero), fne(x, x)), F(__builtin_nanf("")), out);
}
inline float fexp2(float x) {
    return lane_of(fexp2(F(x)), 0);
}
inline float fexp(float x) {
    return lane_of(fexp(F(x)), 0);
}
inline float flog2(float x) {
    return lane_of(flog2(F(x)), 0);
}
inline float flog(float x) {
    return lane_of(flog(F(x)), 0);
}
inline float fpow(float x, float y) {
    return lane_of(fpow(F(x), F(y)), 0);
}

template <class T>
LANES_INLINE T fmix(T a, T b, T share) {
    return a * (T(1.0f) - share) + b * share;
}
template <class T>
LANES_INLINE T fstep(T edge, T x) {
    return select(flt(x, edge), T(0.0f), T(1.0f));
}
template <class T>
LANES_INLINE T ffract(T x) {
    return x - ffloor(x);
}

// Sixteen bits of a number from 0 to 1, rounded to the nearest.
template <class T>
LANES_INLINE auto to_unorm16(T x) {
    return to_int(ffloor(fclamp(x, T(0.0f), T(1.0f)) * T(65535.0f) + T(0.5f)));
}
template <class T>
LANES_INLINE auto pack_unorm16(T a, T b) {
    return to_unorm16(a) | shl(to_unorm16(b), decltype(to_unorm16(b))(16u));
}
template <class T>
LANES_INLINE auto from_unorm16(T x) {
    return from_int(x & T(0xffffu)) / decltype(from_int(x))(65535.0f);
}

} // namespace
} // namespace palpate::native
