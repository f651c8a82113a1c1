// Rays through pixels and the stretch of them that lies inside the volume.

struct Ray {
    vec3 origin;    // index
    vec3 direction; // index per mm
};

// The ray through the centre of `pixel` (fractional pixels allowed).
Ray ray_through(FrameEye eye, vec2 pixel, uvec2 size_px) {
    const vec2 uv = (pixel + 0.5) / vec2(size_px);
    const vec2 a = mix(eye.bounds.xw, eye.bounds.yz, uv);
    const vec3 across = a.x * eye.right + a.y * eye.up;
    const bool parallel = eye.projection == kOrthographic;
    Ray ray;
    ray.origin = parallel ? eye.eye + across : eye.eye;
    ray.direction = parallel ? eye.forward
                             : (eye.forward + across) * (1.0 / sqrt(1.0 + dot(a, a)));
    return ray;
}

// The distances between which the ray is inside [0, last] and at or beyond its start;
// x > y where it never is. A direction component that is negligible beside the largest one counts
// as zero: no division by it takes place.
vec2 clip_to_box(Ray ray, vec3 last) {
    const vec3 size = abs(ray.direction);
    const float negligible = 1e-9 * max(size.x, max(size.y, size.z));
    const bvec3 along = greaterThan(size, vec3(negligible));
    const vec3 inverse = 1.0 / mix(vec3(1.0), ray.direction, along);
    const vec3 a = -ray.origin * inverse;
    const vec3 b = (last - ray.origin) * inverse;
    const bvec3 within = bvec3(ivec3(greaterThanEqual(ray.origin, vec3(0.0))) &
                               ivec3(lessThanEqual(ray.origin, last)));
    const vec3 always = mix(vec3(1e30), vec3(-1e30), within); // for rays parallel to a face
    const vec3 near = mix(always, min(a, b), along);
    const vec3 far = mix(-always, max(a, b), along);
    return vec2(max(max(near.x, near.y), max(near.z, 0.0)), min(far.x, min(far.y, far.z)));
}

// Cuts a stretch of the ray by one half space.
vec2 clip_to_plane(Ray ray, vec2 t, ClipPlaneIndex plane) {
    const float at_start = dot(plane.normal, ray.origin) + plane.offset;
    const float rate = dot(plane.normal, ray.direction);
    const float crossing = -at_start / (rate == 0.0 ? 1.0 : rate);
    if (rate > 0.0)
        t.x = max(t.x, crossing);
    else if (rate < 0.0)
        t.y = min(t.y, crossing);
    else if (at_start < 0.0)
        t = vec2(1.0, 0.0);
    return t;
}

// How far before its start a ray's lattice begins, in steps; as jitter_share() of engine/scene.
float jitter_share(uint seed, uvec2 pixel, uint eye) {
    uint h = seed * 0x27d4eb2fu ^ pixel.x * 0x9e3779b1u ^ pixel.y * 0x85ebca77u ^
             eye * 0xc2b2ae3du;
    for (int i = 0; i < 2; ++i) {
        h = (h ^ h >> 16) * 0x85ebca6bu;
        h = (h ^ h >> 13) * 0xc2b2ae35u;
        h ^= h >> 16;
    }
    return float(h >> 8) * (1.0 / 16777216.0);
}

#include "shaders/lib/tile.glsl"
