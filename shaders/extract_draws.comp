#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Writes the draws of blocks that were made again or have gone. One invocation a change.

#include "shaders/shared/extract.h"

layout(local_size_x = 64) in;

layout(scalar, binding = kExtractChanges) readonly buffer Changes {
    uint change_count;
    ExtractDrawChange changes[];
};
layout(scalar, binding = kExtractDraws) writeonly buffer Draws { ExtractDraw draws[]; };

void main() {
    const uint at = gl_GlobalInvocationID.x;
    if (at < change_count)
        draws[changes[at].slot] = changes[at].draw;
}
