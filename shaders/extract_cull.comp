#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Finds the blocks that the surface may cross, by the ranges of the blocks whose samples their cells
// read. One invocation a block. Run twice: first to count those of each group, then with IS_LIST,
// when the groups' counts have been summed, to list them in order.

#include "shaders/shared/extract.h"
#include "shaders/lib/extract_frame.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kExtractRanges) readonly buffer Ranges { ExtractRange ranges[]; };
#if IS_LIST
layout(scalar, binding = kExtractSums) readonly buffer Sums { uint sums[]; };
layout(scalar, binding = kExtractList) writeonly buffer List { uint list[]; };
#else
layout(scalar, binding = kExtractSums) writeonly buffer Sums { uint sums[]; };
#endif

shared uint found[2]; // bit: of this group's invocations

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint number = listed_group() * kExtractGroup + lane;
    const ivec3 block = block_at(number);
    const ivec3 count = (frame.size + 7) / 8; // blocks of the volume
    if (lane < 2u)
        found[lane] = 0u;
    barrier();
    int least = kOrderHighest, most = kOrderLowest;
    for (int n = 0; n < 8; ++n) {
        const ivec3 at = block + ivec3(n & 1, n >> 1 & 1, n >> 2);
        const bool beyond = any(lessThan(at, ivec3(0))) || any(greaterThanEqual(at, count));
        const ivec3 near = clamp(at, ivec3(0), count - 1);
        const ExtractRange range = ranges[near.x + count.x * (near.y + count.y * near.z)];
        // Beyond a closed border all is outside; beyond an open one is nothing.
        const int outermost = frame.closed != 0u ? kOrderLowest : kOrderHighest;
        least = min(least, beyond ? outermost : range.least);
        most = max(most, beyond ? kOrderLowest : range.most);
    }
    const bool exists = number < frame.blocks.x * frame.blocks.y * frame.blocks.z;
    const bool crossed = exists && most >= frame.iso_order && least < frame.iso_order;
    if (crossed)
        atomicOr(found[lane >> 5], 1u << (lane & 31u));
    barrier();
#if IS_LIST
    const uint below = (1u << (lane & 31u)) - 1u;
    const uint rank = lane < 32u ? uint(bitCount(found[0] & below))
                                 : uint(bitCount(found[0]) + bitCount(found[1] & below));
    if (crossed)
        list[sums[listed_group()] + rank] = number;
#else
    if (lane == 0u && listed_group() < uint(sums.length()))
        sums[listed_group()] = uint(bitCount(found[0]) + bitCount(found[1]));
#endif
}
