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

// 1 - exp(-x) without cancellation: the series to x^5 is good to 2e-8 of itself below 0.1, where the
// difference begins to keep six digits.
float hidden_by(float optical_depth) {
    const float x = optical_depth;
    const float series = x * (1.0 - x * (1.0 / 2.0) * (1.0 - x * (1.0 / 3.0) *
                              (1.0 - x * (1.0 / 4.0) * (1.0 - x * (1.0 / 5.0)))));
    return x < 0.1 ? series : 1.0 - exp(-x);
}

bool is_data(float texel) { return kHasNoData == 0u || texel == texel; }

// Segment k of the lattice, cut to [t.x, t.y].
vec2 segment(float k, vec2 t) {
    return vec2(max(k * frame.step, t.x), min((k + 1.0) * frame.step, t.y));
}

#if !IS_ISO

// ---- alpha ----

// Where a segment starts in the transfer table (preintegrated only).
struct TableState {
    float position;
    vec4 integral;
};

TableState table_state(float texel) {
    const float position = table_position(texel);
    return TableState(position, table_integral(position));
}

// Colour and opacity of one segment; `whole` says that it is one full step long. `state` moves from
// the segment's start to its end.
vec4 segment_color(RaySampler s, vec2 ends, bool whole, inout TableState state) {
    const float middle = 0.5 * (ends.x + ends.y);
    const float length_mm = max(ends.y - ends.x, 0.0);
    vec4 entry;
    bool valid;
    if (kPreintegrated != 0u) {
        const TableState end = table_state(texel_at(s, ends.y));
        const float width = end.position - state.position;
        const bool narrow = abs(width) < 1.0;
        const float between = 0.5 * (state.position + end.position);
        const vec4 point =
            textureLod(table, vec2((between + 0.5) / float(kTableEntries), float(kTableRowTau)), 0.0);
        const vec4 mean = (end.integral - state.integral) / (narrow ? 1.0 : width);
        valid = is_data(state.position) && is_data(end.position);
        entry.rgb = narrow ? point.rgb : mean.rgb / max(mean.a, 1e-30);
        entry.a = hidden_by(max(narrow ? point.a : mean.a, 0.0) * length_mm);
        state = end;
    } else {
        const float texel = texel_at(s, middle);
        valid = is_data(texel);
        if (whole) {
            entry = table_entry(texel, kTableRowStep);
        } else {
            entry = table_entry(texel, kTableRowTau);
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

void add_segment(inout Accumulator a, RaySampler s, vec2 ends, inout TableState state) {
    const vec4 entry = segment_color(s, ends, false, state);
    const vec3 color = kShaded != 0u ? shade(entry.rgb, s, 0.5 * (ends.x + ends.y)) : entry.rgb;
    composite(a, color, entry.a);
}

Marched march_alpha(RaySampler s, vec2 t, bool inside) {
    Accumulator a = Accumulator(vec4(0.0), vec4(0.0));
    const float h = frame.step;
    const float opaque = 1.0 - frame.min_transmittance;
    float k = floor(t.x / h);
    const float last = inside ? ceil(t.y / h) - 1.0 : k;
    TableState state;
    if (kPreintegrated != 0u)
        state = table_state(texel_at(s, t.x));

    add_segment(a, s, segment(k, t), state);
    k += 1.0;
    if (k < last) {
        if (kShaded != 0u) {
            do {
                vec4 entry;
                do { // to the next segment that is not transparent
                    // Taken anew: llvmpipe of Mesa 22.3 loses a state that is carried through an
                    // inner loop which lanes leave at different times (a test would show it).
                    if (kPreintegrated != 0u)
                        state = table_state(texel_at(s, k * h));
                    entry = segment_color(s, vec2(k * h, (k + 1.0) * h), true, state);
                    k += 1.0;
                } while (entry.a <= 0.0 && k < last);
                composite(a, shade(entry.rgb, s, (k - 0.5) * h), entry.a);
            } while (k < last && a.sum.a <= opaque);
        } else {
            do {
                const vec4 entry = segment_color(s, vec2(k * h, (k + 1.0) * h), true, state);
                composite(a, entry.rgb, entry.a);
                k += 1.0;
            } while (k < last && a.sum.a <= opaque);
        }
    }
    if (k == last && a.sum.a <= opaque) {
        if (kPreintegrated != 0u && kShaded != 0u)
            state = table_state(texel_at(s, k * h));
        add_segment(a, s, segment(k, t), state);
    }
    return Marched(inside ? a.sum : vec4(0.0), kNaN, kNaN);
}

// ---- maximum intensity ----

float mip_sample(RaySampler s, float t, float maximum) {
    const float texel = texel_at(s, t);
    bool counts = texel > maximum; // false for no-data
#if HAS_LABELS
    counts = counts && label_tint(s, t).a >= 0.0;
#endif
    return counts ? texel : maximum;
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
    const vec4 entry = table_entry(maximum, kTableRowTau);
    const float alpha = found ? hidden_by(entry.a * frame.opacity_unit_mm) : 0.0;
    const float value = maximum * frame.value_scale + frame.value_bias;
    return Marched(vec4(entry.rgb, 1.0) * alpha, found ? value : kNaN, kNaN);
}

#else

// ---- iso-surfaces ----

// How many iso-values a texel reaches.
int level_of(float texel) {
    int level = texel >= frame.iso_texels[0] ? 1 : 0;
    for (uint i = 1u; i < kIsoCount; ++i)
        level += texel >= frame.iso_texels[i] ? 1 : 0;
    return level;
}

// Where the texel is `iso` between a and b, by false position: (t, texel - iso) at either end.
float crossing(RaySampler s, vec2 a, vec2 b, float iso) {
    for (int i = 0; i < 4; ++i) {
        const float t = a.x - a.y * (b.x - a.x) / (b.y - a.y);
        const vec2 m = vec2(t, texel_at(s, t) - iso);
        const bool low = (m.y >= 0.0) == (a.y >= 0.0);
        a = low ? m : a;
        b = low ? b : m;
        if (kHasNoData != 0u && m.y != m.y) { // a gap in the data: no better place is known
            a = vec2(t, 0.0);
            b = vec2(t, 1.0);
        }
    }
    return a.x - a.y * (b.x - a.x) / (b.y - a.y);
}

Marched march_iso(RaySampler s, vec2 t, bool inside) {
    Accumulator a = Accumulator(vec4(0.0), vec4(0.0));
    Marched result = Marched(vec4(0.0), kNaN, kNaN);
    const float h = frame.step;
    const float opaque = 1.0 - frame.min_transmittance;
    // Samples: the start, the middle of each segment of the lattice within, the end.
    float k = floor(t.x / h - 0.5);
    const float last = inside ? ceil(t.y / h - 0.5) : k;
    vec2 was, now = vec2(t.x, texel_at(s, t.x)); // (distance, texel)
    int level = level_of(now.y);
    int level_now;
    bool going;
    do {
        do {
            was = now;
            k += 1.0;
            now.x = clamp((k + 0.5) * h, t.x, t.y);
            now.y = texel_at(s, now.x);
            level_now = level_of(now.y);
            if (kHasNoData != 0u) { // nothing crosses beside missing data; the next sample starts anew
                level_now = now.y == now.y ? level_now : level;
                level = was.y == was.y ? level : level_now;
            }
        } while (level_now == level && k < last);
        going = inside;
        do {
            const bool hit = going && level_now != level;
            const int direction = level_now > level ? 1 : -1;
            const int which = direction > 0 ? level : level - 1;
            const uint i = kIsoCount == 1u ? 0u : uint(clamp(which, 0, int(kIsoCount) - 1));
            const float iso = frame.iso_texels[i];
            const float at = crossing(s, was - vec2(0.0, iso), now - vec2(0.0, iso), iso);
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
            result.value = first ? iso * frame.value_scale + frame.value_bias : result.value;
            going = going && a.sum.a <= opaque;
            level += hit ? direction : 0;
            was = vec2(at, iso);
        } while (kIsoCount > 1u && going && level_now != level);
        going = going && k < last;
    } while (going);
    result.color = a.sum;
    return result;
}

#endif

#if IS_EXACT
#include "shaders/lib/ray_exact.glsl"
#endif

Marched march(RaySampler s, vec2 t, bool inside) {
#if IS_EXACT && IS_ISO
    return march_iso_exact(s, t, inside);
#elif IS_EXACT
    if (kMode == kModeMip)
        return march_mip_exact(s, t, inside);
    return march_alpha_exact(s, t, inside);
#elif IS_ISO
    return march_iso(s, t, inside);
#else
    if (kMode == kModeMip)
        return march_mip(s, t, inside);
    return march_alpha(s, t, inside);
#endif
}
