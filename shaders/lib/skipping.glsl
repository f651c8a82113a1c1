// Empty space along a ray: macro-cells in which nothing can be seen. Needs `frame` and the sampler
// `cells`, see engine/render/cell_map.h. Whatever a lookup says, only segments are left out that lie
// within empty cells by more than rounding; so skipping never changes a picture.

// When a ray crosses the faces of cells.
struct CellRay {
    vec3 origin, direction; // in cells, and cells per mm
    vec3 mm_per_cell;       // along each axis; 0 where the ray does not move
    vec3 start_mm;          // distance of face 0 on each axis; huge where the ray does not move
    vec3 rising;            // 1 where the index grows along the ray, else 0
};

CellRay cell_ray(Ray ray) {
    CellRay c;
    const vec3 per_sample = vec3(1.0 / frame.cell_side);
    c.origin = ray.origin * per_sample;
    c.direction = ray.direction * per_sample;
    const vec3 size = abs(ray.direction);
    const bvec3 along = greaterThan(size, vec3(1e-6 * max(size.x, max(size.y, size.z))));
    const vec3 inverse = 1.0 / mix(vec3(1.0), c.direction, along);
    c.mm_per_cell = mix(vec3(0.0), inverse, along);
    c.start_mm = mix(vec3(1e30), -c.origin * inverse, along);
    c.rising = mix(vec3(0.0), vec3(1.0), greaterThan(c.direction, vec3(0.0)));
    return c;
}

// The cell of the point at distance t.
vec3 cell_at(CellRay c, float t) {
    return clamp(floor(c.origin + t * c.direction), vec3(0.0), frame.cell_last);
}

// The entry that is stored for a cell.
float cell_entry(vec3 cell) {
    return textureLod(cells, (cell + 0.5) * frame.cell_texture, 0.0).r;
}

// The distance at which the ray leaves the box of cells less than d cells away; behind for d = 0.
float cell_exit(CellRay c, vec3 cell, float d) {
    const vec3 face = cell + mix(vec3(1.0 - d), vec3(d), c.rising);
    const vec3 t = face * c.mm_per_cell + c.start_mm;
    return min(t.x, min(t.y, t.z));
}

// How far from t the ray meets nothing; not beyond t where its cell is occupied.
float empty_until(CellRay c, float t) {
    const vec3 cell = cell_at(c, t);
    return cell_exit(c, cell, cell_entry(cell));
}

// Lattice numbers are kept this share of a step clear of the face of an occupied cell. A distance t
// is a few units in the last place off, and t is less than 2^13 steps.
const float kClearance = 0.01;
