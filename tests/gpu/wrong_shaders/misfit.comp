#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// expected: offsetof(Misfit, second) == 4
#include "tests/gpu/wrong_shaders/misfit.h"
layout(local_size_x = 1) in;
layout(scalar, binding = 0) buffer Block { Misfit misfit; };
void main() {
    misfit.second = misfit.first;
}
