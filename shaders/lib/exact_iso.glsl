// Iso-surfaces by the exact integrator (ray_exact.glsl).

// The place at which the cubic takes `iso` on [a, b], on which it is monotone; the nearer end where
// rounding leaves it on one side.
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
            add_piece(a, color.a * vec4(shade_surface(color.rgb, s, at, iso), 1.0));
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
