#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Lays eyes' pictures out for a screen, in 8 bits a channel: one invocation a pixel. Its twin is
// engine/render/display_layout.cpp; both give the same bytes. Built with and without HAS_MARKS: on
// llvmpipe a loop over none of them takes seven times as long as all the rest.

#include "shaders/shared/display.h"

layout(local_size_x = kDisplayGroup, local_size_y = kDisplayGroup) in;

layout(scalar, binding = kDisplayBlock) uniform Block { DisplayBlock block; };
layout(binding = kDisplayPicture) uniform sampler2DArray picture;
layout(binding = kDisplayTarget, rgba8) uniform writeonly image2DArray target;

vec3 color_of(uint shown, uvec2 pixel) {
    const uint y = block.mirror != 0u ? block.eye_px.y - 1u - pixel.y : pixel.y;
    const uint eye = min(shown ^ block.swap_eyes, block.last_eye);
    precise vec3 color = texelFetch(picture, ivec3(pixel.x, y, eye), 0).rgb;
#if HAS_MARKS
    for (uint i = 0u; i < block.mark_count; ++i) {
        precise const vec2 arm = (vec2(pixel.x, y) - block.marks[i].at) * block.marks[i].scale;
        precise const float q = arm.x * arm.x + arm.y * arm.y;
        precise const float t =
            clamp((block.marks[i].outer - q) * block.marks[i].inverse, 0.0, 1.0);
        precise const float weight = t * t * (3.0 - 2.0 * t) * block.marks[i].opacity;
        if (block.marks[i].eye == eye && weight > 0.0)
            color = color + weight * (block.marks[i].color - color);
    }
#endif
    return color;
}

float luminance(vec3 color) {
    precise float sum = 0.2126 * color.r + 0.7152 * color.g + 0.0722 * color.b;
    return sum;
}

// display_byte() as the share of 255 that an 8-bit channel rounds to it.
float byte_share(float value) {
    precise float scaled = 255.0 * clamp(value, 0.0, 1.0);
    const float whole = floor(scaled); // exact, as what is left of it
    return value > 0.0 ? (whole + (scaled - whole >= 0.5 ? 1.0 : 0.0)) / 255.0 : 0.0;
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy + block.first_px;
    if (any(greaterThanEqual(pixel, block.end_px)))
        return;
    const ivec3 at = ivec3(pixel + block.corner_px, 0);
    const uvec2 on_screen = uvec2(ivec2(pixel) + block.origin_px);
    // Selections, and a loop without turns: llvmpipe walks through all cases of a switch, and
    // divides integers one by one.
    const uvec2 half_of = uvec2(block.form == kSideBySide && pixel.x >= block.eye_px.x,
                                block.form == kTopBottom && pixel.y >= block.eye_px.y);
    const uint counted = (block.form == kColumnInterleaved ? 0u : on_screen.y) +
                         (block.form == kRowInterleaved ? 0u : on_screen.x);
    const bool interleaved = block.form == kRowInterleaved || block.form == kColumnInterleaved ||
                             block.form == kCheckerboard;
    const uint eye = block.form == kRightEye ? 1u
                     : interleaved           ? counted & 1u
                                             : half_of.x + half_of.y;
    pixel -= half_of * block.eye_px;
    vec3 color = color_of(eye, pixel);
    for (uint i = block.form == kAnaglyph ? 1u : 2u; i < 2u; ++i)
        color = vec2(luminance(color), luminance(color_of(i, pixel))).xyy;
    const vec3 bytes = vec3(byte_share(color.r), byte_share(color.g), byte_share(color.b));
    imageStore(target, at, vec4(block.bgra != 0u ? bytes.bgr : bytes, 1.0));
}
