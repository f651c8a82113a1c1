// Alpha by the exact integrator (ray_exact.glsl).

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

// The premultiplied colour and opacity that a cubic of places in the table shows between distances
// `ends`. `reaches` is the share of the light that passes what lies before it.
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
