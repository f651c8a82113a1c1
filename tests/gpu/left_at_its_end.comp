#version 460

// The smallest shader that lavapipe 22.3 and SwiftShader compute wrongly; each another one of the two
// results. See docs/decisions/10-loops-that-lanes-leave.md.

layout(local_size_x = 16) in;

layout(std430, binding = 0) readonly buffer In { uint table[]; };
layout(std430, binding = 1) writeonly buffer Out { uvec2 result[]; };

void main() {
    const uint lane = gl_LocalInvocationID.x;
    uint left = lane + 1u, sum = 0u, last = 0u;
    do {
        sum += table[left];
        last = 3u * table[left];
        left -= 1u;
    } while (left != 0u);
    result[lane] = uvec2(sum, last);
}
