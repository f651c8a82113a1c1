#pragma once

// Integers of 64 bits in memory, for the translated shaders that have such.
#include "engine/native/lanes.h"

namespace palpate::native {
namespace {

// Two numbers, read and written in one piece, so that none is half of what another wrote.
struct Wide {
    U low, high;
};
template <Atomic kind>
inline Wide atomic(Memory memory, U at, Wide value, B mask) {
    static_assert(kind == Atomic::kLoad || kind == Atomic::kUmin);
    Wide out{U(0u), U(0u)};
    const uint32_t count = memory.count > 0 ? memory.count - 1 : 0; // places of two words
    each_lane(land(mask, ult(at, U(count))), [&](int lane) {
        auto* const place = reinterpret_cast<uint64_t*>(memory.words + lane_of(at, lane));
        uint64_t before = __atomic_load_n(place, __ATOMIC_RELAXED);
        if constexpr (kind == Atomic::kUmin) {
            const uint64_t own =
                uint64_t{lane_of(value.high, lane)} << 32 | lane_of(value.low, lane);
            while (own < before && !__atomic_compare_exchange_n(place, &before, own, true,
                                                                __ATOMIC_RELAXED, __ATOMIC_RELAXED))
                continue;
        }
        set_lane(out.low, lane, static_cast<uint32_t>(before));
        set_lane(out.high, lane, static_cast<uint32_t>(before >> 32));
    });
    return out;
}

} // namespace
} // namespace palpate::native
