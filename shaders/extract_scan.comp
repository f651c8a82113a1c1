#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// From how many blocks each group of the cull found, how many were found before it; and of all the
// groups of what comes next. One workgroup.

#include "shaders/shared/extract.h"

layout(local_size_x = 64) in;

layout(scalar, binding = kExtractSums) buffer Sums { uint sums[]; };
layout(scalar, binding = kExtractWork) writeonly buffer Work { ExtractWork work; };

shared uint partial[2u * kExtractGroup];

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint count = uint(sums.length());
    uint total = 0u;
    for (uint first = 0u; first < count; first += kExtractGroup) { // the same for all lanes
        const uint at = min(first + lane, count - 1u);
        const uint value = first + lane < count ? sums[at] : 0u;
        uint sum = value;
        uint from = 0u;
        partial[lane] = value;
        barrier();
        for (uint back = 1u; back < kExtractGroup; back *= 2u) {
            sum += lane >= back ? partial[from + lane - min(back, lane)] : 0u;
            from = kExtractGroup - from;
            partial[from + lane] = sum;
            barrier();
        }
        if (first + lane < count)
            sums[at] = total + sum - value;
        total += partial[from + kExtractGroup - 1u];
        barrier();
    }
    if (lane == 0u)
        work = ExtractWork(min(total, kExtractMostGroups),
                           (total + kExtractMostGroups - 1u) / kExtractMostGroups, 1u, total);
}
