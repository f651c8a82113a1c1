// The pieces of a ray between cuts, and the cubic of each (ray_exact.glsl).

// Equally spaced faces, at whole numbers of `origin + t * direction`.
struct Faces {
    vec3 origin, direction;
    vec3 inverse; // 1 / direction; 0 on axes along which the ray does not move
    vec3 never;   // there a distance beyond all others, else 0
    vec3 stride;  // from one face to the next: 1, -1, or 0 there
};

Faces faces_of(vec3 origin, vec3 direction) {
    const vec3 size = abs(direction);
    const bvec3 along = greaterThan(size, vec3(1e-9 * max(size.x, max(size.y, size.z))));
    Faces f;
    f.origin = origin;
    f.direction = direction;
    f.inverse = mix(vec3(0.0), 1.0 / mix(vec3(1.0), direction, along), along);
    f.never = mix(vec3(3e38), vec3(0.0), along);
    f.stride = mix(vec3(0.0), sign(direction), along);
    return f;
}

// The distances of three faces, one an axis.
vec3 distances(Faces f, vec3 face) {
    precise const vec3 t = (face - f.origin) * f.inverse + f.never;
    return t;
}

// The first faces beyond distance t, whatever rounding says of the place at t. On an axis without
// movement: the number of the cell.
vec3 faces_beyond(Faces f, float t) {
    const vec3 place = f.origin + t * f.direction;
    const bvec3 falling = lessThan(f.stride, vec3(0.0));
    vec3 next = mix(floor(place) + abs(f.stride), ceil(place) - 1.0, falling);
    next += f.stride * vec3(lessThanEqual(distances(f, next), vec3(t)));
    next -= f.stride * vec3(greaterThan(distances(f, next - f.stride), vec3(t)));
    return next;
}

float least(vec3 v) { return min(v.x, min(v.y, v.z)); }

// The facts that a march needs about its ray. Distances are taken from where the ray enters the volume's
// box, which keeps all digits for far-away eyes.
struct Walk {
    float anchor; // mm from the ray's start
    Faces cells;
#if HAS_LABELS
    Faces labels; // of label voxels
#endif
    vec3 last_cell;
};

// The state of a march: the next faces on its way.
struct Place {
    vec3 cells;
#if HAS_LABELS
    vec3 labels;
#endif
};

Walk walk_of(Ray ray) {
    Walk w;
    w.anchor = clip_to_box(ray, frame.last).x;
    const vec3 origin = ray.origin + w.anchor * ray.direction;
    w.cells = faces_of(origin, ray.direction);
#if HAS_LABELS
    const vec3 size = vec3(textureSize(labels, 0));
    w.labels = faces_of(size * (frame.label_from_index * origin + frame.label_origin),
                        size * (frame.label_from_index * ray.direction));
#endif
    w.last_cell = max(frame.last - 1.0, vec3(0.0));
    return w;
}

Place place_at(Walk w, float t) {
    Place p;
    p.cells = faces_beyond(w.cells, t);
#if HAS_LABELS
    p.labels = faces_beyond(w.labels, t);
#endif
    return p;
}

// Distance of the next cut.
float next_cut(Walk w, Place p) {
    float t = least(distances(w.cells, p.cells));
#if HAS_LABELS
    t = min(t, least(distances(w.labels, p.labels)));
#endif
    return t;
}

// Past all faces up to distance t.
Place beyond(Walk w, Place p, float t) {
    const vec3 limit = vec3(t);
    p.cells += w.cells.stride * vec3(lessThanEqual(distances(w.cells, p.cells), limit));
#if HAS_LABELS
    p.labels += w.labels.stride * vec3(lessThanEqual(distances(w.labels, p.labels), limit));
#endif
    return p;
}

// The last cut that lies before the next one.
float last_cut(Walk w, Place p) {
    const vec3 t = distances(w.cells, p.cells - w.cells.stride);
    const vec3 passed = mix(t, vec3(-3e38), greaterThan(w.cells.never, vec3(0.0)));
    float last = max(passed.x, max(passed.y, passed.z));
#if HAS_LABELS
    const vec3 l = distances(w.labels, p.labels - w.labels.stride);
    const vec3 label_passed = mix(l, vec3(-3e38), greaterThan(w.labels.never, vec3(0.0)));
    last = max(last, max(label_passed.x, max(label_passed.y, label_passed.z)));
#endif
    return last;
}

// On to the last cut that is not beyond distance `limit`.
void leap(Walk w, float limit, inout float at, inout Place p) {
    const bool far = limit > at;
    const Place there = place_at(w, far ? limit : at);
    at = far ? max(at, last_cut(w, there)) : at;
    p.cells = far ? there.cells : p.cells;
#if HAS_LABELS
    p.labels = far ? there.labels : p.labels;
#endif
}

// Over pieces in which nothing is to be seen, but not beyond `end`.
void leap_over_empty(RaySampler s, Walk w, float end, inout float at, inout Place p) {
    if (kSkip != 0u) {
        const float free = empty_until(s.cells, w.anchor + at) - w.anchor;
        leap(w, min(free - kClearance * frame.step, end), at, p);
    }
}

