#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// How far a picture is from full quality at sparse pixels: one invocation a ray.

#include "shaders/shared/interactive.h"

layout(local_size_x = 64) in;

layout(scalar, binding = kJudgeBlock) uniform Block { JudgeBlock block; };
layout(binding = kJudgeColor) uniform sampler2DArray color;
layout(binding = kJudgeTruth) uniform sampler2DArray truth;
layout(scalar, binding = kJudgeSquares) writeonly buffer Squares { float squares[]; };

void main() {
    const uvec2 ray = gl_GlobalInvocationID.xy;
    const uint eye = gl_GlobalInvocationID.z;
    if (all(lessThan(ray, block.rays))) {
        const uvec2 pixel = block.first_px + ray * block.px_per_ray;
        const vec3 difference = texelFetch(color, ivec3(pixel, eye), 0).rgb -
                                texelFetch(truth, ivec3(ray, eye), 0).rgb;
        squares[ray.x + block.rays.x * (ray.y + block.rays.y * eye)] =
            dot(difference, difference) / 3.0;
    }
}
