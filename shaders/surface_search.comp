#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Lists the triangles of blocks that may be seen in the pixels that are drawn. One invocation a block.
// A block is hidden where opaque surfaces that are drawn already are nearer in all of its box's pixels;
// so the nearest blocks are drawn first, and the next are searched behind them.

#include "shaders/shared/surface.h"
#include "shaders/lib/surface.glsl"
#include "shaders/lib/surface_pixels.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kSurfaceNearest) readonly buffer Nearest { uvec2 nearest[]; };
layout(scalar, binding = kSurfaceChunks) writeonly buffer Chunks { uvec2 chunks[]; };
layout(scalar, binding = kSurfaceBlocks) readonly buffer Blocks { SurfaceBlock blocks[]; };
layout(scalar, binding = kSurfaceSearch) buffer Search { SurfaceSearch search; };

// A box over more pixels is not looked at behind what is drawn.
const uint kMostLooks = 4096u;

void main() {
    const SurfaceMesh mesh = frame.meshes[search.mesh];
    const uint asked = gl_GlobalInvocationID.x;
    const SurfaceBlock block = blocks[search.first + min(asked, search.count - 1u)];
    vec2 low = vec2(kFarAway), high = vec2(-kFarAway);
    float depth = kFarAway, reach = 0.0;
    for (uint i = 0u; i < 8u; ++i) {
        const bvec3 side = bvec3((i & 1u) != 0u, (i & 2u) != 0u, (i & 4u) != 0u);
        const vec3 corner = mesh.camera_from_mesh * mix(block.low, block.high, side) + mesh.origin;
        low = min(low, projected(corner));
        high = max(high, projected(corner));
        depth = min(depth, corner.z);
        reach = max(reach, max(abs(corner.x), max(abs(corner.y), abs(corner.z))));
    }
    const vec3 shift = abs(mesh.origin);
    reach += max(shift.x, max(shift.y, shift.z));
    const float nearer = depth - 1e-5 * reach; // a hundred roundings
    const bool before = nearer > 0.0;
    const ivec4 pixels = pixels_between(low, high);
    const ivec2 size = pixels.zw - pixels.xy + 1;
    const bool within = size.x > 0 && size.y > 0;
    const bool seen = asked < search.count && block.count > 0u && (within || !before);
    const bool small = all(lessThan(size, ivec2(kMostLooks))) && uint(size.x * size.y) <= kMostLooks;
    const uint looks = seen && before && small && search.hides != 0u ? uint(size.x * size.y) : 0u;
    uint look = 0u;
    bool hidden = looks > 0u;
    while (hidden && look < looks) {
        const uvec2 pixel = uvec2(pixels.xy) + uvec2(look % uint(size.x), look / uint(size.x));
        hidden = depth_of(nearest[place_of(pixel)]) < nearer;
        look += 1u;
    }
    const uint groups = seen && !hidden ? (block.count + kSurfaceGroup - 1u) / kSurfaceGroup : 0u;
    const uint slot = groups > 0u ? atomicAdd(search.groups_x, groups) : 0u;
    for (uint i = 0u; i < groups; ++i) {
        const uint first = block.first + i * kSurfaceGroup;
        chunks[slot + i] = uvec2(first, min(first + kSurfaceGroup, block.first + block.count));
    }
}
