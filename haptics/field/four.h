#pragma once

#include <cstring>

namespace palpate::haptics {

// Four floats at once.
using Four = float __attribute__((vector_size(16)));
inline Four load(const float* from) {
    Four four;
    std::memcpy(&four, from, sizeof four);
    return four;
}
inline void store(float* to, Four four) {
    std::memcpy(to, &four, sizeof four);
}
inline float sum(Four four) {
    return (four[0] + four[1]) + (four[2] + four[3]);
}

} // namespace palpate::haptics