float cubic_at(vec4 c, float u) { return c.x + u * (c.y + u * (c.z + u * c.w)); }

// The texel along the ray between distances a and b, which lie in one cell: a cubic of u = 0 .. 1.
// NaN throughout where a corner has no data.
vec4 cell_cubic(Walk w, Place p, float a, float b) {
    const vec3 cell =
        clamp(p.cells - max(w.cells.stride, vec3(0.0)), vec3(0.0), w.last_cell);
#if HAS_ATLAS
    vec3 brick;
    const vec4 page = page_at(cell, brick);
    const vec3 h = atlas.image_texture;
    const vec3 low = (cell - brick + page.xyz) * h;
#else
    const vec3 h = frame.texture_from_index;
    const vec3 low = (cell + 0.5) * h;
#endif
    const vec3 high = low + h;
    const float v0 = textureLod(corners, low, 0.0).r;
    const float v1 = textureLod(corners, vec3(high.x, low.y, low.z), 0.0).r;
    const float v2 = textureLod(corners, vec3(low.x, high.y, low.z), 0.0).r;
    const float v3 = textureLod(corners, vec3(high.x, high.y, low.z), 0.0).r;
    const float v4 = textureLod(corners, vec3(low.x, low.y, high.z), 0.0).r;
    const float v5 = textureLod(corners, vec3(high.x, low.y, high.z), 0.0).r;
    const float v6 = textureLod(corners, vec3(low.x, high.y, high.z), 0.0).r;
    const float v7 = textureLod(corners, high, 0.0).r;
    // v = v0 + dot(k, p) + kxy x y + kxz x z + kyz y z + kxyz x y z, along p = from + u * way.
    const vec3 k = vec3(v1, v2, v4) - v0;
    const vec3 mixed = vec3(v3 - v2 - k.x, v5 - v4 - k.x, v6 - v4 - k.y); // xy, xz, yz
    const float all = (v7 - v6 - v5 + v4) - (v3 - v2 - v1 + v0);
    const vec3 offset = w.cells.origin - cell;
    const vec3 from = clamp(offset + a * w.cells.direction, 0.0, 1.0);
    const vec3 way = clamp(offset + b * w.cells.direction, 0.0, 1.0) - from;
    const vec3 at_from = vec3(from.x * from.y, from.x * from.z, from.y * from.z);
    const vec3 cross_term = vec3(from.x * way.y + from.y * way.x, from.x * way.z + from.z * way.x,
                                 from.y * way.z + from.z * way.y);
    const vec3 at_way = vec3(way.x * way.y, way.x * way.z, way.y * way.z);
    const vec4 cubic = vec4(v0 + dot(k, from) + dot(mixed, at_from) + all * at_from.x * from.z,
                            dot(k, way) + dot(mixed, cross_term) +
                                all * (at_from.x * way.z + from.z * cross_term.x),
                            dot(mixed, at_way) + all * (way.z * cross_term.x + from.z * at_way.x),
                            all * at_way.x * way.z);
#if HAS_ATLAS
    return page.x < kAbsentBrick ? vec4(page.w, 0.0, 0.0, 0.0) : cubic;
#else
    return cubic;
#endif
}

// Least and largest control value of the cubic in Bernstein form: its values on [0, 1] lie between.
vec2 hull(vec4 c) {
    const float b1 = c.x + c.y * (1.0 / 3.0);
    const float b2 = c.x + (2.0 * c.y + c.z) * (1.0 / 3.0);
    const float b3 = cubic_at(c, 1.0);
    return vec2(min(min(c.x, b1), min(b2, b3)), max(max(c.x, b1), max(b2, b3)));
}

// The places on (0, 1) at which the cubic turns, in order; 1 for "nowhere".
vec2 turning_points(vec4 c) {
    const float a = 3.0 * c.w, b = 2.0 * c.z;
    const float discriminant = b * b - 4.0 * a * c.y;
    // The form that does not cancel (Press et al., Numerical Recipes, 5.6).
    const float root = sqrt(max(discriminant, 0.0));
    const float q = -0.5 * (b + (b < 0.0 ? -root : root));
    float first = a != 0.0 ? q / a : 1.0;
    float second = q != 0.0 ? c.y / q : 1.0;
    first = discriminant >= 0.0 && first > 0.0 && first < 1.0 ? first : 1.0;
    second = discriminant >= 0.0 && second > 0.0 && second < 1.0 ? second : 1.0;
    return vec2(min(first, second), max(first, second));
}

// Nothing seen changes nothing, not even the carry.
void add_piece(inout Accumulator a, vec4 seen) {
    Accumulator more = a;
    add(more, (1.0 - a.sum.a) * seen);
    a.sum = seen.a > 0.0 ? more.sum : a.sum;
    a.carry = seen.a > 0.0 ? more.carry : a.carry;
}
