#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Lays eyes' pictures out for a screen, in 8 bits a channel: one invocation a pixel. Its twin is
// engine/render/display_layout.cpp; both give the same bytes.

#include "shaders/shared/display.h"

layout(local_size_x = kDisplayGroup, local_size_y = kDisplayGroup) in;

layout(scalar, binding = kDisplayBlock) uniform Block { DisplayBlock block; };
layout(binding = kDisplayPicture) uniform sampler2DArray picture;
layout(binding = kDisplayTarget, rgba8) uniform writeonly image2DArray target;

vec3 color_of(uint shown, uvec2 pixel) {
    const uint y = block.mirror != 0u ? block.eye_px.y - 1u - pixel.y : pixel.y;
    const uint eye = min(shown ^ block.swap_eyes, block.last_eye);
    precise vec3 color = texelFetch(picture, ivec3(pixel.x, y, eye), 0).rgb;
    for (uint i = 0u; i < block.mark_count; ++i) {
        const DisplayMark mark = block.marks[i];
        precise const vec2 arm = (vec2(pixel.x, y) - mark.at) * mark.scale;
        precise const float q = arm.x * arm.x + arm.y * arm.y;
        precise const float t = clamp((mark.outer - q) * mark.inverse, 0.0, 1.0);
        precise const float weight = t * t * (3.0 - 2.0 * t) * mark.opacity;
        if (mark.eye == eye && weight > 0.0)
            color = color + weight * (mark.color - color);
    }
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
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, block.joint_px)))
        return;
    const ivec3 at = ivec3(pixel + block.corner_px, 0);
    const uvec2 on_screen = uvec2(ivec2(pixel) + block.origin_px);
    uint eye = 0u;
    switch (block.form) {
        case kSideBySide:
            eye = pixel.x / block.eye_px.x;
            break;
        case kTopBottom:
            eye = pixel.y / block.eye_px.y;
            break;
        case kRowInterleaved:
            eye = on_screen.y & 1u;
            break;
        case kColumnInterleaved:
            eye = on_screen.x & 1u;
            break;
        case kCheckerboard:
            eye = (on_screen.x + on_screen.y) & 1u;
            break;
        case kRightEye:
            eye = 1u;
            break;
    }
    pixel %= block.eye_px;
    vec3 color = color_of(eye, pixel);
    if (block.form == kAnaglyph)
        color = vec2(luminance(color), luminance(color_of(1u, pixel))).xyy;
    const vec3 bytes = vec3(byte_share(color.r), byte_share(color.g), byte_share(color.b));
    imageStore(target, at, vec4(block.bgra != 0u ? bytes.bgr : bytes, 1.0));
}
