#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Lists the tiles of a picture in which rays meet something, and between which distances: one
// invocation a tile marches the ray through its middle, in steps that keep the rays of the whole
// tile within empty cells. The order of the list says nothing: every tile writes its own pixels.

#include "shaders/shared/tiles.h"
#include "shaders/lib/rays.glsl"

layout(constant_id = 0) const uint kList = kListVisible;
layout(constant_id = 1) const uint kWriteSpans = 0u;

layout(local_size_x = 64) in;

layout(scalar, binding = kTileFrame) uniform FrameBlock { Frame frame; };
layout(binding = kTileCells) uniform sampler3D cells;
layout(scalar, binding = kTileRange) uniform RangeBlock { TileRange range; };
layout(scalar, binding = kTileGroups) buffer Groups {
    uint tile_count;
    uint rows[2];
    uint quarter_count;
};
layout(scalar, binding = kTileEntries) writeonly buffer Entries { TileEntry entries[]; };
layout(scalar, binding = kTileSpans) writeonly buffer Spans { vec2 spans[]; };

#include "shaders/lib/skipping.glsl"

// A distance within which every point, on any axis, is in empty space, in samples: to the faces of
// the empty cells about p, or to the volume where p is outside.
float free_about(Ray ray, CellRay c, float t) {
    const vec3 p = ray.origin + t * ray.direction;
    const vec3 cell = cell_at(c, t);
    const float d = cell_entry(cell);
    const vec3 low = cell - d + 1.0;
    const vec3 high = cell + d;
    const vec3 below = mix(p - low * frame.cell_side, vec3(1e30), lessThanEqual(low, vec3(0.0)));
    const vec3 above = mix(high * frame.cell_side - p, vec3(1e30),
                           greaterThan(high, frame.cell_last));
    const vec3 within = min(below, above);
    const vec3 outside = max(-p, p - frame.last);
    const float to_volume = max(outside.x, max(outside.y, outside.z));
    return max(d > 0.0 ? min(within.x, min(within.y, within.z)) : 0.0, to_volume);
}

void main() {
    const uvec2 count = (frame.rays + kTileSide - 1u) / kTileSide;
    const uvec2 tile = range.first + gl_GlobalInvocationID.xy;
    const bool here = all(lessThan(tile, min(count, range.end)));
    const uint eye_index = gl_GlobalInvocationID.z;
    const FrameEye eye = frame.eyes[eye_index];
    const float middle = 0.5 * float(kTileSide) - 0.5;
    const vec2 pixel = frame.first_px + (vec2(tile * kTileSide) + middle) * frame.px_per_ray;
    const Ray ray = ray_through(eye, pixel, frame.size_px);
    const float widest = eye.spread.x + eye.spread.y * eye.reach;
    Ray widened = ray;
    widened.origin += widest;
    vec2 t = clip_to_box(widened, frame.last + 2.0 * widest);
    bool hit = (t.x < t.y || kList == kListAll) && here;
    if (kList == kListVisible) {
        const CellRay c = cell_ray(ray);
        const vec3 size = abs(ray.direction);
        const float speed = max(size.x, max(size.y, size.z)); // samples per mm
        const float least = 0.25 * frame.cell_side / speed;   // mm
        bool going = hit;
        while (going) {
            const float room = free_about(ray, c, t.x) - eye.spread.x - eye.spread.y * t.x;
            const float step = room / (speed + eye.spread.y);
            going = step > least;
            t.x += going ? step : 0.0;
            going = going && t.x < t.y;
        }
        hit = hit && t.x < t.y;
        going = hit;
        while (going) {
            const float room = free_about(ray, c, t.y) - eye.spread.x - eye.spread.y * t.y;
            const float step = room / speed;
            going = step > least;
            t.y -= going ? step : 0.0;
            going = going && t.x < t.y;
        }
        hit = hit && t.x < t.y;
    }
    if (hit) {
        const uint slot = atomicAdd(tile_count, 1u);
        atomicMax(quarter_count, slot / 4u + 1u);
        entries[slot] = TileEntry(tile.x | tile.y << kTileXBits | eye_index << kTileEyeShift, t.x,
                                  t.y, 0u);
    }
    if (kWriteSpans != 0u && here)
        spans[tile_number(tile, eye_index, count)] = hit ? t : vec2(-1.0);
}
