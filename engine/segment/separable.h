#pragma once

#include <array>
#include <vector>

#include "engine/segment/kernel.h"

namespace palpate {

// Samples that a kernel is passed over: x fastest, packed.
struct Box {
    glm::ivec3 size{};
    std::vector<float> samples;
};

// Passes a kernel along an axis (0, 1, 2). The box becomes shorter by twice the kernel's radius.
// Differences of neighbours are taken before they are weighted, so that large values that are alike
// lose nothing. The same bits on every processor.
void convolve(const glm::ivec3& size, const float* in, int axis, const Kernel& kernel, Box& out);

} // namespace palpate
