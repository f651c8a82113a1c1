#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Every kind of binding and of specialization constant, for tests/gpu/shader_test.cpp.

#include "tests/gpu/every_kind.h"

layout(local_size_x = 1) in;

layout(constant_id = 0) const uint kWholeNumber = 7u;
layout(constant_id = 2) const int kSign = -3; // 1 is left out
layout(constant_id = 3) const float kPart = 0.25;
layout(constant_id = 4) const bool kIsOn = true;

layout(scalar, binding = kKindBlock) uniform Block { KindBlock block; };
layout(binding = kKindImage) uniform sampler2DArray image;
layout(binding = kKindTarget, rgba8) uniform writeonly image2DArray target;
layout(scalar, binding = kKindOut) writeonly buffer Out {
    KindOut result;
    vec2 rest[];
};
#if HAS_MORE
layout(scalar, binding = kKindMore) readonly buffer More { uint more[]; };
#endif

void main() {
    result = KindOut(kWholeNumber, uint(kIsOn), kSign, kPart);
    rest[0] = block.three.xy + vec2(block.last);
    imageStore(target, ivec3(0), texelFetch(image, ivec3(0), 0) + block.elements[1].one);
#if HAS_MORE
    rest[1] = vec2(more[0]);
#endif
}
