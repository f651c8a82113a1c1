// Maximum intensity by the exact integrator (ray_exact.glsl).

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
            c = frame.mip_sign * cell_cubic(w, p, ends.x, ends.y);
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
