// Edges of labels between samples: the rule of LabelEdges::smooth (docs/reference/scene.md).
// A label's weight at a point is the sum of the linear weights of the eight samples about it that have
// it. The largest is seen there; where the two largest are equal its edge runs.

struct LabelPlace {
    uint label, other; // of the largest weight and of the next; the same where there is one alone
    float margin;      // between the two weights
    vec3 slope;        // of the margin, per sample
};

vec3 share_of(uint corner, vec3 f) {
    return mix(1.0 - f, f, bvec3((corner & 1u) != 0u, (corner & 2u) != 0u, (corner & 4u) != 0u));
}

// From the labels of the samples (x fastest) and the place among them, 0 .. 1.
LabelPlace place_among(uint labels_about[8], vec3 f) {
    float weight[8];
    vec3 rise[8];
    for (uint i = 0u; i < 8u; ++i) {
        weight[i] = 0.0;
        rise[i] = vec3(0.0);
        for (uint j = 0u; j < 8u; ++j) {
            const vec3 s = share_of(j, f);
            const vec3 way =
                mix(vec3(-1.0), vec3(1.0),
                    bvec3((j & 1u) != 0u, (j & 2u) != 0u, (j & 4u) != 0u));
            const float same = labels_about[j] == labels_about[i] ? 1.0 : 0.0;
            weight[i] += same * s.x * s.y * s.z;
            rise[i] += same * way * vec3(s.y * s.z, s.x * s.z, s.x * s.y);
        }
    }
    LabelPlace place = LabelPlace(labels_about[0], labels_about[0], weight[0], rise[0]);
    for (uint i = 1u; i < 8u; ++i) {
        const bool more = weight[i] > place.margin;
        place.label = more ? labels_about[i] : place.label;
        place.slope = more ? rise[i] : place.slope;
        place.margin = more ? weight[i] : place.margin;
    }
    float next = 0.0;
    vec3 next_rise = vec3(0.0);
    place.other = place.label;
    for (uint i = 0u; i < 8u; ++i) {
        const bool more = labels_about[i] != place.label && weight[i] > next;
        place.other = more ? labels_about[i] : place.other;
        next_rise = more ? rise[i] : next_rise;
        next = more ? weight[i] : next;
    }
    place.margin -= next;
    place.slope -= next_rise;
    return place;
}

// How opaque a label lies over a slice so many pixels within its edge.
float label_cover(uint label, float depth_px, bool edge, float outline_px, float fill) {
    const float line = clamp(outline_px - depth_px + 0.5, 0.0, 1.0);
    const float outline = outline_px > 0.0 ? (edge ? 1.0 : line) : 0.0;
    return label == 0u ? 0.0 : mix(fill, 1.0, outline);
}
