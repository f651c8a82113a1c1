// The last pass of a frame: eyes' pictures as a screen shows them.
#ifndef PALPATE_SHARED_DISPLAY_H
#define PALPATE_SHARED_DISPLAY_H
#include "shaders/shared/types.h"
GPU_BEGIN
// StereoLayout, in its order; the last of them, separate, is none.
const uint kSideBySide = 0u;
const uint kTopBottom = 1u;
const uint kRowInterleaved = 2u;
const uint kColumnInterleaved = 3u;
const uint kCheckerboard = 4u;
const uint kAnaglyph = 5u;
const uint kLeftEye = 6u;
const uint kRightEye = 7u;

const uint kMostMarks = 16u;

// A spot over an eye's picture (EyeMark): with q = length((pixel - at) * scale)^2, its weight goes
// smoothly from 0 at q = outer to `opacity` at q = outer - 1 / inverse.
struct DisplayMark {
    vec2 at, scale;
    float outer, inverse;
    vec3 color;
    float opacity;
    uint eye;
};

struct DisplayBlock {
    uvec2 eye_px;                 // size of an eye's picture
    uvec2 first_px, end_px;       // of the layout, that are written
    ivec2 origin_px;              // of its first pixel on the screen
    uvec2 corner_px;              // of its first pixel in the target
    uint form;                    // one of the above
    uint last_eye;                // layers of the picture - 1
    uint swap_eyes, mirror, bgra; // 0 or 1
    uint mark_count;
    DisplayMark marks[kMostMarks];
};
const uint kDisplayBlock = 0u;
const uint kDisplayPicture = 1u; // a layer an eye
const uint kDisplayTarget = 2u;
const uint kDisplayGroup = 8u; // invocations a side; one a pixel
GPU_END
#endif
