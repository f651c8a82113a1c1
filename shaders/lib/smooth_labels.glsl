// Edges of labels between samples: the rule of LabelEdges::smooth (docs/reference/scene.md).
// A label's weight at a point is the sum of the linear weights of the eight samples about it that have
// it. The largest is seen there; where the two largest are equal its edge runs.

struct LabelPlace {
    uint label, other; // of the largest weight and of the next; the same where there is one alone
    float margin;      // between the two weights
    vec3 slope;        // of the margin, per sample
};

// From the labels of the samples (x fastest) and the place among them, 0 .. 1. Turns are as many as
// there are labels about: mostly one.
LabelPlace place_among(uint labels_about[8], vec3 f) {
    vec4 shares[8]; // the linear weight's slope, and the weight
    for (uint j = 0u; j < 8u; ++j) {
        const bvec3 high = bvec3((j & 1u) != 0u, (j & 2u) != 0u, (j & 4u) != 0u);
        const vec3 s = mix(1.0 - f, f, high);
        const vec3 way = mix(vec3(-1.0), vec3(1.0), high);
        shares[j] = vec4(way * vec3(s.y * s.z, s.x * s.z, s.x * s.y), s.x * s.y * s.z);
    }
    uint label = labels_about[0], other = labels_about[0];
    vec4 most = vec4(0.0), next = vec4(0.0);
    uint left = 0xffu; // corners whose label has not had its turn
    while (left != 0u) {
        uint asked = 0u;
        for (uint j = 0u; j < 8u; ++j)
            asked = (left & 0x80u >> j) != 0u ? labels_about[7u - j] : asked;
        vec4 sum = vec4(0.0);
        uint same = 0u;
        for (uint j = 0u; j < 8u; ++j) {
            const bool is_same = labels_about[j] == asked;
            sum += is_same ? shares[j] : vec4(0.0);
            same |= is_same ? 1u << j : 0u;
        }
        const bool first = sum.w > most.w, second = !first && sum.w > next.w;
        other = first ? label : second ? asked : other;
        next = first ? most : second ? sum : next;
        label = first ? asked : label;
        most = first ? sum : most;
        left &= ~same;
    }
    return LabelPlace(label, next.w > 0.0 ? other : label, most.w - next.w, most.xyz - next.xyz);
}

// How opaque a label lies over a slice so many pixels within its edge.
float label_cover(uint label, float depth_px, bool edge, float outline_px, float fill) {
    const float line = clamp(outline_px - depth_px + 0.5, 0.0, 1.0);
    const float outline = outline_px > 0.0 ? (edge ? 1.0 : line) : 0.0;
    return label == 0u ? 0.0 : mix(fill, 1.0, outline);
}
