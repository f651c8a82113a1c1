#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_vote : require
#if HAS_INT64
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#endif

// Draws the triangles of one mesh into the keys of the pixels whose rays they meet. One invocation a
// triangle; those over many pixels are listed, and drawn with IS_LARGE by one workgroup each. Built
// with HAS_THROUGH for see-through triangles, without for opaque ones. With HAS_CLIPS the pass of
// opaque ones also counts, of all, the labels round both ends of what is kept. Every result is a
// minimum or a sum of integers, so none depends on who comes first.
//
// With HAS_INT64 a key is put in its place in one piece. Else all meshes are drawn twice, by the same
// pipeline, so that a triangle has the same depth to the bit: first depths find their places, then the
// triangles at those depths theirs. The keys are the same.

#include "shaders/shared/surface.h"
#include "shaders/lib/surface.glsl"
#include "shaders/lib/surface_style.glsl"
#include "shaders/lib/surface_triangle.glsl"
#include "shaders/lib/surface_pixels.glsl"
#if IS_LARGE
#include "shaders/lib/tile.glsl"
#endif

layout(local_size_x = 64) in;

#if HAS_INT64
#define Key uint64_t
#else
#define Key uvec2
#endif
layout(scalar, binding = kSurfaceNearest) buffer Nearest { Key nearest[]; };
#if HAS_THROUGH
layout(scalar, binding = kSurfaceThrough) buffer Through { Key through[]; };
#endif
#if HAS_CLIPS
layout(scalar, binding = kSurfaceKept) readonly buffer Kept { vec2 kept[]; };
#if !HAS_THROUGH
layout(scalar, binding = kSurfaceCounts) buffer Counts { int counts[]; };
#endif
#endif
#if IS_LARGE
layout(scalar, binding = kSurfaceWork) readonly buffer Work { SurfaceWork work; };
layout(scalar, binding = kSurfaceLarge) readonly buffer Large { uint large[]; };
#else
layout(scalar, binding = kSurfaceWork) buffer Work { SurfaceWork work; };
layout(scalar, binding = kSurfaceLarge) writeonly buffer Large { uint large[]; };
layout(scalar, binding = kSurfaceChunks) readonly buffer Chunks { uvec2 chunks[]; };
#endif

bool is_drawn_here(float opacity) {
#if HAS_THROUGH
    return opacity > 0.0 && opacity < 1.0;
#else
    return opacity >= 1.0;
#endif
}

// Triangles that count for caps: all of a mesh with outer labels, for its labels add up; else those
// that are shown, of which each label is closed by itself.
bool counts_for_caps(SurfaceMesh mesh, uint pair) {
#if HAS_CLIPS && !HAS_THROUGH
    return (mesh.flags & kSurfaceHasOuterLabels) != 0u ||
           styles[style_of_label(mesh, pair & 0xffffu)].color.a > 0.0;
#else
    return false;
#endif
}

bool is_wanted(SurfaceMesh mesh, uint pair) {
    return is_drawn_here(styles[style_of(mesh, pair, false)].color.a) ||
           is_drawn_here(styles[style_of(mesh, pair, true)].color.a) || counts_for_caps(mesh, pair);
}

#if HAS_THROUGH
// The nearest keys of a pixel in order: a new one takes its place and pushes on what was there.
void put(uint place, uvec2 key) {
    const uint first = place * frame.depth;
#if HAS_INT64
    uint64_t moved = packUint2x32(key);
    for (uint i = 0u; i < frame.depth && moved != packUint2x32(kNothing); ++i)
        moved = max(moved, atomicMin(through[first + i], moved));
#else
    if (work.turn == kSurfaceDepths) {
        uint moved = key.y;
        for (uint i = 0u; i < frame.depth && moved != kNothing.y; ++i)
            moved = max(moved, atomicMin(through[first + i].y, moved));
    } else { // among the places that its depth has
        uint moved = key.x;
        for (uint i = 0u; i < frame.depth; ++i)
            if (through[first + i].y == key.y)
                moved = max(moved, atomicMin(through[first + i].x, moved));
    }
#endif
}
#else
void put(uint place, uvec2 key) {
#if HAS_INT64
    const uint64_t whole = packUint2x32(key);
    if (whole < nearest[place])
        atomicMin(nearest[place], whole);
#else
    if (work.turn == kSurfaceDepths && key.y < nearest[place].y)
        atomicMin(nearest[place].y, key.y);
    if (work.turn == kSurfaceNumbers && key.y == nearest[place].y)
        atomicMin(nearest[place].x, key.x);
#endif
}
#endif

// Draws a pixel of a triangle.
void draw(Corners t, uvec2 pixel, bool inside, uint mesh_number, uint triangle, uint pair) {
    const SurfaceMesh mesh = frame.meshes[mesh_number];
    const Hit hit = meet(t, image_point(vec2(pixel)));
    const bool leaving = hit.leaving != ((mesh.flags & kSurfaceMirrored) != 0u);
    const uint place = place_of(pixel);
    bool seen = inside && hit.met;
#if HAS_CLIPS
    const vec2 stretch = kept[place];
#if !HAS_THROUGH
    const uint count = 2u * (place * frame.mesh_count + mesh_number);
    const int weight = leaving ? weight_of(mesh, pair) : -weight_of(mesh, pair);
    const bool counted =
        seen && counts_for_caps(mesh, pair) && work.turn != kSurfaceNumbers;
    if (counted && hit.depth > stretch.x)
        atomicAdd(counts[count], weight);
    if (counted && hit.depth > stretch.y)
        atomicAdd(counts[count + 1u], weight);
#endif
    seen = seen && hit.depth >= stretch.x && hit.depth <= stretch.y;
#endif
    seen = seen && is_drawn_here(styles[style_of(mesh, pair, leaving)].color.a);
    const uint number = (work.first_number + triangle) | (leaving ? kSurfaceLeaving : 0u) |
                        mesh_number << kSurfaceMeshShift;
#if HAS_THROUGH
#if HAS_INT64
    seen = seen && hit.depth < depth_of(unpackUint2x32(nearest[place]));
#else
    seen = seen && hit.depth < depth_of(nearest[place]);
#endif
#endif
    if (seen)
        put(place, key_of(hit.depth, number));
}

