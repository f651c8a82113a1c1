// The exact integrator: rays cut at the faces of cells, between which the trilinear field along the
// ray is one cubic. Included by ray_cast.comp where IS_EXACT. Its twin in double is
// engine/reference/exact.h.
//
// Every cut is a function of the whole number of its face and of the ray alone, never a sum of
// steps: wherever a march starts or leaps to, it meets the same cuts, to the bit.
//
// A march has an inner loop to the next piece that may matter to any lane of the subgroup, and does
// what is dear after it. All lanes leave a loop together and keep what they have found by selects:
// llvmpipe of Mesa 22.3 mixes up the iterations of values that are used after a loop which lanes
// leave at different times.

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

// What a march needs to know of its ray. Distances are taken from where the ray enters the volume's
// box, which keeps all digits for far-away eyes.
struct Walk {
    float anchor; // mm from the ray's start
    Faces cells;
#if HAS_LABELS
    Faces labels; // of label voxels
#endif
    vec3 last_cell;
};

// Where a march is: the next faces on its way.
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

// Where on (0, 1) the cubic turns, in order; 1 for "nowhere".
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

#if !IS_ISO

// ---- alpha ----

// A place in the transfer table, in entries, to 1/256 of one: what samplers with weights of 8 bits
// resolve.
struct TablePoint {
    float place;
    vec4 entry;    // rgb, tau per mm
    vec4 integral; // of (rgb * tau, tau), in entries
};

TablePoint table_point(float place) {
    const float n = float(kTableEntries);
    TablePoint p;
    p.place = floor(place * 256.0 + 0.5) * (1.0 / 256.0);
    const float inside = clamp(p.place, 0.0, n - 1.0);
    const float x = (inside + 0.5) * (1.0 / n);
    p.entry = textureLod(smooth_table, vec2(x, float(kTableRowTau)), 0.0);
    const vec4 end = p.place < 0.0 ? frame.table_first : frame.table_last;
    p.integral = textureLod(smooth_table, vec2(x, float(kTableRowIntegral)), 0.0) +
                 (p.place - inside) * end;
    return p;
}

vec4 weighted(vec4 entry) { return vec4(entry.rgb * entry.a, entry.a); }

struct TableSpan {
    vec3 color;
    float opacity;
    float seen_at; // the mean share of the way at which the light arises that leaves it
    float error;   // what opacity * color may be off by
};

// The smaller of two changes of one sign, else 0.
vec3 least_change(vec3 a, vec3 b) {
    const vec3 least = sign(a) * min(abs(a), abs(b));
    return mix(vec3(0.0), least, greaterThan(a * b, vec3(0.0)));
}

float largest(vec3 v) {
    const vec3 size = abs(v);
    return max(size.x, max(size.y, size.z));
}

// Colour and opacity of a piece of the ray between two places of the table; engine/reference/
// table_span.h says how.
TableSpan table_span(TablePoint a, TablePoint b, float bend, float length_mm) {
    const float width = b.place - a.place;
    const bool narrow = abs(width) < kNarrowEntries;
    const vec4 at_a = weighted(a.entry), at_b = weighted(b.entry);
    const vec3 change = b.entry.rgb - a.entry.rgb;
    const vec4 straight =
        vec4((2.0 * (at_a.rgb + at_b.rgb) + a.entry.rgb * b.entry.a + b.entry.rgb * a.entry.a) *
                 (1.0 / 6.0),
             0.5 * (a.entry.a + b.entry.a));
    vec4 mean = narrow ? straight : (b.integral - a.integral) / (narrow ? 1.0 : width);
    const float off = min(abs(mean.a - straight.a) / max(mean.a, 1e-30), 1.0);
    const float kappa = clamp(width == 0.0 ? 0.0 : 4.0 * bend / width, -1.0, 1.0);
    mean = max(mean + (kappa * (1.0 / 6.0)) * (at_b - at_a), 0.0);
    const float depth = mean.a * length_mm;
    const float slope = 0.5 * (b.entry.a - a.entry.a) / max(straight.a, 1e-30);
    const float k1 = 0.5 - 0.1 * slope * slope;
    const float k2 = slope * ((3.0 / 7.0) * slope * slope - 1.0) * (1.0 / 6.0);
    TableSpan span;
    span.opacity = hidden_by(depth);
    // coth(z) - 1 / z, of which the difference cancels for small z; the series leaves out 2e-5 at 1.
    const float z = 0.5 * depth, zz = z * z;
    const bool thin = z < 1.0;
    const float r1 = thin ? z * (1.0 / 3.0 -
                                 zz * (1.0 / 45.0 - zz * (2.0 / 945.0 - zz * (1.0 / 4725.0))))
                          : (2.0 - span.opacity) / span.opacity - 1.0 / z;
    const float r2 = thin ? zz * (1.0 / 15.0 - zz * (2.0 / 315.0 - zz * (1.0 / 1575.0)))
                          : 1.0 - 3.0 * r1 / z;
    const float ahead = k2 * r2 - k1 * r1;
    const vec3 middle = mean.rgb / max(mean.a, 1e-30);
    const float middle_off =
        largest(middle - 0.5 * (a.entry.rgb + b.entry.rgb) - (slope * (1.0 / 6.0)) * change);
    const vec3 steady = least_change((middle - a.entry.rgb) / (0.5 + slope * (1.0 / 6.0)),
                                     (b.entry.rgb - middle) / (0.5 - slope * (1.0 / 6.0)));
    span.color = clamp(middle + ahead * steady, 0.0, 1.0);
    span.seen_at = clamp(0.5 + slope * (1.0 / 6.0) + ahead, 0.0, 1.0);
    span.error = span.opacity * ((middle_off + 0.5 * off * largest(change)) * r1 +
                                 0.05 * largest(change) *
                                     min(1.0, depth * depth * depth * (1.0 / 840.0)));
    return span;
}

