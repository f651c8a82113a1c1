// The march of each mode. Included by ray_cast.comp.
//
// All lanes of a subgroup leave a loop together: docs/decisions/10-loops-that-lanes-leave.md.

struct Marched {
    vec4 color;  // premultiplied; a is what the ray hides
    float value; // MIP: the maximum or minimum; iso: the value of the first hit; else NaN
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

// A segment that hides nothing leaves the sum as it is, to the bit.
void composite(inout Accumulator a, vec3 color, float alpha) {
    const Accumulator before = a;
    add(a, ((1.0 - before.sum.a) * alpha) * vec4(color, 1.0));
    a.sum = alpha > 0.0 ? a.sum : before.sum;
    a.carry = alpha > 0.0 ? a.carry : before.carry;
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

// The start of a segment in the transfer table (preintegrated only).
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

// The segment to take after segment k: the next one, or the first that does not lie in empty space.
float segment_after(RaySampler s, float k) {
    float next = k + 1.0;
    if (kSkip != 0u) {
        // A midpoint sample concerns one point; a table integral all values between two nodes.
        const float from = kPreintegrated != 0u ? k + 1.0 : k + 0.5;
        const float free = empty_until(s.cells, from * frame.step) / frame.step - kClearance;
        next = max(next, kPreintegrated != 0u ? floor(free) : ceil(free - 0.5));
    }
    return next;
}

// Preintegrated, unshaded: marches from node to node, so that each takes one sample. After a jump
// the segment that ends at the new node is not joined to the one before, and adds nothing.
void march_nodes(inout Accumulator a, RaySampler s, inout float k, float end, float opaque,
                 inout TableState state, inout bool joined) {
    const float h = frame.step;
    bool going = k < end;
    do {
        if (going) {
            vec4 entry = segment_color(s, vec2(k * h, (k + 1.0) * h), true, state);
            entry.a = joined ? entry.a : 0.0;
            composite(a, entry.rgb, entry.a);
            const float node = segment_after(s, k);
            joined = node == k + 1.0;
            k = joined ? node : node - 1.0;
            going = k < end && a.sum.a <= opaque;
        }
    } while (subgroupAny(going));
}

Marched march_alpha(RaySampler s, vec2 t, vec2 span, bool inside) {
    Accumulator a = Accumulator(vec4(0.0), vec4(0.0));
    const float h = frame.step;
    const float opaque = 1.0 - frame.min_transmittance;
    float k = floor(t.x / h);
    const float last = inside ? ceil(t.y / h) - 1.0 : k;
    const float end = min(last, floor(span.y / h) + 1.0); // nothing is seen beyond
    TableState state;
    bool joined = true; // whether `state` is that of node k
    if (kPreintegrated != 0u)
        state = table_state(texel_at(s, t.x));

    add_segment(a, s, segment(k, t), state);
    k = max(k + 1.0, floor(span.x / h));
    bool going = k < end;
    if (kShaded != 0u) {
        do {
            if (going) {
                float found;
                vec4 entry;
                bool meets;
                do { // until one lane meets something: shading it takes longest
                    if (kPreintegrated != 0u)
                        state = table_state(texel_at(s, k * h));
                    entry = segment_color(s, vec2(k * h, (k + 1.0) * h), true, state);
                    found = k;
                    k = segment_after(s, k);
                    meets = entry.a > 0.0 || k >= end;
                } while (!subgroupAny(meets));
                composite(a, shade(entry.rgb, s, (found + 0.5) * h), entry.a);
                going = k < end && a.sum.a <= opaque;
            }
        } while (subgroupAny(going));
    } else if (kPreintegrated != 0u) {
        if (going)
            state = table_state(texel_at(s, k * h));
        march_nodes(a, s, k, end, opaque, state, joined);
    } else {
        do {
            if (going) {
                const vec4 entry = segment_color(s, vec2(k * h, (k + 1.0) * h), true, state);
                composite(a, entry.rgb, entry.a);
                k = segment_after(s, k);
                going = k < end && a.sum.a <= opaque;
            }
        } while (subgroupAny(going));
    }
    if (k == last && joined && a.sum.a <= opaque) {
        if (kPreintegrated != 0u)
            state = table_state(texel_at(s, k * h));
        add_segment(a, s, segment(k, t), state);
    }
    return Marched(inside ? a.sum : vec4(0.0), kNaN, kNaN);
}

// ---- maximum intensity ----

// Texels are turned over where the smallest value is shown (frame.mip_sign).
float mip_sample(RaySampler s, float t, float maximum) {
    const float texel = frame.mip_sign * texel_at(s, t);
    bool counts = texel > maximum; // false for no-data
#if HAS_LABELS
    counts = counts && label_tint(s, t).a >= 0.0;
#endif
    return counts ? texel : maximum;
}

const float kNoTexel = -3.4e38;
float highest_texel = kNoTexel; // of the last march

Marched mip_of(float maximum) {
    const bool found = maximum > kNoTexel;
    const float texel = frame.mip_sign * maximum;
    const vec4 entry = table_entry(texel, kTableRowTau);
    const float alpha = found ? hidden_by(entry.a * frame.opacity_unit_mm) : 0.0;
    const float value = texel * frame.value_scale + frame.value_bias;
    return Marched(vec4(entry.rgb, 1.0) * alpha, found ? value : kNaN, kNaN);
}

Marched march_mip(RaySampler s, vec2 t, vec2 span, bool inside) {
    const float h = frame.step;
    float k = floor(t.x / h);
    const float last = inside ? ceil(t.y / h) - 1.0 : k;
    const vec2 first = segment(k, t);
    float maximum = mip_sample(s, 0.5 * (first.x + first.y), kNoTexel);
    k += 1.0;
    bool going = k < last;
    if (kSkip != 0u) {
        const float first = uintBitsToFloat(slabs[slab_words]);
        const float count = uintBitsToFloat(slabs[slab_words + 1u]);
        uint at = slab_words + 2u;
        const uint slabs_end = slab_words + kMipWords;
        do { // while there may be something higher
            if (going) {
                const uint slab = slabs[at];
                going = uintBitsToFloat(slab) > maximum;
                const float begin = first + float(slab & (kMipSlabs - 1u)) * count;
                float j = max(begin, k);
                const float end = going ? min(begin + count, last) : j;
                do {
                    if (j < end) {
                        maximum = mip_sample(s, (j + 0.5) * h, maximum);
                        j += 1.0;
                    }
                } while (subgroupAny(j < end));
                at += 1u;
                going = going && at < slabs_end;
            }
        } while (subgroupAny(going));
    } else {
        do {
            if (going) {
                maximum = mip_sample(s, (k + 0.5) * h, maximum);
                k += 1.0;
                going = k < last;
            }
        } while (subgroupAny(going));
    }
    if (inside && last > floor(t.x / h)) {
        const vec2 ends = segment(last, t);
        maximum = mip_sample(s, 0.5 * (ends.x + ends.y), maximum);
    }
    highest_texel = inside ? maximum : kNoTexel;
    return mip_of(highest_texel);
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

// The place where the texel is `iso` between a and b, by false position: (t, texel - iso) at both ends.
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

// Sample k of a ray: the middle of segment k, within the ray's stretch. Those below and above it
// are its start and its end.
float iso_place(float k, vec2 t) { return clamp((k + 0.5) * frame.step, t.x, t.y); }

Marched march_iso(RaySampler s, vec2 t, vec2 span, bool inside) {
    Accumulator a = Accumulator(vec4(0.0), vec4(0.0));
    Marched result = Marched(vec4(0.0), kNaN, kNaN);
    const float h = frame.step;
    const float opaque = 1.0 - frame.min_transmittance;
    float k = floor(t.x / h - 0.5);
    const float last = inside ? ceil(t.y / h - 0.5) : k;
    const float end = min(last, floor(span.y / h + 0.5) + 1.0); // nothing is met beyond
    vec2 was, now = vec2(t.x, texel_at(s, t.x)); // (distance, texel)
    int level = level_of(now.y);
    k = clamp(floor(span.x / h - 0.5), k, last);
#if HAS_FIRST_HITS
    if (kRays == kRaysListed) { // may begin further on, where as many isos are reached as at its start
        const float later = clamp(floor(likely_start / h - 0.5), k, max(k, last - 1.0));
        k = level_of(texel_at(s, iso_place(later, t))) == level ? later : k;
    }
#endif
    int level_now = level;
    bool going = inside;
    do {
        if (going) {
            bool seeks = true;
            do {
                if (seeks) {
                    if (kSkip != 0u) { // to the last sample that lies in empty space
                        const float free =
                            empty_until(s.cells, iso_place(k, t)) / h - 0.5 - kClearance;
                        k = clamp(floor(free), k, last - 1.0);
                    }
                    if (kHasNoData != 0u)
                        was.y = texel_at(s, iso_place(k, t));
                    k += 1.0;
                    now.x = iso_place(k, t);
                    now.y = texel_at(s, now.x);
                    level_now = level_of(now.y);
                    if (kHasNoData != 0u) { // nothing crosses beside missing data; the next sample starts anew
                        level_now = now.y == now.y ? level_now : level;
                        level = was.y == was.y ? level : level_now;
                    }
                    seeks = level_now == level && k < end;
                }
            } while (subgroupAny(seeks));
            was.x = iso_place(k - 1.0, t);
            was.y = texel_at(s, was.x);
            bool crosses = level_now != level;
            do {
                if (crosses) {
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
                    composite(a, shade_surface(color.rgb, s, at, iso), color.a);
                    const bool first = color.a > 0.0 && isnan(result.depth);
                    result.depth = first ? at : result.depth;
                    result.value =
                        first ? iso * frame.value_scale + frame.value_bias : result.value;
                    going = a.sum.a <= opaque;
                    level += direction;
                    was = vec2(at, iso);
                    crosses = going && level_now != level;
                }
            } while (kIsoCount > 1u && subgroupAny(crosses));
            going = going && k < end;
        }
    } while (subgroupAny(going));
    result.color = a.sum;
    return result;
}

#endif

#if IS_EXACT
#include "shaders/lib/ray_exact.glsl"
#endif

Marched march(RaySampler s, vec2 t, vec2 span, bool inside) {
#if IS_EXACT && IS_ISO
    return march_iso_exact(s, t, span, inside);
#elif IS_EXACT
    if (kMode == kModeMip)
        return march_mip_exact(s, t, span, inside);
    return march_alpha_exact(s, t, span, inside);
#elif IS_ISO
    return march_iso(s, t, span, inside);
#else
    if (kMode == kModeMip)
        return march_mip(s, t, span, inside);
    return march_alpha(s, t, span, inside);
#endif
}
