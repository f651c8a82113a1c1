// Caps of iso-surfaces. Included by ray_cast.comp where IS_ISO.

// If a clip plane cuts into the inside of an iso-surface, the cut is closed: in the colour of the
// innermost surface about it, and lit by the plane's normal. `cut` is the cosine between that and
// the ray where distance t lies on a clip plane, else 0.
Marched cap_of(RaySampler s, float t, float cut) {
    Marched cap = Marched(vec4(0.0), kNaN, kNaN);
    const int level = cut > 0.0 ? level_of(texel_at(s, t)) : 0;
    if (level > 0) {
        const uint i = uint(level - 1);
        vec4 color = frame.iso_colors[i];
#if HAS_LABELS
        const vec4 tint = label_tint(s, t);
        color.rgb = mix(color.rgb, tint.rgb, max(tint.a, 0.0));
        color.a = tint.a < 0.0 ? 0.0 : color.a;
#endif
        const vec3 seen = kLight != 0u ? lit_from_light(color.rgb, cut_normal, 1.0, s.ray.direction)
                                       : lit(color.rgb, cut);
        cap.color = color.a * vec4(seen, 1.0);
        cap.depth = color.a > 0.0 ? t : kNaN;
        cap.value = color.a > 0.0 ? frame.iso_texels[i] * frame.value_scale + frame.value_bias
                                  : kNaN;
    }
    return cap;
}

// One thing seen before another.
Marched over(Marched front, Marched behind) {
    const bool has_front = front.color.a > 0.0;
    return Marched(front.color + (1.0 - front.color.a) * behind.color,
                   has_front ? front.value : behind.value, has_front ? front.depth : behind.depth);
}