// Whether any entry of the table that the cubic, in entries, comes by has opacity. Places are rounded
// to 1/256.
bool may_show(vec4 c) {
    const float n = float(kTableEntries);
    const vec2 range = clamp(hull(c) + vec2(-1.0, 1.0) / 128.0, 0.0, n - 1.0);
    const float row = float(kTableRowVisible);
    return textureLod(table, vec2((ceil(range.y) + 0.5) / n, row), 0.0).r >
           textureLod(table, vec2((floor(range.x) + 0.5) / n, row), 0.0).g;
}

// What a cubic of places in the table shows between distances `ends`: premultiplied colour, opacity.
// `reaches` is the share of the light that passes what lies before it.
vec4 piece_color(RaySampler s, Walk w, vec4 c, vec2 ends, float reaches, bool counts) {
    const float bend = max(abs(2.0 * c.z), abs(2.0 * c.z + 6.0 * c.w));
    // Shading turns within a cell however straight the values are.
    const float least = kShaded != 0u ? ceil(0.25 * frame.sub_steps) : 1.0;
    const float n =
        counts ? clamp(ceil(sqrt(bend * frame.sub_steps_per_bend)), least, frame.sub_steps) : 1.0;
    const float part = 1.0 / n;
    const float opaque = 1.0 - max(frame.min_transmittance, kLeastTransmittance) / reaches;
#if HAS_LABELS
    const vec4 tint = label_tint(s, w.anchor + 0.5 * (ends.x + ends.y));
    counts = counts && tint.a >= 0.0;
#endif
    vec4 sum = vec4(0.0);
    // Sub-step [i, i + width] of n, halved where its error is too large.
    float i = 0.0, width = 1.0;
    TablePoint before = table_point(c.x);
    bool more = counts;
    do {
        const float next = min(i + width, n);
        const TablePoint now = table_point(cubic_at(c, next * part));
        const float share = (next - i) * part;
        const float u = (i + 0.5 * (next - i)) * part;
        const float above = (2.0 * c.z + 6.0 * c.w * u) * (-0.125 * share * share);
        TableSpan span = table_span(before, now, above, (ends.y - ends.x) * share);
        const float error = reaches * (1.0 - sum.a) * span.error;
        const bool taken = more && (error <= frame.span_tolerance || width <= kLeastSpan);
#if HAS_LABELS
        span.color = mix(span.color, tint.rgb, max(tint.a, 0.0));
#endif
        if (kShaded != 0u && subgroupAny(taken))
            span.color = shade(span.color, s,
                               w.anchor + mix(ends.x, ends.y, i * part + share * span.seen_at));
        const float seen = taken ? (1.0 - sum.a) * span.opacity : 0.0;
        sum += seen * vec4(span.color, 1.0);
        const float wider = error < frame.span_tolerance * (1.0 / 16.0) ? 2.0 : 1.0;
        const float finer = error > 8.0 * frame.span_tolerance ? 0.25 : 0.5;
        width = min(width * (taken ? wider : finer), 1.0);
        i = taken ? next : i;
        before.place = taken ? now.place : before.place;
        before.entry = mix(before.entry, now.entry, bvec4(taken));
        before.integral = mix(before.integral, now.integral, bvec4(taken));
        more = more && i < n && sum.a < opaque;
    } while (subgroupAny(more));
    return counts ? sum : vec4(0.0);
}

