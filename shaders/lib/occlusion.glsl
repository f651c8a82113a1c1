// Ambient occlusion of an iso-surface: RayCastLayer::occlusion_mm says what it is. Included by
// ray_sampling.glsl where IS_ISO. Needs texel_at_index().

// The six orders of three numbers and the signs of the first two give 24 axes; with their opposites
// they are the corners of a truncated cuboctahedron, whose edges are all of one length.
const vec3 kOcclusionCorner = vec3(0.21573943, 0.52084105, 0.82594268);

vec3 occlusion_axis(uint i) {
    const vec3 c = kOcclusionCorner;
    const uint order = i >> 2;
    const vec3 even = order == 0u ? c.xyz : order == 1u ? c.yzx : c.zxy;
    const vec3 odd = order == 3u ? c.xzy : order == 4u ? c.zyx : c.yxz;
    const vec3 signs = vec3((i & 1u) != 0u ? -1.0 : 1.0, (i & 2u) != 0u ? -1.0 : 1.0, 1.0);
    return signs * (order < 3u ? even : odd);
}

// How free a place is, 0 .. 1. `rise` is 1 where values below iso are free, -1 where those above;
// `share` is one over the texels over which a place becomes hidden.
float freedom_at(vec3 index, float iso, float rise, float share) {
    const bool within = all(greaterThanEqual(index, vec3(0.0))) &&
                        all(lessThanEqual(index, frame.last));
    const float texel = texel_at_index(clamp(index, vec3(0.0), frame.last));
    float free = clamp(rise * (iso - texel) * share, 0.0, 1.0);
    free = within && texel == texel ? free : 1.0;
    const float per_mm = kOcclusionFall / frame.occlusion_mm;
    for (uint i = 0u; i < frame.clip_count; ++i) {
        const float kept_mm = dot(frame.clips[i].normal, index) + frame.clips[i].offset;
        free = max(free, clamp(-kept_mm * per_mm, 0.0, 1.0));
    }
    return free;
}

float openness(RaySampler s, float t, float iso) {
    const vec3 g = gradient_index_at(s, t);
    const vec3 g_world = frame.world_from_index_covector * g;
    const float slope = length(g_world); // value units per mm
    const bool has_normal = slope > 0.0; // not where a neighbour has no data
    const float rise = dot(g, s.ray.direction) > 0.0 ? 1.0 : -1.0;
    const vec3 normal = has_normal ? (-rise / slope) * g_world : vec3(0.0, 0.0, 1.0);
    const float fall_mm = frame.occlusion_mm / kOcclusionFall;
    const float share = frame.value_scale / (has_normal ? slope * fall_mm : 1.0);
    const vec3 start =
        s.ray.origin + t * s.ray.direction + frame.index_from_world * (fall_mm * normal);
    const float step_mm = frame.occlusion_mm / float(kOcclusionSteps);
    float sum = 0.0, weights = 0.0;
    for (uint i = 0u; i < kOcclusionAxes; ++i) {
        const vec3 axis = occlusion_axis(i);
        const float cosine = dot(axis, normal);
        const vec3 step = frame.index_from_world * ((cosine < 0.0 ? -step_mm : step_mm) * axis);
        float free = 1.0, free_steps = 0.0;
        for (uint k = 0u; k < kOcclusionSteps; ++k) {
            free = min(free, freedom_at(start + (float(k) + 0.5) * step, iso, rise, share));
            free_steps += free;
        }
        sum += abs(cosine) * free_steps;
        weights += abs(cosine);
    }
    return has_normal ? sum / (weights * float(kOcclusionSteps)) : 1.0;
}
