// The march of each mode. Included by ray_cast.comp.

struct Marched {
    vec4 color;  // premultiplied; a is what the ray hides
    float value; // MIP: the maximum; iso: the value of the first hit; else NaN
    float depth; // iso: distance of the first hit in mm; else NaN
};

// A sum with its rounding carried along (Kahan), so that 10^4 faint samples keep their digits.
struct Accumulator {
    vec4 sum;
    vec4 carry;
};

void add(inout Accumulator a, vec4 term) {
    precise const vec4 y = term - a.carry;
    precise const vec4 t = a.sum + y;
    precise const vec4 carry = (t - a.sum) - y;
    a.carry = carry;
    a.sum = t;
}

void composite(inout Accumulator a, vec3 color, float alpha) {
    add(a, ((1.0 - a.sum.a) * alpha) * vec4(color, 1.0));
}

// 1 - exp(-x) without cancellation.
float hidden_by(float optical_depth) {
    const float x = optical_depth;
    return x < 0.01 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0))) : 1.0 - exp(-x);
}

bool is_data(float value) { return kHasNoData == 0u || value == value; }

// Segment k of the lattice, cut to [t.x, t.y].
vec2 segment(float k, vec2 t) {
    return vec2(max(k * frame.step, t.x), min((k + 1.0) * frame.step, t.y));
}

// ---- alpha ----

// Colour and opacity of one segment; `whole` says that it is one full step long. `x_in` is the table
// position at its start (preintegrated only), replaced by the one at its end.
vec4 segment_color(RaySampler s, vec2 ends, bool whole, inout float x_in) {
    const float middle = 0.5 * (ends.x + ends.y);
    const float length_mm = max(ends.y - ends.x, 0.0);
    vec4 entry;
    bool valid;
    if (kPreintegrated != 0u) {
        const float x_out = table_x(value_at(s, ends.y));
        const float mean_x = 0.5 * (x_in + x_out);
        const float dx = x_out - x_in;
        valid = is_data(x_in) && is_data(x_out);
        const bool narrow = abs(dx) * (float(kTableEntries) - 1.0) < 1.0;
        const vec4 point = table_entry(mean_x, kTableRowTau);
        const vec4 mean = (table_integral(x_out) - table_integral(x_in)) / (narrow ? 1.0 : dx);
        entry.rgb = narrow ? point.rgb : mean.rgb / max(mean.a, 1e-30);
        entry.a = hidden_by(max(narrow ? point.a : mean.a, 0.0) * length_mm);
        x_in = x_out;
    } else {
        const float value = value_at(s, middle);
        valid = is_data(value);
        const float x = table_x(value);
        if (whole) {
            entry = table_entry(x, kTableRowStep);
        } else {
            entry = table_entry(x, kTableRowTau);
            entry.a = hidden_by(entry.a * length_mm);
        }
    }
    if (kHasNoData != 0u)
        entry.a = valid ? entry.a : 0.0;
#if HAS_LABELS
    const vec4 tint = label_tint(s, middle);
    entry.rgb = mix(entry.rgb, tint.rgb, max(tint.a, 0.0));
    entry.a = tint.a < 0.0 ? 0.0 : entry.a;
#endif
    return entry;
}

void add_segment(inout Accumulator a, RaySampler s, vec2 ends, bool whole, inout float x_in) {
    const vec4 entry = segment_color(s, ends, whole, x_in);
    const vec3 color = kShaded != 0u ? shade(entry.rgb, s, 0.5 * (ends.x + ends.y)) : entry.rgb;
    composite(a, color, entry.a);
}

Marched march_alpha(RaySampler s, vec2 t, bool inside) {
    Accumulator a = Accumulator(vec4(0.0), vec4(0.0));
    const float h = frame.step;
    const float opaque = 1.0 - frame.min_transmittance;
    float k = floor(t.x / h);
    const float last = inside ? ceil(t.y / h) - 1.0 : k;
    float x_in = kPreintegrated != 0u ? table_x(value_at(s, t.x)) : 0.0;

    add_segment(a, s, segment(k, t), false, x_in);
    k += 1.0;
    if (k < last) {
        if (kShaded != 0u) {
            do {
                vec4 entry;
                do { // to the next segment that is not transparent
                    entry = segment_color(s, vec2(k * h, (k + 1.0) * h), true, x_in);
                    k += 1.0;
                } while (entry.a <= 0.0 && k < last);
                composite(a, shade(entry.rgb, s, (k - 0.5) * h), entry.a);
            } while (k < last && a.sum.a <= opaque);
        } else {
            do {
                const vec4 entry = segment_color(s, vec2(k * h, (k + 1.0) * h), true, x_in);
                composite(a, entry.rgb, entry.a);
                k += 1.0;
            } while (k < last && a.sum.a <= opaque);
        }
    }
    if (k == last && a.sum.a <= opaque)
        add_segment(a, s, segment(k, t), false, x_in);
    return Marched(inside ? a.sum : vec4(0.0), kNaN, kNaN);
}