Marched march_alpha_exact(RaySampler s, vec2 t, vec2 span, bool inside) {
    Accumulator a = Accumulator(vec4(0.0), vec4(0.0));
    const float opaque = 1.0 - frame.min_transmittance;
    const float entries = float(kTableEntries);
    const Walk w = walk_of(s.ray);
    vec2 ends = vec2(t.x - w.anchor);
    const float end = t.y - w.anchor;
    Place p = place_at(w, ends.x);
    leap(w, min(span.x - w.anchor - kClearance * frame.step, end), ends.y, p);
    const float limit = min(end, span.y - w.anchor); // nothing is seen beyond
    bool going = inside && ends.y < limit;
    do {
        vec4 c;
        bool counts;
        do {
            leap_over_empty(s, w, end, ends.y, p);
            ends = vec2(ends.y, max(ends.y, min(next_cut(w, p), end)));
            c = cell_cubic(w, p, ends.x, ends.y);
            if (kCount != 0u && going) // a piece counts as one sample
                samples_taken += 1u;
            counts = going && ends.x < end && is_data(c.x);
            c *= frame.table_scale * entries;
            c.x += frame.table_bias * entries - 0.5;
            counts = counts && may_show(c);
            p = beyond(w, p, ends.y);
            going = going && ends.y < limit;
        } while (!subgroupAny(counts) && subgroupAny(going));
        add_piece(a, piece_color(s, w, c, ends, 1.0 - a.sum.a, counts));
        going = going && a.sum.a <= opaque;
    } while (subgroupAny(going));
    return Marched(inside ? a.sum : vec4(0.0), kNaN, kNaN);
}

// ---- maximum intensity ----

Marched march_mip_exact(RaySampler s, vec2 t, vec2 span, bool inside) {
    const Walk w = walk_of(s.ray);
    vec2 ends = vec2(t.x - w.anchor);
    const float end = t.y - w.anchor;
    Place p = place_at(w, ends.x);
    float maximum = kNoTexel;
    bool going = inside;
    do {
        vec4 c;
        bool counts;
        do {
            if (kSkip != 0u) { // over a cell that holds nothing higher
                const vec3 cell = cell_at(s.cells, w.anchor + ends.y);
                const float leaves = cell_exit(s.cells, cell, 1.0) - w.anchor;
                const bool passed = cell_entry(cell) + frame.cell_margin <= maximum;
                leap(w, passed ? min(leaves - kClearance * frame.step, end) : -3e38, ends.y, p);
            }
            ends = vec2(ends.y, max(ends.y, min(next_cut(w, p), end)));
            c = cell_cubic(w, p, ends.x, ends.y);
            if (kCount != 0u && going) // a piece counts as one sample
                samples_taken += 1u;
            counts = going && ends.x < end && is_data(c.x) && hull(c).y > maximum;
            p = beyond(w, p, ends.y);
            going = going && ends.y < end;
        } while (!subgroupAny(counts) && subgroupAny(going));
        const vec2 turns = turning_points(c);
        const float most = max(max(c.x, cubic_at(c, 1.0)),
                               max(cubic_at(c, turns.x), cubic_at(c, turns.y)));
        counts = counts && most > maximum;
#if HAS_LABELS
        counts = counts && label_tint(s, w.anchor + 0.5 * (ends.x + ends.y)).a >= 0.0;
#endif
        maximum = counts ? most : maximum;
    } while (subgroupAny(going));
    highest_texel = inside ? maximum : kNoTexel;
    return mip_of(highest_texel);
}

#else

// ---- iso-surfaces ----