#if IS_LARGE
// A triangle that runs through the plane of the eye: what is before it reaches without end towards
// where its edges cross that plane, and else as far as its corners before it.
void stretch_along(vec3 from, vec3 to, float slack, inout vec2 low, inout vec2 high) {
    if ((from.z > 0.0) == (to.z > 0.0))
        return;
    const vec2 crossing = mix(from.xy, to.xy, from.z / (from.z - to.z));
    low = mix(low, vec2(-kFarAway), lessThan(crossing, vec2(slack)));
    high = mix(high, vec2(kFarAway), greaterThan(crossing, vec2(-slack)));
}

ivec4 pixels_of(Corners t) {
    vec2 low = vec2(kFarAway), high = vec2(-kFarAway);
    const vec3 corners[3] = vec3[3](t.a, t.b, t.c);
    float reach = 0.0;
    for (int i = 0; i < 3; ++i) {
        const bool before = corners[i].z > 0.0 || frame.orthographic != 0u;
        const vec2 p = before ? projected(corners[i]) : vec2(0.0);
        low = before ? min(low, p) : low;
        high = before ? max(high, p) : high;
        const vec3 size = abs(corners[i]);
        reach = max(reach, max(size.x, max(size.y, size.z)));
    }
    if (frame.orthographic == 0u) {
        const float slack = 1e-5 * reach; // a hundred roundings
        stretch_along(t.a, t.b, slack, low, high);
        stretch_along(t.b, t.c, slack, low, high);
        stretch_along(t.c, t.a, slack, low, high);
    }
    return pixels_between(low, high);
}

void main() {
    const uint mesh_number = work.mesh;
    const SurfaceMesh mesh = frame.meshes[mesh_number];
    const uvec2 lane = pixel_in_tile(gl_LocalInvocationID.x);
    for (uint entry = gl_WorkGroupID.x; entry < work.listed; entry += kSurfaceMostGroups) {
        const uint triangle = large[entry];
        const Corners t = corners_of(mesh, triangle);
        const ivec4 pixels = pixels_of(t);
        const uint pair = labels_of(mesh, triangle);
        ivec2 tile = pixels.xy;
        while (pixels.x <= pixels.z && tile.y <= pixels.w) {
            const ivec2 pixel = tile + ivec2(lane);
            const bool inside = pixel.x <= pixels.z && pixel.y <= pixels.w;
            draw(t, uvec2(min(pixel, pixels.zw)), inside, mesh_number, triangle, pair);
            tile.x += 8;
            const bool next_row = tile.x > pixels.z;
            tile = next_row ? ivec2(pixels.x, tile.y + 8) : tile;
        }
    }
}
#else
void main() {
    const uint mesh_number = work.mesh;
    const SurfaceMesh mesh = frame.meshes[mesh_number];
    const uint group = gl_WorkGroupID.x + kSurfaceMostGroups * gl_WorkGroupID.y;
    const uvec2 chunk = work.chunked != 0u ? chunks[group]
                                           : uvec2(group * kSurfaceGroup, work.triangle_count);
    const uint asked = chunk.x + gl_LocalInvocationID.x;
    const uint triangle = min(asked, chunk.y - 1u);
    const Corners t = corners_of(mesh, triangle);
    const uint pair = labels_of(mesh, triangle);
    const vec3 depths = vec3(t.a.z, t.b.z, t.c.z);
    const bool parallel = frame.orthographic != 0u;
    const bool before = parallel || all(greaterThan(depths, vec3(0.0)));
    const bool partly = any(greaterThan(depths, vec3(0.0)));
    // Places of the pool that hold no triangle name one vertex thrice; no ray meets such.
    const bool exists = asked < chunk.y && any(notEqual(t.a, t.b));
    bool wanted = exists && is_wanted(mesh, pair) && partly;
    const vec2 a = projected(t.a), b = projected(t.b), c = projected(t.c);
    const ivec4 pixels = pixels_between(min(a, min(b, c)), max(a, max(b, c)));
    const ivec2 size = pixels.zw - pixels.xy + 1;
    wanted = wanted && (!before || (size.x > 0 && size.y > 0));
    // 4096 square is beyond every small one, and no product of sizes below it overflows.
    const bool small = before && all(lessThan(size, ivec2(4096))) &&
                       uint(size.x * size.y) <= kSurfaceSmallPixels;
    if (wanted && !small) {
        const uint slot = atomicAdd(work.listed, 1u);
        if (slot < kSurfaceMostGroups)
            atomicAdd(work.groups_x, 1u);
        large[slot] = triangle;
    }
    ivec2 pixel = pixels.xy;
    bool going = wanted && small;
    do { // all lanes of a subgroup leave it together: docs/decisions/10-loops-that-lanes-leave.md
        if (going) {
            draw(t, uvec2(pixel), true, mesh_number, triangle, pair);
            pixel.x += 1;
            pixel = pixel.x > pixels.z ? ivec2(pixels.x, pixel.y + 1) : pixel;
            going = pixel.y <= pixels.w;
        }
    } while (subgroupAny(going));
}
#endif