// ---- maximum intensity ----

float mip_sample(RaySampler s, float t, float maximum) {
    const float value = value_at(s, t);
    bool counts = value > maximum; // false for no-data
#if HAS_LABELS
    counts = counts && label_tint(s, t).a >= 0.0;
#endif
    return counts ? value : maximum;
}

Marched march_mip(RaySampler s, vec2 t, bool inside) {
    const float none = -3.4e38;
    const float h = frame.step;
    float k = floor(t.x / h);
    const float last = inside ? ceil(t.y / h) - 1.0 : k;
    const vec2 first = segment(k, t);
    float maximum = mip_sample(s, 0.5 * (first.x + first.y), none);
    k += 1.0;
    if (k < last) {
        do {
            maximum = mip_sample(s, (k + 0.5) * h, maximum);
            k += 1.0;
        } while (k < last);
    }
    if (k == last) {
        const vec2 ends = segment(k, t);
        maximum = mip_sample(s, 0.5 * (ends.x + ends.y), maximum);
    }
    const bool found = inside && maximum > none;
    const vec4 entry = table_entry(table_x(maximum), kTableRowTau);
    const float alpha = found ? hidden_by(entry.a * frame.opacity_unit_mm) : 0.0;
    return Marched(vec4(entry.rgb, 1.0) * alpha, found ? maximum : kNaN, kNaN);
}

// ---- iso-surfaces ----

// How many iso-values a value reaches.
int level_of(float value) {
    int level = 0;
    for (uint i = 0u; i < kIsoCount; ++i)
        level += value >= frame.iso_values[i] ? 1 : 0;
    return level;
}

// Where the value is `iso` between a and b, by false position: (t, value - iso) at either end.
float crossing(RaySampler s, vec2 a, vec2 b, float iso) {
    for (int i = 0; i < 4; ++i) {
        const float t = a.x - a.y * (b.x - a.x) / (b.y - a.y);
        const vec2 m = vec2(t, value_at(s, t) - iso);
        const bool low = (m.y >= 0.0) == (a.y >= 0.0);
        a = low ? m : a;
        b = low ? b : m;
    }
    return a.x - a.y * (b.x - a.x) / (b.y - a.y);
}

Marched march_iso(RaySampler s, vec2 t, bool inside) {
    Accumulator a = Accumulator(vec4(0.0), vec4(0.0));
    Marched result = Marched(vec4(0.0), kNaN, kNaN);
    const float h = frame.step;
    const float opaque = 1.0 - frame.min_transmittance;
    // Samples: the start, the middle of each segment, the end.
    float k = floor(t.x / h) - 1.0;
    const float last = inside ? ceil(t.y / h) : k; // beyond the last segment: the end
    float t_now = t.x, v_now = value_at(s, t.x);
    float t_was, v_was;
    int level = level_of(v_now);
    int level_now;
    bool going;
    do {
        do {
            t_was = t_now;
            v_was = v_now;
            k += 1.0;
            const vec2 ends = segment(k, t);
            t_now = k < last ? 0.5 * (ends.x + ends.y) : t.y;
            v_now = value_at(s, t_now);
            level_now = level_of(v_now);
            if (kHasNoData != 0u) { // nothing crosses beside missing data; the next sample starts anew
                level_now = v_now == v_now ? level_now : level;
                level = v_was == v_was ? level : level_now;
            }
        } while (level_now == level && k < last);
        going = inside && k <= last;
        const int direction = level_now > level ? 1 : -1;
        do {
            const bool hit = going && level_now != level;
            const int which = direction > 0 ? level : level - 1;
            const uint i = uint(clamp(which, 0, int(kIsoCount) - 1));
            const float iso = frame.iso_values[i];
            const float at = crossing(s, vec2(t_was, v_was - iso), vec2(t_now, v_now - iso), iso);
            vec4 color = frame.iso_colors[i];
#if HAS_LABELS
            const vec4 tint = label_tint(s, at);
            color.rgb = mix(color.rgb, tint.rgb, max(tint.a, 0.0));
            color.a = tint.a < 0.0 ? 0.0 : color.a;
#endif
            color.a = hit ? color.a : 0.0;
            composite(a, shade(color.rgb, s, at), color.a);
            const bool first = color.a > 0.0 && isnan(result.depth);
            result.depth = first ? at : result.depth;
            result.value = first ? iso : result.value;
            going = going && a.sum.a <= opaque;
            level += hit ? direction : 0;
            t_was = at;
            v_was = iso;
        } while (kIsoCount > 1u && going && level_now != level);
        going = going && k < last;
    } while (going);
    result.color = a.sum;
    return result;
}

Marched march(RaySampler s, vec2 t, bool inside) {
    if (kMode == kModeMip)
        return march_mip(s, t, inside);
    if (kMode == kModeIso)
        return march_iso(s, t, inside);
    return march_alpha(s, t, inside);
}