// Where the cubic takes `iso` on [a, b], on which it is monotone; the nearer end where rounding
// leaves it on one side.
float root_between(vec4 c, float iso, float a, float b) {
    const float at_a = cubic_at(c, a) - iso;
    const float at_b = cubic_at(c, b) - iso;
    const bool crossed = (at_a < 0.0) != (at_b < 0.0);
    const float nearer = abs(at_a) <= abs(at_b) ? a : b;
    float u = crossed ? clamp(a - at_a * (b - a) / (at_b - at_a), a, b) : nearer;
    bool moving = crossed;
    int i = 0;
    do { // Newton's steps, halving where one would leave the bracket
        const float f = cubic_at(c, u) - iso;
        const bool low = (f < 0.0) == (at_a < 0.0);
        a = low ? u : a;
        b = low ? b : u;
        const float guess = u - f / (c.y + u * (2.0 * c.z + u * 3.0 * c.w));
        const float next = guess > a && guess < b ? guess : 0.5 * (a + b);
        moving = moving && f != 0.0 && next != u;
        u = moving ? next : u;
        i += 1;
    } while (subgroupAny(moving) && i < 30);
    return u;
}

Marched march_iso_exact(RaySampler s, vec2 t, vec2 span, bool inside) {
    Accumulator a = Accumulator(vec4(0.0), vec4(0.0));
    Marched result = Marched(vec4(0.0), kNaN, kNaN);
    const float opaque = 1.0 - frame.min_transmittance;
    const Walk w = walk_of(s.ray);
    vec2 ends = vec2(t.x - w.anchor);
    const float end = t.y - w.anchor;
    Place p = place_at(w, ends.x);
    leap(w, min(span.x - w.anchor - kClearance * frame.step, end), ends.y, p);
    const float limit = min(end, span.y - w.anchor); // nothing is met beyond
    // How many iso-values the field has reached: carried from piece to piece, so that a surface on
    // a face is met once. -1 at the start and behind missing data.
    int level = -1;
    bool going = inside && ends.y < limit;
    do {
        vec4 c;
        bool crossed;
        do {
            leap_over_empty(s, w, end, ends.y, p);
            ends = vec2(ends.y, max(ends.y, min(next_cut(w, p), end)));
            c = cell_cubic(w, p, ends.x, ends.y);
            if (kCount != 0u && going) // a piece counts as one sample
                samples_taken += 1u;
            const vec2 range = hull(c);
            level = level < 0 ? level_of(c.x) : level;
            crossed = going && ends.x < end && (level_of(range.x) != level || level_of(range.y) != level);
            if (kHasNoData != 0u) {
                crossed = crossed && is_data(c.x);
                level = is_data(c.x) ? level : -1;
            }
            p = beyond(w, p, ends.y);
            going = going && ends.y < limit;
        } while (!subgroupAny(crossed) && subgroupAny(going));
        // The cubic rises or falls throughout between the turning points.
        const vec2 turns = turning_points(c);
        const ivec3 levels = ivec3(level_of(cubic_at(c, turns.x)), level_of(cubic_at(c, turns.y)),
                                   level_of(cubic_at(c, 1.0)));
        int part = 0;
        bool more = crossed;
        do {
            part = part <= 0 && levels.x != level ? 0 : part <= 1 && levels.y != level ? 1 : 2;
            const int goal = part == 0 ? levels.x : part == 1 ? levels.y : levels.z;
            const bool hit = more && goal != level;
            const int direction = goal > level ? 1 : -1;
            const int which = direction > 0 ? level : level - 1;
            const uint i = kIsoCount == 1u ? 0u : uint(clamp(which, 0, int(kIsoCount) - 1));
            const float iso = frame.iso_texels[i];
            const float u = root_between(c, iso, part == 0 ? 0.0 : part == 1 ? turns.x : turns.y,
                                         part == 0 ? turns.x : part == 1 ? turns.y : 1.0);
            const float at = w.anchor + mix(ends.x, ends.y, u);
            vec4 color = frame.iso_colors[i];
#if HAS_LABELS
            const vec4 tint = label_tint(s, w.anchor + 0.5 * (ends.x + ends.y));
            color.rgb = mix(color.rgb, tint.rgb, max(tint.a, 0.0));
            color.a = tint.a < 0.0 ? 0.0 : color.a;
#endif
            color.a = hit ? color.a : 0.0;
            add_piece(a, color.a * vec4(shade(color.rgb, s, at), 1.0));
            const bool first = color.a > 0.0 && isnan(result.depth);
            result.depth = first ? at : result.depth;
            result.value = first ? iso * frame.value_scale + frame.value_bias : result.value;
            level += hit ? direction : 0;
            more = hit && a.sum.a <= opaque &&
                   (level != goal || level != levels.z || (part < 1 && level != levels.y));
        } while (subgroupAny(more));
        going = going && a.sum.a <= opaque;
    } while (subgroupAny(going));
    result.color = a.sum;
    return result;
}

#endif
