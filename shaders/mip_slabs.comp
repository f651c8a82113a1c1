#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// For MIP: how high the volume may be along the rays of a tile, slab by slab, and the slabs in
// descending order of that. Rays that take them in this order stop at the first that is no higher
// than what they have met; the maximum of samples does not depend on their order. One workgroup a
// listed tile, one invocation a slab.

#include "shaders/shared/tiles.h"
#include "shaders/lib/rays.glsl"

layout(local_size_x = kMipSlabs) in;

layout(scalar, binding = kTileFrame) uniform FrameBlock { Frame frame; };
layout(binding = kTileCells) uniform sampler3D cells;
layout(scalar, binding = kTileEntries) readonly buffer Entries { TileEntry entries[]; };
layout(scalar, binding = kTileSlabs) writeonly buffer Slabs { uint slabs[]; };

#include "shaders/lib/skipping.glsl"
#include "shaders/lib/mip_slab.glsl"

shared float bounds[kMipSlabs];

// The highest texel that rays about the one through the tile's middle can sample in `count`
// segments from `first`: of all cells in the box about that piece of the beam. Their lattices begin
// up to jitter_mm before the eye.
float bound_of(Ray ray, FrameEye eye, float first, float count) {
    const float from = (first + 0.5) * frame.step - frame.jitter_mm;
    const float to = (first + count - 0.5) * frame.step;
    const vec3 a = ray.origin + from * ray.direction;
    const vec3 b = ray.origin + to * ray.direction;
    const float width = eye.spread.x + eye.spread.y * to + kClearance;
    const vec3 low = floor((min(a, b) - width) / frame.cell_side);
    const vec3 high = floor((max(a, b) + width) / frame.cell_side);
    bool going = all(greaterThanEqual(high, vec3(0.0))) &&
                 all(lessThanEqual(low, frame.cell_last));
    const vec3 begin = clamp(low, vec3(0.0), frame.cell_last);
    const vec3 end = clamp(high, vec3(0.0), frame.cell_last);
    float bound = uintBitsToFloat(0xff800000u); // -infinity
    vec3 cell = begin;
    while (going) {
        bound = max(bound, cell_entry(cell));
        cell.x += 1.0;
        const bool row = cell.x > end.x;
        cell.x = row ? begin.x : cell.x;
        cell.y += row ? 1.0 : 0.0;
        const bool layer = cell.y > end.y;
        cell.y = layer ? begin.y : cell.y;
        cell.z += layer ? 1.0 : 0.0;
        going = cell.z <= end.z;
    }
    return bound + frame.cell_margin;
}

// A slab's word. Its number takes the place of the last bits of `bound`, which is raised by twice
// what they amount to first; without data it is lower than any texel.
uint slab_word(float bound, uint slab) {
    const float raised = bound + abs(bound) * exp2(float(kMipSlabBits) - 22.0);
    const uint bits = bound < -3.4e38 ? 0xff7fffffu : floatBitsToUint(min(raised, 3.4e38));
    return (bits & ~(kMipSlabs - 1u)) | slab;
}

void main() {
    const TileEntry tile = entries[gl_WorkGroupID.x];
    const uvec2 place = uvec2(tile.tile, tile.tile >> kTileXBits) & ((1u << kTileXBits) - 1u);
    const uint eye_index = tile.tile >> kTileEyeShift;
    const FrameEye eye = frame.eyes[eye_index];
    const float middle = 0.5 * float(kTileSide) - 0.5;
    const vec2 pixel = frame.first_px + (vec2(place * kTileSide) + middle) * frame.px_per_ray;
    const Ray ray = ray_through(eye, pixel, frame.size_px);

    // Beyond near and far the rays meet nothing; one segment to either side is for rounding.
    const float begin = floor(tile.near / frame.step) - 1.0;
    const float end = ceil((tile.far + frame.jitter_mm) / frame.step) + 1.0;
    const float count = max(ceil((end - begin) / float(kMipSlabs)), kLeastSlabSteps);
    const uint slab = gl_LocalInvocationID.x;
    const uint word = slab_word(bound_of(ray, eye, begin + float(slab) * count, count), slab);
    const float bound = uintBitsToFloat(word);
    bounds[slab] = bound;
    barrier();
    uint rank = 0u; // no two are equal: their lowest bits differ
    for (uint other = 0u; other < kMipSlabs; ++other)
        rank += bounds[other] > bound ? 1u : 0u;
    const uint words = slab_words_of(place, eye_index, frame.rays);
    slabs[words + 2u + rank] = word;
    if (slab == 0u) {
        slabs[words] = floatBitsToUint(begin);
        slabs[words + 1u] = floatBitsToUint(count);
    }
}
