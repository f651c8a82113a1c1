#pragma once

// Memory by words of 32 bits, and what invocations say to each other. Included by lanes.h.
namespace palpate::native {
namespace {

// A buffer, shared memory, or an array of each lane's own.
struct Memory {
    uint32_t* words;
    uint32_t count;
};

// A block's fixed part is read from here where nothing, or too little, is bound.
alignas(64) constexpr uint32_t kNoWords[4096] = {};

LANES_INLINE Memory memory_of(const Resource& resource) {
    const uint64_t words = resource.buffer.bytes / 4;
    return {reinterpret_cast<uint32_t*>(resource.buffer.data),
            words < 0x7fffffffu ? static_cast<uint32_t>(words) : 0x7fffffffu};
}
// The same of which the first `words` can be read without asking.
LANES_INLINE const uint32_t* fixed_part(Memory memory, uint32_t words) {
    return memory.count >= words ? memory.words : kNoWords;
}

LANES_INLINE uint32_t load(Memory memory, uint32_t at) {
    return at < memory.count ? memory.words[at] : 0u;
}
LANES_INLINE U load(Memory memory, U at) {
    U out;
    const B inside = ult(at, U(memory.count));
#if defined(__AVX512F__)
    EACH_PART out.p[i] = (UintPart)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), inside.p[i],
                                                               (__m512i)at.p[i], memory.words, 4);
#elif defined(__AVX2__)
    EACH_PART out.p[i] = (UintPart)_mm256_mask_i32gather_epi32(
        _mm256_setzero_si256(), reinterpret_cast<const int*>(memory.words), (__m256i)at.p[i],
        (__m256i)inside.p[i], 4);
#else
    out = U(0u);
    each_lane(inside, [&](int lane) { set_lane(out, lane, memory.words[lane_of(at, lane)]); });
#endif
    return out;
}
LANES_INLINE void store(Memory memory, uint32_t at, uint32_t value) {
    if (at < memory.count)
        memory.words[at] = value;
}
LANES_INLINE void store(Memory memory, U at, U value, B mask) {
    const B inside = land(mask, ult(at, U(memory.count)));
#if defined(__AVX512F__)
    EACH_PART _mm512_mask_i32scatter_epi32(memory.words, inside.p[i], (__m512i)at.p[i],
                                           (__m512i)value.p[i], 4);
#else
    each_lane(inside, [&](int lane) { memory.words[lane_of(at, lane)] = lane_of(value, lane); });
#endif
}

// Elements of a block's last array.
LANES_INLINE uint32_t array_length(Memory memory, uint32_t first_word, uint32_t stride) {
    return memory.count > first_word ? (memory.count - first_word) / stride : 0u;
}

// Arrays of each lane's own: element n of all lanes lies before element n + 1 of any.
template <int kCount>
LANES_INLINE Memory own_memory(U (&words)[kCount]) {
    return {reinterpret_cast<uint32_t*>(words), kCount * kLanes};
}
LANES_INLINE U own_address(U element) {
    return umin(element, U(0x7fffffffu / kLanes)) * U(kLanes) + lane_numbers();
}

enum class Atomic { kLoad, kStore, kExchange, kAdd, kUmin, kUmax, kSmin, kSmax, kAnd, kOr, kXor };

