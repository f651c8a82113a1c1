// Structs of tests/gpu/every_kind.comp.
#ifndef PALPATE_TESTS_EVERY_KIND_H
#define PALPATE_TESTS_EVERY_KIND_H
#include "shaders/shared/types.h"
GPU_BEGIN
struct KindElement {
    vec3 three;
    uint one;
};
struct KindBlock {
    vec3 three; // scalar layout: 12 bytes
    mat3 matrix;
    KindElement elements[2];
    ivec2 last;
};
struct KindOut {
    uint whole, is_on;
    int sign;
    float part;
};
const uint kKindBlock = 0u;
const uint kKindImage = 2u;
const uint kKindTarget = 4u;
const uint kKindOut = 5u;
const uint kKindMore = 7u;
GPU_END
#endif
