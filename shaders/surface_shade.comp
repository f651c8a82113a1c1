#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Puts what is seen of one mesh's triangles, style and angle, in their place in the keys. One
// invocation a pixel. Keys keep their order: depths are not changed.

#include "shaders/shared/surface.h"
#include "shaders/lib/surface.glsl"
#include "shaders/lib/surface_style.glsl"
#include "shaders/lib/surface_triangle.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kSurfaceNearest) buffer Nearest { uvec2 nearest[]; };
#if HAS_THROUGH
layout(scalar, binding = kSurfaceThrough) buffer Through { uvec2 through[]; };
#endif
layout(scalar, binding = kSurfaceNormals) readonly buffer Normals { vec3 normals[]; };
layout(scalar, binding = kSurfaceWork) readonly buffer Work { SurfaceWork work; };

uint triangle_of(uint low) { return (low & (kSurfaceLeaving - 1u)) - work.first_number; }

// Belongs to the arrays that are shaded now.
bool is_of(uint low) {
    return (low & kSurfaceShaded) == 0u && low >> kSurfaceMeshShift == work.mesh &&
           triangle_of(low) < work.triangle_count;
}

uint seen_of(uint low, vec2 at, SurfaceMesh mesh) {
    const uint triangle = triangle_of(low);
    const Corners t = corners_of(mesh, triangle);
    const Hit hit = meet(t, at);
    const bool smooth_normals = (mesh.flags & kSurfaceHasNormals) != 0u;
    const uvec3 v = smooth_normals ? triangles[triangle] : uvec3(0u);
    const vec3 blended = mat3(normals[v.x], normals[v.y], normals[v.z]) * hit.weights;
    const vec3 flat_normal = cross(t.b - t.a, t.c - t.a);
    const vec3 smooth_normal = mesh.covector_from_mesh * blended;
    const bool use_smooth = smooth_normals && dot(smooth_normal, smooth_normal) > 0.0;
    const vec3 normal = use_smooth ? smooth_normal : flat_normal;
    const float size = length(normal);
    const float facing = abs(dot(normal, ray_direction(at))) / (size > 0.0 ? size : 1.0);
    const bool leaving = (low & kSurfaceLeaving) != 0u;
    return shaded(style_of(mesh, labels_of(mesh, triangle), leaving), facing);
}

void main() {
    const uvec2 pixel = pixel_of(uvec2(gl_GlobalInvocationID.x, gl_WorkGroupID.y));
    if (!is_drawn(pixel))
        return;
    const SurfaceMesh mesh = frame.meshes[work.mesh];
    const uint place = place_of(pixel);
    const vec2 at = image_point(vec2(pixel));
    const uvec2 opaque = nearest[place];
    if (is_of(low_of(opaque)))
        nearest[place] = key_of(depth_of(opaque), seen_of(low_of(opaque), at, mesh));
#if HAS_THROUGH
    uint i = place * frame.depth;
    const uint end = i + frame.depth;
    bool going = i < end;
    while (going) {
        const uvec2 key = through[i];
        if (is_of(low_of(key)))
            through[i] = key_of(depth_of(key), seen_of(low_of(key), at, mesh));
        i += 1u;
        going = i < end && key != kNothing;
    }
#endif
}
