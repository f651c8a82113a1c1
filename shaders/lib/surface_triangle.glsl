// Triangles as pixels see them. Needs lib/surface.glsl.

layout(scalar, binding = kSurfacePositions) readonly buffer Positions { vec3 positions[]; };
layout(scalar, binding = kSurfaceTriangles) readonly buffer Triangles { uvec3 triangles[]; };

struct Corners {
    vec3 a, b, c; // camera space
};

Corners corners_of(SurfaceMesh mesh, uint triangle) {
    const uvec3 v = triangles[triangle];
    return Corners(mesh.camera_from_mesh * positions[v.x] + mesh.origin,
                   mesh.camera_from_mesh * positions[v.y] + mesh.origin,
                   mesh.camera_from_mesh * positions[v.z] + mesh.origin);
}

// A sum of three that does not depend on their order: triangles that coincide have one depth.
float sum_of(vec3 v) {
    const float low = min(v.x, min(v.y, v.z));
    const float high = max(v.x, max(v.y, v.z));
    const float middle = max(min(v.x, v.y), min(max(v.x, v.y), v.z));
    precise const float sum = (low + high) + middle;
    return sum;
}

// Twice the area of the triangle (origin, a, b). Exactly the opposite of edge(b, a).
float edge(vec2 a, vec2 b) {
    precise const float left = a.x * b.y;
    precise const float right = a.y * b.x;
    return left - right;
}

// Which side of the line from a to b the origin is on; on it, the side of a point just above it (and,
// of a level line, just left of it). So one of two triangles with a common edge has a ray that runs
// through it, and one of those about a corner.
bool is_left(float doubled_area, vec2 a, vec2 b) {
    const vec2 along = b - a;
    return doubled_area > 0.0 ||
           (doubled_area == 0.0 && (along.x < 0.0 || (along.x == 0.0 && along.y > 0.0)));
}

struct Hit {
    bool met;
    bool leaving; // the ray comes from where the triangle is clockwise
    float depth;  // mm, > 0 where met
    vec3 weights; // of the corners; they add up to 1
};

// The hit of a triangle by the ray through a point of the image plane. The camera space is sheared so
// that the ray is its third axis (Woop, Benthin, Wald 2013): a corner moves alike for all triangles
// it belongs to, so that nothing slips through between them.
Hit meet(Corners t, vec2 at) {
    const bool parallel = frame.orthographic != 0u;
    precise const vec2 a = t.a.xy - (parallel ? at : at * t.a.z);
    precise const vec2 b = t.b.xy - (parallel ? at : at * t.b.z);
    precise const vec2 c = t.c.xy - (parallel ? at : at * t.c.z);
    const vec3 areas = vec3(edge(b, c), edge(c, a), edge(a, b));
    const bool left = is_left(areas.x, b, c);
    Hit hit;
    hit.met = left == is_left(areas.y, c, a) && left == is_left(areas.z, a, b);
    hit.leaving = !left; // x is right, y up, z forward: counter-clockwise faces the eye
    const float whole = sum_of(areas);
    const float divisor = whole == 0.0 ? 1.0 : whole;
    precise const vec3 lifted = areas * vec3(t.a.z, t.b.z, t.c.z);
    // Between the corners' also of a sliver: nothing behind a wall comes before it.
    const vec3 z = vec3(t.a.z, t.b.z, t.c.z);
    hit.depth = clamp(sum_of(lifted) / divisor, min(z.x, min(z.y, z.z)), max(z.x, max(z.y, z.z)));
    hit.weights = areas / divisor;
    hit.met = hit.met && whole != 0.0 && hit.depth > 0.0;
    return hit;
}
