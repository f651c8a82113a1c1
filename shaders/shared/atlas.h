// The data that passes need for a volume that lies on the device brick by brick.
#ifndef PALPATE_SHARED_ATLAS_H
#define PALPATE_SHARED_ATLAS_H
#include "shaders/shared/types.h"
GPU_BEGIN
const uint kAtlasBrickSide = 32u; // samples
const float kAbsentBrick = -5e8;  // a page's x below this: the brick is not resident

struct AtlasFrame {
    vec3 pages_texture; // 1 / bricks on each axis
    vec3 image_texture; // 1 / texels of the atlas on each axis
    // Texels that a position keeps from the outermost texels of its slot, so that no rounding of
    // texture coordinates reaches the slot beside it.
    float inset;
    vec3 part_low, part_high; // index: the box of bricks that this pass marches
    uint part_eyes;           // bit e: it marches the rays of eye e
    uint first_part;          // 1: nothing is carried on from another pass
};
GPU_END
#endif