template <Atomic kind>
inline uint32_t atomic_word(uint32_t* word, uint32_t value) {
    if constexpr (kind == Atomic::kLoad)
        return __atomic_load_n(word, __ATOMIC_RELAXED);
    else if constexpr (kind == Atomic::kExchange || kind == Atomic::kStore)
        return __atomic_exchange_n(word, value, __ATOMIC_RELAXED);
    else if constexpr (kind == Atomic::kAdd)
        return __atomic_fetch_add(word, value, __ATOMIC_RELAXED);
    else if constexpr (kind == Atomic::kAnd)
        return __atomic_fetch_and(word, value, __ATOMIC_RELAXED);
    else if constexpr (kind == Atomic::kOr)
        return __atomic_fetch_or(word, value, __ATOMIC_RELAXED);
    else if constexpr (kind == Atomic::kXor)
        return __atomic_fetch_xor(word, value, __ATOMIC_RELAXED);
    else {
        uint32_t before = __atomic_load_n(word, __ATOMIC_RELAXED);
        for (;;) {
            const uint32_t after = kind == Atomic::kUmin   ? umin(before, value)
                                   : kind == Atomic::kUmax ? umax(before, value)
                                   : kind == Atomic::kSmin ? smin(before, value)
                                                           : smax(before, value);
            if (after == before || __atomic_compare_exchange_n(word, &before, after, true,
                                                               __ATOMIC_RELAXED, __ATOMIC_RELAXED))
                return before;
        }
    }
}
// One lane after the other, in their order.
template <Atomic kind>
inline U atomic(Memory memory, U at, U value, B mask) {
    U out(0u);
    each_lane(land(mask, ult(at, U(memory.count))), [&](int lane) {
        set_lane(out, lane,
                 atomic_word<kind>(memory.words + lane_of(at, lane), lane_of(value, lane)));
    });
    return out;
}

// Subgroups are eight lanes side by side at every width.
template <class Do>
LANES_INLINE void each_subgroup(B mask, Do&& run) {
    for (int first = 0; first < kLanes; first += kSubgroup) {
        uint32_t active = 0;
        for (int lane = 0; lane < kSubgroup; lane += kNative < 8 ? kNative : 8)
            active |= (bits(mask.p[(first + lane) / kNative]) >> (first + lane) % kNative) << lane;
        run(first, active & 0xffu);
    }
}
LANES_INLINE B subgroup_any(B value, B mask) {
    const B true_of = land(value, mask);
    B out;
#if defined(__AVX512F__)
    EACH_PART out.p[i] = static_cast<MaskPart>((true_of.p[i] & 0xff ? 0xff : 0) |
                                               (true_of.p[i] & 0xff00 ? 0xff00 : 0));
#elif defined(__AVX2__)
    EACH_PART out.p[i] = IntPart{} - int32_t{bits(true_of.p[i]) != 0};
#else
    for (int i = 0; i < kParts; i += 2)
        out.p[i] = out.p[i + 1] =
            IntPart{} - int32_t{(bits(true_of.p[i]) | bits(true_of.p[i + 1])) != 0};
#endif
    return out;
}
LANES_INLINE B subgroup_all(B value, B mask) {
    return lnot(subgroup_any(lnot(value), mask));
}
inline B subgroup_elect(B mask) {
    U out(0u);
    each_subgroup(mask, [&](int first, uint32_t active) {
        if (active != 0)
            set_lane(out, first + __builtin_ctz(active), 1u);
    });
    return ine(out, U(0u));
}
template <class T>
inline T subgroup_first(T value, B mask) {
    T out = value;
    each_subgroup(mask, [&](int first, uint32_t active) {
        const int from = active == 0 ? first : first + __builtin_ctz(active);
        for (int lane = 0; lane < kSubgroup; ++lane)
            set_lane(out, first + lane, lane_of(value, from));
    });
    return out;
}
// The sum of all lanes, or of those up to, or before, each.
enum class Scan { kReduce, kInclusive, kExclusive };
template <Scan scan>
inline U subgroup_add(U value, B mask) {
    U out(0u);
    each_subgroup(mask, [&](int first, uint32_t active) {
        uint32_t sum = 0;
        for (int lane = 0; lane < kSubgroup; ++lane) {
            const uint32_t before = sum;
            sum += active >> lane & 1 ? lane_of(value, first + lane) : 0u;
            set_lane(out, first + lane, scan == Scan::kExclusive ? before : sum);
        }
        for (int lane = 0; lane < kSubgroup && scan == Scan::kReduce; ++lane)
            set_lane(out, first + lane, sum);
    });
    return out;
}

} // namespace
} // namespace palpate::native
